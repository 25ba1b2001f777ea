"""Torque captures of a slowly turned shaft, as other stands write them."""

import numpy as np
import pytest

from bench.analysis import analyze_cogging
from bench.analysis.statements import read_statements
from bench.captures import CaptureError
from tests.command_line import Call

#: Peak to peak of the torque below, by its own course.
_FINE = np.linspace(0.0, 2.0 * np.pi, 100_000)
TRUE = float(np.ptp(0.010 * np.cos(_FINE + 0.3) + 0.003 * np.cos(2.0 * _FINE)))


def torque_at(angle):
    cogging = 0.010 * np.cos(12.0 * angle + 0.3) + 0.003 * np.cos(24.0 * angle)
    return 0.03 + cogging + 0.004 * np.cos(angle + 1.0)


def record(path, *, rpm=6.0, turns=2.0, filtered=0.0, vibration=0.0, columns="angle", seed=1):
    rate, speed = 40.0, rpm * np.pi / 30.0
    time = np.arange(0.0, turns * 2.0 * np.pi / speed, 1.0 / rate)
    random = np.random.default_rng(seed)
    lag = np.arctan(12.0 * speed * filtered), np.arctan(24.0 * speed * filtered), np.arctan(speed * filtered)
    angle = speed * time
    torque = (
        0.03
        + 0.010 * np.cos(lag[0]) * np.cos(12.0 * angle + 0.3 - lag[0])
        + 0.003 * np.cos(lag[1]) * np.cos(24.0 * angle - lag[1])
        + 0.004 * np.cos(lag[2]) * np.cos(angle + 1.0 - lag[2])
    )
    torque = torque + vibration * np.cos(2.0 * np.pi * 3.1 * time) + 2e-4 * random.standard_normal(time.size)
    written, heading = {
        "angle": ((time, np.degrees(angle) % 360.0), "time (s),angle (deg)"),
        "angle only": ((np.degrees(angle) % 360.0,), "angle (deg)"),
        "speed": ((time, np.full(time.size, rpm)), "time (s),speed (rpm)"),
        "time": ((time,), "time (s)"),
        "no unit": ((time, np.degrees(angle)), "time (s),angle"),
    }[columns]
    np.savetxt(
        path,
        np.column_stack((*written, 1e3 * torque)),
        delimiter=",",
        fmt="%.7g",
        header=f"{heading},torque (mNm)",
        comments="",
    )
    return path


def holds(result, true=TRUE):
    low, high = result["parameters"]["cogging_torque"]["coverage_interval"]
    return low <= true <= high and high - low < 0.25 * true


@pytest.mark.parametrize("columns", ["angle", "speed", "time", "angle only"])
def test_the_angle_by_a_column_or_a_speed(tmp_path, columns):
    path = record(tmp_path / "turn.csv", columns=columns)
    result = analyze_cogging(path, speed_rpm=6.0 if columns == "time" else None)
    assert holds(result)
    assert result["details"]["orders"][0] == 12.0
    assert result["details"]["drag"] == pytest.approx(0.03, rel=0.02)
    at_rest = any("at rest" in said for said in result["assumptions"])
    assert at_rest is (columns == "angle only")


@pytest.mark.parametrize("heading", ["ch1 torq. (mNm)", "Trq_mes [mNm]", "Drehmoment (mNm)", "力矩 (mNm)"])
def test_a_torque_by_its_other_names(tmp_path, heading):
    path = record(tmp_path / "turn.csv")
    words = path.read_text(encoding="utf-8").replace("torque (mNm)", heading)
    path.write_text(words, encoding="utf-8")
    assert holds(analyze_cogging(path))
    path.write_text(words.replace("(mNm)", "").replace("[mNm]", ""), encoding="utf-8")
    with pytest.raises(CaptureError, match="states no unit, and torque may be in any of Nm, mNm"):
        analyze_cogging(path)


def test_a_known_order_on_a_part_of_a_turn(tmp_path):
    assert holds(analyze_cogging(record(tmp_path / "turn.csv", turns=0.5), order=12))


def test_a_stated_filter_is_undone(tmp_path):
    path = record(tmp_path / "turn.csv", filtered=0.1)
    assert holds(analyze_cogging(path, torque_filter=0.1))


def test_a_transducer_that_does_not_average_at_all_is_in_the_interval(tmp_path):
    # An averaging over 80 ms would take 1.5 %, several times the scatter: the truth is an end of the limit.
    held = 0
    for seed in range(12):
        path = record(tmp_path / "turn.csv", turns=4.0, seed=seed)
        low, high = analyze_cogging(path, order=12, averaging=0.08)["parameters"]["cogging_torque"]["coverage_interval"]
        held += low <= TRUE <= high
        assert high - low < 0.05 * TRUE
    assert held >= 11


def test_a_filter_that_nobody_states_shows_at_half_the_speed(tmp_path):
    first = record(tmp_path / "first.csv", filtered=0.1)
    second = record(tmp_path / "second.csv", filtered=0.1, rpm=3.0, turns=0.5, seed=2)
    result = analyze_cogging([first, second])
    assert "torque-filter" in {each["id"] for each in result["warnings"]}
    assert holds(result)
    # One speed does not show it, and the result says so.
    alone = analyze_cogging(first)
    assert not holds(alone)
    assert any("not seen at one speed" in said for said in alone["assumptions"])


def test_a_vibration_gives_no_figure(tmp_path):
    first = record(tmp_path / "first.csv", vibration=0.02)
    second = record(tmp_path / "second.csv", vibration=0.02, rpm=3.0, turns=0.6, seed=2)
    result = analyze_cogging([first, second])
    assert result["withheld"]["cogging_torque"]["cause"] == "vibration"


def test_stated_limits_are_in_the_budget(tmp_path):
    path = record(tmp_path / "turn.csv")
    result = analyze_cogging(path, order=12, averaging=0.0, accuracy=read_statements(["torque=1%"]))
    figure = result["parameters"]["cogging_torque"]
    assert figure["standard_uncertainty"] / figure["value"] == pytest.approx(0.01 / np.sqrt(3.0), rel=0.1)


@pytest.mark.parametrize(
    ("columns", "more", "message"),
    [
        ("time", {}, "nothing tells the angle.*--speed-rpm"),
        ("no unit", {}, "column 'angle' states no unit.*deg, rad"),
        ("angle", {"turns": 0.5}, "cover 0.50 of a turn"),
    ],
)
def test_what_cannot_be_used(tmp_path, columns, more, message):
    with pytest.raises(CaptureError, match=f"turn.csv.*{message}"):
        analyze_cogging(record(tmp_path / "turn.csv", columns=columns, **more))


def test_a_shaft_that_turns_back(tmp_path):
    angle = np.concatenate((np.arange(0.0, 400.0, 2.0), np.arange(400.0, 300.0, -2.0)))
    path = tmp_path / "turn.csv"
    np.savetxt(
        path,
        np.column_stack((angle, torque_at(np.radians(angle)))),
        delimiter=",",
        header="angle (deg),torque (Nm)",
        comments="",
    )
    with pytest.raises(CaptureError, match=r"turn.csv, line \d+: the angle 'angle' turns back by 9\d°"):
        analyze_cogging(path)


def test_a_second_record_at_another_speed(tmp_path):
    files = [record(tmp_path / f"{rpm:g}.csv", rpm=rpm) for rpm in (6.0, 4.0)]
    with pytest.raises(CaptureError, match=r"4.csv.*half the speed of the first: 4 rpm, but the first has 6 rpm"):
        analyze_cogging(files)
    with pytest.raises(CaptureError, match="same readings"):
        analyze_cogging([files[0], files[0]])


def test_typed_as_a_command(call: Call, tmp_path):
    path = record(tmp_path / "turn.csv")
    code, out, _ = call("analyze", "cogging", str(path), "--pole-pairs", "2")
    assert code == 0
    assert "Cogging torque" in out
    for typed in (("--order", "1"), ("--speed-rpm", "0"), ("--averaging", "20")):
        code, _, err = call("analyze", "cogging", str(path), *typed)
        assert code == 2
        assert typed[0] in err


def test_a_column_of_speed_says_what_it_is(tmp_path):
    path = record(tmp_path / "turn.csv", columns="speed")
    rows = path.read_text(encoding="utf-8")
    path.write_text(rows.replace("speed (rpm)", "speed"), encoding="utf-8")
    with pytest.raises(CaptureError, match=r"column 'speed' states no unit.*rpm, rad/s.*as in 'speed \(rpm\)'$"):
        analyze_cogging(path)
    header, _, data = rows.partition("\n")
    times, speeds, torques = np.loadtxt(data.splitlines(), delimiter=",", unpack=True)
    electrical = header.replace("speed (rpm)", "erpm (rpm)")
    np.savetxt(path, np.column_stack((times, 4.0 * speeds, torques)), delimiter=",", header=electrical, comments="")
    with pytest.raises(CaptureError, match=r"'erpm' is an electrical speed.*--pole-pairs"):
        analyze_cogging(path)
    result = analyze_cogging(path, pole_pairs=4)
    assert holds(result)
    assert any("divided by 4 pole pairs" in said for said in result["assumptions"])
