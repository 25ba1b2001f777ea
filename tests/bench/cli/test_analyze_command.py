import json
import re
import runpy
import shlex
from pathlib import Path

import numpy as np
import pytest

from tests.command_line import Call
from tests.studies.worlds import simulated as sim

DOCS = Path(__file__).parents[3] / "docs" / "how-to" / "captures.md"


@pytest.fixture
def emf(tmp_path: Path) -> Path:
    time, v = sim.emf_record(np.random.default_rng(1))
    path = tmp_path / "emf.csv"
    np.savetxt(path, np.column_stack((time, *v)), delimiter=",", header="t (s),CH1 (V),CH2 (V),CH3 (V)", comments="")
    return path


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", DOCS.read_text(encoding="utf-8"), flags=re.DOTALL)


def figures(shown: str) -> list[str]:
    """Lines without layout; what an interval spans is tested elsewhere."""
    plain = (re.sub(r"[─\s]+", " ", line).strip() for line in shown.splitlines())
    return [re.sub(r"\S+ … \S+", "…", line) for line in plain if line]


def test_the_worked_example_of_the_documentation(call: Call, tmp_path: Path) -> None:
    (script,) = (block for block in blocks("python") if "step.csv" in block)
    (tmp_path / "make_step.py").write_text(script, encoding="utf-8")
    runpy.run_path(str(tmp_path / "make_step.py"))
    (console,) = blocks("console")
    typed, _, shown = console.rpartition("$ ")[2].partition("\n")
    code, out, err = call(*shlex.split(typed)[1:])
    assert (code, err) == (0, "")
    assert figures(out) == figures(shown)
    _, told, _ = call(*shlex.split(typed)[1:], "--json")
    parameters = json.loads(told)["parameters"]
    for name, true in (("loop_resistance", 0.1), ("loop_inductance", 1e-4)):
        low, high = parameters[name]["coverage_interval"]
        assert low < true < high
        assert not any(row["kind"] == "B" for row in parameters[name]["budget"] if "fit" in row["source"])


def test_the_accuracy_file_of_the_documentation(call: Call, tmp_path: Path) -> None:
    (content,) = (block for block in blocks("toml") if "probe 7" in block)
    (tmp_path / "scope.toml").write_text(content, encoding="utf-8")
    time, v, i, _, _ = sim.step_record(np.random.default_rng(1), 8)
    np.savetxt("step.csv", np.column_stack((time, v, i)), delimiter=",", header="t (s),CH1 (V),CH2 (A)", comments="")
    code, out, _ = call("analyze", "step-response", "step.csv", "--accuracy-file", "scope.toml", "--json")
    assert code == 0
    rows = json.loads(out)["parameters"]["loop_inductance"]["budget"]
    assert {row["source"] for row in rows if row["kind"] == "B"} == {
        "probe 7, voltage: gain, as stated",
        "current channels: gain, as stated",
        "time base: gain, as stated",
        "skew of the channels: gain, as taken",
    }


def test_budgets_are_printed_where_asked_for(call: Call, emf: Path) -> None:
    arguments = ("analyze", "back-emf", str(emf), "--connection", "phase", "--speed-rpm", "795", "--accuracy", "CH1=3%")
    _, bare, _ = call(*arguments)
    assert "voltage channels: gain, as stated" not in bare
    code, out, _ = call(*arguments, "--budget")
    assert code == 0
    assert "voltage channels: gain, as stated" in out
    assert "all rows, root sum of squares" in out
    assert "It has no uncertainty, and so no budget." in out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--accuracy", "CH1"], "--accuracy CH1: give NAME=LIMITS"),
        (["--accuracy", "CH9=2%"], "--accuracy CH9=2%: the capture has no channel 'CH9'; allowed are voltage, time"),
        (["--accuracy", "current=2%"], "--accuracy current=2%: this analysis uses no current"),
        (["--temperature", "400"], "--temperature 400: allowed is a number from -60 to 250 °C"),
        (["--temperature-uncertainty", "2"], "--temperature-uncertainty 2: give --temperature too"),
        (["--temperature", "40", "--magnet-coefficient", "1"], "--magnet-coefficient 1: allowed"),
    ],
)
def test_what_cannot_be_is_said_plainly(call: Call, emf: Path, arguments: list[str], said: str) -> None:
    code, out, err = call("analyze", "back-emf", str(emf), *arguments)
    assert (code, out) == (2, "")
    assert err.startswith("motorbench: ")
    assert said in err


def test_a_bad_accuracy_file_is_one_clear_message(call: Call, emf: Path, tmp_path: Path) -> None:
    code, _, err = call("analyze", "back-emf", str(emf), "--accuracy-file", "none.toml")
    assert code == 2
    assert "none.toml: there is no such accuracy file" in err
    (tmp_path / "scope.toml").write_text('CH7 = "2%"\n', encoding="utf-8")
    code, _, err = call("analyze", "back-emf", str(emf), "--accuracy-file", "scope.toml")
    assert code == 2
    assert "scope.toml: CH7 = \"2%\": the capture has no channel 'CH7'" in err


def test_one_column_is_not_taken_as_voltage_and_current(call: Call, emf: Path) -> None:
    code, _, err = call("analyze", "step-response", str(emf), "--voltage", "CH1", "--current", "CH1")
    assert code == 2
    assert "'CH1' is asked for as voltage and as current" in err


@pytest.mark.parametrize(
    ("command", "columns", "more"),
    [
        (
            "back-emf",
            "t (s),CH1 (V),CH2 (V),CH3 (V)",
            ("--speed-rpm", "795", "--accuracy", "CH1=3%+5mV", "--connection", "line"),
        ),
        ("step-response", "t (s),CH1 (V),CH2 (A)", ("--temperature", "30")),
        ("coast-down", "t (s),speed (rad/s)", ("--inertia", "1e-4")),
        ("rotor-sweep", "theta (rad),L (H)", ()),
        ("table", "id (A),Ld (H)", ("--motor", "lg-400w")),
    ],
)
def test_an_analysis_speaks_chinese(call: Call, command: str, columns: str, more: tuple[str, ...]) -> None:
    random = np.random.default_rng(1)
    time, *emf = sim.emf_record(random)
    angle = np.linspace(0.0, 2.0 * np.pi, 73)
    step_time, v, i, *_ = sim.step_record(random, 8)
    falling = np.linspace(0.0, 5.0, 501)
    record = {
        "back-emf": (time, *np.vstack(emf)),
        "step-response": (step_time, v, i),
        "coast-down": (falling, 300.0 - 50.0 * falling + random.normal(0.0, 0.05, falling.size)),
        "rotor-sweep": (angle, 1e-4 * (1.0 - 0.2 * np.cos(8.0 * angle)) + random.normal(0.0, 1e-7, angle.size)),
        "table": ([0.0, -10.0], [73e-6, 80e-6]),
    }[command]
    np.savetxt("record.csv", np.column_stack(record), delimiter=",", header=columns, comments="")
    code, out, err = call("analyze", command, "record.csv", *more, "--language", "zh")
    assert (code, err) == (0, "")
    assert "参数" in out
    # Names of channels and options stay; a sentence that is left has words one after the other.
    assert not re.findall(r"(?:\b[a-z]{2,}\b[ ,]+){3,}", out), out
    _, out, _ = call("analyze", command, "record.csv", *more, "--language", "zh", "--json")
    assert bool(re.search("[一-鿿]", out)) == (command != "table")
    assert call("analyze", command, "record.csv", *more, "--language", "de")[0] == 2


TIMES = np.arange(0.0, 0.1, 1e-5)
NOISE = 0.01 * np.random.default_rng(1).normal(size=TIMES.size)


def table(path: Path, heading: str, *columns: np.ndarray) -> str:
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=heading, comments="")
    return str(path)


@pytest.mark.parametrize(
    ("command", "heading", "said"),
    [
        ("coast-down", "time (s),speed (Hz)", "is in Hz, which may be turns or electrical periods a second"),
        ("step-response", "time (s),V (V),I (dA)", "column I is in dA, but the current must be in A"),
        ("coast-down", "time (s),erpm", "is an electrical speed, according to its name"),
        ("coast-down", "time (s),electrical speed (rad/s)", "is an electrical speed, according to its name"),
        ("coast-down", "time (hours),speed (rpm)", "'hours', which is not a known unit of time"),
        ("back-emf", "time (h),CH1 (V)", "'h', which is not a known unit of time"),
        ("back-emf", "time (s),CH1 (dBV)", "channel CH1 is in dBV; a back-EMF needs voltages only"),
    ],
)
def test_a_unit_that_is_not_known_is_not_taken_for_another(
    call: Call, tmp_path: Path, command: str, heading: str, said: str
) -> None:
    columns = [np.exp(-TIMES)] * heading.count(",")
    code, _, err = call("analyze", command, table(tmp_path / "x.csv", heading, TIMES, *columns))
    assert code == 2
    assert said in err


@pytest.mark.parametrize(
    ("command", "heading", "said"),
    [
        ("coast-down", "time (s),speed", "--speed-in-rad-s"),
        ("coast-down", "time (s),speed (rpm),torque", "as in 'torque (Nm)'"),
        ("rotor-sweep", "angle,L (uH)", "as in 'angle (deg)'"),
        ("rotor-sweep", "angle (deg),L", "as in 'L (uH)'"),
    ],
)
def test_a_unit_that_is_left_open_is_asked_for(
    call: Call, tmp_path: Path, command: str, heading: str, said: str
) -> None:
    columns = [np.exp(-TIMES)] * heading.count(",")
    code, _, err = call("analyze", command, table(tmp_path / "x.csv", heading, TIMES, *columns))
    assert (code, said in err) == (2, True), err


@pytest.mark.parametrize(("option", "factor"), [("--speed-in-rpm", 30.0 / np.pi), ("--speed-in-rad-s", 1.0)])
def test_a_speed_of_no_unit_is_what_was_typed(call: Call, tmp_path: Path, option: str, factor: float) -> None:
    time = np.linspace(0.0, 5.0, 1001)
    speed = 300.0 - 50.0 * time + np.random.default_rng(4).normal(0.0, 0.05, time.size)
    file = table(tmp_path / "coast.csv", "time (s),speed", time, factor * speed)
    code, out, _ = call("analyze", "coast-down", file, option, "--json")
    assert code == 0
    assert json.loads(out)["parameters"]["coulomb_deceleration"]["value"] == pytest.approx(50.0, rel=0.02)


@pytest.mark.parametrize(
    ("command", "heading", "sizes", "absent"),
    [
        ("step-response", "time (s),CH1 (V),CH2 (A)", (1.0, 1e-6), {"loop_resistance"}),
        ("step-response", "time (s),CH1 (V),CH2 (A)", (1e6, 1.0), {"loop_resistance", "loop_inductance", "inductance"}),
        ("back-emf", "time (s),CH1 (V)", (1e9,), {"flux_linkage"}),
        ("rotor-sweep", "angle (rad),L (H)", (1e9,), {"d_axis_inductance", "q_axis_inductance"}),
    ],
)
def test_a_size_that_no_motor_has_is_not_given(
    call: Call, tmp_path: Path, command: str, heading: str, sizes: tuple[float, ...], absent: set[str]
) -> None:
    random = np.random.default_rng(2)
    time = TIMES - 0.02 if command == "step-response" else TIMES
    shapes = {
        "step-response": (np.where(time > 0.0, 1.0, 0.0), -np.expm1(-np.maximum(time, 0.0) / 5e-3)),
        "back-emf": (np.cos(2.0 * np.pi * 100.0 * time),),
        "rotor-sweep": (1e-4 * (1.0 - 0.2 * np.cos(800.0 * time)),),
    }[command]
    columns = [s * (x + random.normal(0.0, 1e-3 * np.ptp(x), x.size)) for s, x in zip(sizes, shapes, strict=True)]
    file = table(tmp_path / "x.csv", heading, time, *columns)
    code, out, _ = call("analyze", command, file, "--json")
    found = json.loads(out)
    assert code == 1
    assert absent <= set(found["withheld"])
    assert not absent & set(found["parameters"])


def test_a_value_that_marks_a_missing_reading_is_refused_with_its_row(call: Call, tmp_path: Path) -> None:
    wave = np.cos(2.0 * np.pi * 100.0 * TIMES)
    wave[41] = 1e300
    code, _, err = call("analyze", "back-emf", table(tmp_path / "x.csv", "time (s),CH1 (V)", TIMES, wave))
    assert code == 2
    assert "x.csv, line 43" in err
    assert "contains 1e+300, which is not a possible reading" in err
    file = table(tmp_path / "t.csv", "speed_rpm,current_A", np.array([1.0, 1e300]), np.array([1.0, 1.0]))
    code, _, err = call("analyze", "short-circuit", file, "--pole-pairs", "4")
    assert (code, "line 3, column speed_rpm: 1e+300" in err) == (2, True)


def test_names_count_before_places(call: Call, tmp_path: Path) -> None:
    random = np.random.default_rng(6)
    time = np.arange(-400, 2000) * 3e-6
    v = np.where(time >= 0.0, 1.0, 0.0) + random.normal(0.0, 0.004, time.size)
    i = 10.0 * -np.expm1(-np.maximum(time, 0.0) / 1e-3) + random.normal(0.0, 0.02, time.size)
    for heading, columns in (("time (s),current,voltage", (i, v)), ("time (s),u,i", (v, i))):
        code, out, _ = call("analyze", "step-response", table(tmp_path / "x.csv", heading, time, *columns), "--json")
        assert code == 0
        assert json.loads(out)["parameters"]["loop_resistance"]["value"] == pytest.approx(0.1, rel=0.01)


def test_a_record_with_every_other_sample_missing_gives_no_figure(call: Call, tmp_path: Path) -> None:
    time = np.arange(4000) * 2.5e-5
    wave = 5.0 * np.cos(2.0 * np.pi * 100.0 * time + 0.3) + np.random.default_rng(7).normal(0.0, 0.02, time.size)
    file = table(tmp_path / "x.csv", "time (s),CH1 (V)", time, wave * (np.arange(time.size) % 2))
    code, out, _ = call("analyze", "back-emf", file, "--coupling", "dc", "--json")
    assert (code, json.loads(out)["withheld"]["flux_linkage"]["cause"]) == (1, "unexplained")


def test_half_a_pole_pair_is_none(call: Call, emf: Path) -> None:
    code, _, err = call("analyze", "back-emf", str(emf), "--pole-pairs", "3.5")
    assert (code, "--pole-pairs 3.5: allowed is a whole number from 1 to 200" in err) == (2, True)


@pytest.mark.slow
def test_the_frequency_of_a_clipped_record_holds_the_truth(call: Call, tmp_path: Path) -> None:
    wave = np.clip(5.0 * np.sin(2.0 * np.pi * 75.0 * TIMES) + NOISE, -0.5, 0.5)
    file = table(tmp_path / "cut.csv", "time (s),CH1 (V)", TIMES, wave)
    _, out, _ = call("analyze", "back-emf", file, "--coupling", "dc", "--json")
    low, high = json.loads(out)["parameters"]["electrical_frequency"]["coverage_interval"]
    assert low <= 75.0 <= high


def test_what_nothing_can_be_made_of_is_said_in_a_sentence(call: Call, tmp_path: Path) -> None:
    square = np.where(np.sin(2.0 * np.pi * 75.0 * TIMES) >= 0.0, 5.0, -5.0)
    file = table(tmp_path / "square.csv", "time (s),CH1 (V)", TIMES, square)
    code, _, err = call("analyze", "back-emf", file)
    assert (code, "too few readings are left" in err) == (2, True)
    angles = np.linspace(0.0, 2.0 * np.pi, 400)
    wave = -40.0 + 5.0 * np.cos(8.0 * angles) + NOISE[:400]
    file = table(tmp_path / "negative.csv", "angle (rad),L (uH)", angles, wave)
    code, _, err = call("analyze", "rotor-sweep", file, "--pole-pairs", "4")
    assert (code, "no reading of L is above zero" in err) == (2, True)
