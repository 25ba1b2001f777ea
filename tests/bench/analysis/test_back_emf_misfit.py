import json
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

from bench.analysis import analyze_back_emf, read_statements
from bench.analysis.back_emf_record import read_couplings
from bench.captures import CaptureError, CapturePart
from bench.i18n.errors import UsageError
from tests.command_line import Call
from tests.studies.worlds.emf_records import Setup, record

SETUP = Setup(frequency=60.0)


def stored(folder: Path, setup: Setup, name: str, seed: int = 1) -> Path:
    time, v = record(np.random.default_rng(seed), setup)
    path = folder / f"{name}.csv"
    heading = ",".join(["t (s)", *(f"CH{k + 1} (V)" for k in range(len(v)))])
    np.savetxt(path, np.column_stack((time, *v)), delimiter=",", header=heading, comments="", fmt="%.9g")
    return path


def flux(found: dict[str, Any]) -> dict[str, Any]:
    return found["parameters"]["flux_linkage"]


def test_coupling_that_nobody_states_widens_the_upper_end_only(tmp_path: Path) -> None:
    path = stored(tmp_path, SETUP, "emf")
    open_ = flux(analyze_back_emf(path, connection="phase"))
    known = flux(analyze_back_emf(path, connection="phase", coupling={"": "dc"}))
    assert open_["value"] == pytest.approx(known["value"])
    assert open_["coverage_interval"][0] == pytest.approx(known["coverage_interval"][0])
    above = open_["coverage_interval"][1] - known["coverage_interval"][1]
    assert above / known["value"] == pytest.approx(np.hypot(1, 10 / 60) - 1, rel=1e-3)
    assert any("--coupling dc" in note for note in analyze_back_emf(path)["assumptions"])


def test_the_interval_holds_what_an_ac_coupled_channel_does_not_show(tmp_path: Path) -> None:
    for seed, corner in enumerate((2.0, 5.0, 9.5)):
        path = stored(tmp_path, replace(SETUP, corner=corner), "emf", seed)
        found = analyze_back_emf(path, connection="phase", coupling={"": "ac"})
        low, high = flux(found)["coverage_interval"]
        assert low < SETUP.flux < high
        assert [row["cause"] for row in found["misfit"]] == ["ac-coupled"]


def test_below_thirty_hertz_an_unstated_coupling_gives_no_figure(tmp_path: Path) -> None:
    path = stored(tmp_path, replace(SETUP, frequency=25.0), "emf")
    found = analyze_back_emf(path, connection="phase", pole_pairs=4)
    assert set(found["withheld"]) == {"flux_linkage", "back_emf_constant_mechanical", "torque_constant"}
    assert found["withheld"]["flux_linkage"]["cause"] == "ac-coupled"
    assert not any("the interval includes" in note for note in found["assumptions"])
    assert "flux_linkage" in analyze_back_emf(path, connection="phase", coupling={"": "dc"})["parameters"]


def test_one_channel_may_be_said_to_be_otherwise_coupled(tmp_path: Path) -> None:
    path = stored(tmp_path, SETUP, "emf")
    found = analyze_back_emf(path, connection="phase", coupling=read_couplings(["dc", "chan2=AC"]))
    (row,) = found["misfit"]
    assert row["figures"]["channels"] == "CH2"
    with pytest.raises(CaptureError, match="no channel 'CH9'"):
        analyze_back_emf(path, coupling={"CH9": "dc"})
    with pytest.raises(UsageError, match="--coupling CH1=yes: allowed is dc or ac"):
        read_couplings(["CH1=yes"])
    for words, said in (
        (["dc", "ac"], "all channels stated as dc before"),
        (["CH1=ac", "chan1=dc"], "chan1 stated as ac"),
    ):
        with pytest.raises(UsageError, match=said):
            read_couplings(words)
    assert read_couplings(["dc", "dc"]) == {"": "dc"}


def test_three_speeds_that_disagree_give_a_table_and_no_figure(tmp_path: Path) -> None:
    files = [
        stored(tmp_path, replace(SETUP, frequency=f, flux=0.01 * (1 - 0.02 * f / 100), periods=20), f"at{f}", f)
        for f in (60, 120, 240)
    ]
    found = analyze_back_emf(files, connection="phase", speeds=3, coupling={"": "dc"}, pole_pairs=4)
    assert found["withheld"]["flux_linkage"]["cause"] == "speed-trend"
    rows = found["details"]["speeds"]
    assert [row["speed_rpm"] for row in rows] == pytest.approx([900, 1800, 3600], rel=1e-3)
    assert [row["flux_linkage"] for row in rows] == pytest.approx([9.88e-3, 9.76e-3, 9.52e-3], rel=1e-3)
    assert json.loads(json.dumps(found)) == found


def test_speeds_that_agree_give_one_figure_as_do_files_of_one_channel_each(tmp_path: Path) -> None:
    files = []
    for f in (60, 120):
        time, v = record(np.random.default_rng(f), replace(SETUP, frequency=f))
        for k in range(3):
            files.append(tmp_path / f"{f}_CHAN{k + 1}.csv")
            np.savetxt(
                files[-1], np.column_stack((time, v[k])), delimiter=",", header=f"t (s),CH{k + 1} (V)", comments=""
            )
    found = analyze_back_emf(files, connection="phase", speeds=2, coupling={"": "dc"})
    low, high = flux(found)["coverage_interval"]
    assert low < SETUP.flux < high
    assert found["misfit"] == []
    with pytest.raises(UsageError, match="--speeds 4: 6 files cannot be divided equally among so many speeds"):
        analyze_back_emf(files, speeds=4)


def test_differences_within_the_stated_gain_are_not_told_twice(tmp_path: Path) -> None:
    path = stored(tmp_path, replace(SETUP, gains=(1.0, 1.02, 0.99)), "emf")
    words = {"connection": "phase", "coupling": {"": "dc"}}
    assert [w["id"] for w in analyze_back_emf(path, **words)["warnings"]] == ["channels-differ"]
    assert analyze_back_emf(path, **words, accuracy=read_statements(["voltage=2%"]))["warnings"] == []


def test_the_command_line_takes_speeds_coupling_and_a_part(call: Call, tmp_path: Path) -> None:
    files = [str(stored(tmp_path, replace(SETUP, frequency=f), f"at{f}", f)) for f in (60, 120)]
    words = ("--connection", "neutral", "--speeds", "2", "--coupling", "dc", "--from", "0.01", "--to", "0.06", "--json")
    code, out, err = call("analyze", "back-emf", *files, *words)
    assert (code, err) == (0, "")
    found = json.loads(out)
    assert len(found["details"]["speeds"]) == 2
    assert any("cut: " in note for note in found["assumptions"])
    code, _, err = call("analyze", "back-emf", files[0], "--from", "5")
    assert code == 2
    assert "select only 0 samples" in err


def test_a_constant_channel_is_called_as_the_file_calls_it(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "emf.csv"
    time = np.arange(500) * 1e-4
    np.savetxt(
        path,
        np.column_stack((time, np.sin(400 * time), 0 * time)),
        delimiter=",",
        header="t (s),ua (V),ub (V)",
        comments="",
    )
    code, _, err = call("analyze", "back-emf", str(path))
    assert code == 2
    assert "channel ub is constant" in err


def test_a_part_is_taken_of_every_record(tmp_path: Path) -> None:
    path = stored(tmp_path, SETUP, "emf")
    whole, part = (analyze_back_emf(path, connection="phase", selection=CapturePart(end=end)) for end in (None, 0.07))
    assert flux(part)["standard_uncertainty"] != flux(whole)["standard_uncertainty"]


TIMES = np.arange(5000) * 2e-5


def three(
    folder: Path, names: str, *, third: float = 0.05, line: bool = False, gains: tuple[float, ...] = (1.0, 1.0, 1.0)
) -> Path:
    """Write voltages of phases of 5 V at 100 Hz, or between lines, read by three channels."""
    angle = 2.0 * np.pi * 100.0 * TIMES - 2.0 * np.pi / 3.0 * np.arange(3)[:, None]
    phases = 5.0 * np.cos(angle) + 5.0 * third * np.cos(3.0 * angle) + 0.1 * np.cos(5.0 * angle)
    v = phases - np.roll(phases, -1, axis=0) if line else phases
    v = np.array(gains)[:, None] * v + np.random.default_rng(3).normal(0.0, 0.02, v.shape)
    path = folder / "three.csv"
    heading = ",".join(["t (s)", *(f"{name} (V)" for name in names.split())])
    np.savetxt(path, np.column_stack((TIMES, *v)), delimiter=",", header=heading, comments="", fmt="%.9g")
    return path


def test_a_lone_channel_with_a_third_harmonic_is_not_taken_for_a_line(tmp_path: Path) -> None:
    path = three(tmp_path, "CH1 CH2 CH3")
    columns = np.loadtxt(path, delimiter=",", skiprows=1)
    for count in (1, 2):
        np.savetxt(
            lone := tmp_path / f"{count}.csv",
            columns[:, : 1 + count],
            delimiter=",",
            header="t,CH1,CH2"[: 5 + 4 * (count - 1)],
            comments="",
        )
        open_ = analyze_back_emf(lone, coupling={"": "dc"}, pole_pairs=4)
        assert open_["withheld"]["flux_linkage"]["cause"] == "probe-connection"
        said = analyze_back_emf(lone, coupling={"": "dc"}, connection="neutral")
        assert flux(said)["value"] == pytest.approx(5.0 / (2.0 * np.pi * 100.0), rel=2e-3)
    lines = three(tmp_path, "CH1 CH2 CH3", line=True, third=0.2, gains=(1.0, 1.0, 1.0))
    np.savetxt(lone, np.loadtxt(lines, delimiter=",", skiprows=1)[:, :2], delimiter=",", header="t,CH1", comments="")
    assert not analyze_back_emf(lone, coupling={"": "dc"}, pole_pairs=4)["withheld"]


def test_a_third_harmonic_in_phase_says_that_no_lines_were_probed(tmp_path: Path) -> None:
    truth = 5.0 / (2.0 * np.pi * 100.0)
    for names in ("CH1 CH2 CH3", "Uab Ubc Uca"):
        open_ = analyze_back_emf(three(tmp_path, names), coupling={"": "dc"}, pole_pairs=4)
        assert open_["withheld"]["flux_linkage"]["cause"] == "probe-connection"
        assert set(open_["parameters"]) == {"electrical_frequency"}
    path = three(tmp_path, "CH1 CH2 CH3")
    said = analyze_back_emf(path, coupling={"": "dc"}, connection="neutral")
    assert flux(said)["value"] == pytest.approx(truth, rel=1e-3)
    insisted = analyze_back_emf(path, coupling={"": "dc"}, connection="line")
    assert "probe-connection" in {warning["id"] for warning in insisted["warnings"]}
    assert flux(insisted)["value"] == pytest.approx(truth / np.sqrt(3.0), rel=1e-3)


@pytest.mark.parametrize("common", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_hum_that_is_the_same_in_three_channels_says_that_no_lines_were_probed(tmp_path: Path, common: bool) -> None:
    path = three(tmp_path, "CH1 CH2 CH3", third=0.0)
    columns = np.loadtxt(path, delimiter=",", skiprows=1)
    angle = 2.0 * np.pi * 50.0 * columns[:, 0]
    for k in (1, 2, 3):
        columns[:, k] += 0.8 * np.sin(angle + (0.3 if common else 2.0 * np.pi * k / 3.0))
    np.savetxt(path, columns, delimiter=",", header="t (s),CH1 (V),CH2 (V),CH3 (V)", comments="")
    found = analyze_back_emf(path, coupling={"": "dc"})
    assert ("probe-connection" in {each["cause"] for each in found["withheld"].values()}) is common
    assert "flux_linkage" in analyze_back_emf(path, coupling={"": "dc"}, connection="phase")["parameters"]


@pytest.mark.parametrize(
    ("names", "third", "typed", "asked"),
    [
        ("CH1 CH2 CH3", 0.0, None, "grounds are joined"),
        ("CH1 CH2 CH3", 0.004, None, "third harmonic"),
        ("CH1 CH2 CH3", 0.0, "line", ""),
        ("CH1 CH2 CH3", 0.004, "line", ""),
        ("Uab Ubc Uca", 0.004, None, ""),
    ],
)
def test_three_probes_of_which_nobody_says_where_they_were_give_no_flux_linkage(
    tmp_path: Path, names: str, third: float, typed: Literal["line"] | None, asked: str
) -> None:
    """Isolated probes between the lines and joined ones against a star point show the same, √3 apart."""
    path = three(tmp_path, names, third=third)
    found = analyze_back_emf(path, coupling={"": "dc"}, connection=typed, pole_pairs=4)
    assert set(found["withheld"]) == (
        {"flux_linkage", "back_emf_constant_mechanical", "torque_constant"} if asked else set()
    )
    assert "electrical_frequency" in found["parameters"]
    for each in found["withheld"].values():
        assert each["cause"] == "connection-open"
        assert asked in each["message"]
        assert "--connection" in each["message"]


def test_three_probes_with_the_same_faint_hum_are_asked_about(tmp_path: Path) -> None:
    path = three(tmp_path, "CH1 CH2 CH3", third=0.0)
    columns = np.loadtxt(path, delimiter=",", skiprows=1)
    columns[:, 1:] += 0.15 * np.sin(2.0 * np.pi * 50.0 * columns[:, [0]])
    np.savetxt(path, columns, delimiter=",", header="t (s),CH1 (V),CH2 (V),CH3 (V)", comments="")
    found = analyze_back_emf(path, coupling={"": "dc"})["withheld"]["flux_linkage"]
    assert (found["cause"], "hum of 50 Hz" in found["message"]) == ("connection-open", True)


def ends(folder: Path, own: float, hum: float = 0.3, middle: float = 0.0) -> Path:
    """Two probes on two terminals of a motor that floats: an end has `own` of the line's 6 V, the other the rest; both have the hum."""
    random = np.random.default_rng(3)
    line = 6.0 * np.cos(2.0 * np.pi * 100.0 * TIMES)
    common = hum * np.sin(2.0 * np.pi * 50.0 * TIMES) + middle * np.sin(2.0 * np.pi * 100.0 * TIMES)
    first, second = own * line + common, (own - 1.0) * line + common
    columns = [each + random.normal(0.0, 0.01, line.size) for each in (first, second)]
    path = folder / "ends.csv"
    np.savetxt(path, np.column_stack((TIMES, *columns)), delimiter=",", header="t (s),CH1 (V),CH2 (V)", comments="")
    return path


@pytest.mark.parametrize("own", [0.5, 0.56, 0.44])
@pytest.mark.parametrize("middle", [0.0, pytest.param(0.1, marks=pytest.mark.slow)])
def test_two_ends_of_one_line_give_its_voltage_by_their_difference(tmp_path: Path, own: float, middle: float) -> None:
    path = ends(tmp_path, own, middle=middle)
    alone = analyze_back_emf(path, coupling={"": "dc"}, pole_pairs=7)
    assert {each["cause"] for each in alone["withheld"].values()} == {"opposite-channels"}
    assert "--connection ends" in alone["withheld"]["flux_linkage"]["message"]
    found = analyze_back_emf(path, coupling={"": "dc"}, pole_pairs=7, connection="ends")
    low, high = flux(found)["coverage_interval"]
    assert low < 6.0 / (np.sqrt(3.0) * 2.0 * np.pi * 100.0) < high
    assert high - low < 0.01 * high
    assert not found["withheld"]


def test_isolated_probes_on_one_line_are_believed_where_they_agree(tmp_path: Path) -> None:
    equal = analyze_back_emf(ends(tmp_path, 0.5, hum=0.0), coupling={"": "dc"}, connection="line")
    assert not equal["withheld"]
    unequal = analyze_back_emf(ends(tmp_path, 0.56, hum=0.0), coupling={"": "dc"}, connection="line")
    assert unequal["withheld"]["flux_linkage"]["cause"] == "opposite-channels"


def test_ends_are_two_channels(tmp_path: Path) -> None:
    with pytest.raises(CaptureError, match="there are 3"):
        analyze_back_emf(three(tmp_path, "CH1 CH2 CH3", third=0.0), connection="ends")


def test_pole_pairs_that_the_speed_contradicts_give_no_mechanical_constants(tmp_path: Path) -> None:
    path = three(tmp_path, "CH1 CH2 CH3", third=0.0, line=True)
    found = analyze_back_emf(path, connection="line", coupling={"": "dc"}, pole_pairs=8, speed_rpm=1500.0)
    assert set(found["withheld"]) == {"back_emf_constant_mechanical", "torque_constant"}
    assert {each["cause"] for each in found["withheld"].values()} == {"pole-pairs-contradict"}
    assert "flux_linkage" in found["parameters"]
    # A tachometer that only reads badly takes nothing away.
    assert not analyze_back_emf(path, connection="line", coupling={"": "dc"}, pole_pairs=4, speed_rpm=1620.0)[
        "withheld"
    ]


@pytest.mark.parametrize(
    ("gains", "words"),
    [
        (
            (1.0, 1.0, 3**-0.5),
            "CH3 shows 0.577 times the value of the other channels, which is 1/√3: its probe is on a phase",
        ),
        (
            (1.0, 3**0.5, 1.0),
            "CH2 shows 1.73 times the value of the other channels, which is √3: its probe is between two lines",
        ),
        ((1.0, 1.0, 1e-5), "CH3 shows no back-EMF"),
    ],
)
def test_a_channel_between_other_points_is_told_from_a_wrong_factor(
    tmp_path: Path, gains: tuple[float, ...], words: str
) -> None:
    found = analyze_back_emf(three(tmp_path, "CH1 CH2 CH3", third=0.0, line=True, gains=gains), coupling={"": "dc"})
    assert words in found["withheld"]["flux_linkage"]["message"]


@pytest.mark.parametrize("third", [0.0, 0.05])
@pytest.mark.parametrize("gains", [(1.0, 1.0, 1.0), (1.0, 1.03, 0.98)])
def test_lines_are_not_taken_for_phases(tmp_path: Path, third: float, gains: tuple[float, ...]) -> None:
    found = analyze_back_emf(three(tmp_path, "Uab Ubc Uca", third=third, line=True, gains=gains), coupling={"": "dc"})
    low, high = flux(found)["coverage_interval"]
    assert low * 0.999 < 5.0 / (2.0 * np.pi * 100.0) < high * 1.001
    assert not found["withheld"]


@pytest.mark.parametrize(
    "names", ["Ua Ub Uc", "U_A U_B U_C", "Phase_U Phase_V Phase_W", "L1 L2 L3", "UU UV UW", "ea eb ec"]
)
def test_channels_named_as_phases_are_asked_about(tmp_path: Path, names: str) -> None:
    with pytest.raises(UsageError, match="differs by √3"):
        analyze_back_emf(three(tmp_path, names, third=0.0))


@pytest.mark.parametrize(
    ("names", "line"),
    [
        ("Van Vbn Vcn", False),
        ("UV VW WU", True),
        ("L1-L2 L2-L3 L3-L1", True),
        ("U_ab U_bc U_ca", True),
    ],
)
def test_names_that_say_it_are_taken_at_their_word(tmp_path: Path, names: str, line: bool) -> None:
    found = analyze_back_emf(three(tmp_path, names, third=0.0, line=line), coupling={"": "dc"})
    assert flux(found)["value"] == pytest.approx(5.0 / (2.0 * np.pi * 100.0), rel=1e-3)


def test_channels_on_one_line_count_once(tmp_path: Path) -> None:
    random = np.random.default_rng(8)
    wave = 5.0 * np.cos(2.0 * np.pi * 100.0 * TIMES)
    first = wave + random.normal(0.0, 0.02, wave.size)

    def analyzed(name: str, *channels: np.ndarray) -> dict[str, Any]:
        path = tmp_path / f"{name}.csv"
        heading = ",".join(["t (s)", *(f"CH{k + 1} (V)" for k in range(len(channels)))])
        np.savetxt(path, np.column_stack((TIMES, *channels)), delimiter=",", header=heading, comments="", fmt="%.9g")
        return analyze_back_emf(path, coupling={"": "dc"})

    alone = analyzed("alone", first)
    assert "one-line" not in {warning["id"] for warning in alone["warnings"]}
    for others in ((first,), (first, first), (0.995 * first, first)):
        found = analyzed("copies", first, *others)
        assert "one-line" in {warning["id"] for warning in found["warnings"]}
        assert flux(found)["standard_uncertainty"] >= 0.99 * flux(alone)["standard_uncertainty"]
    # Three lines are three.
    ids = {warning["id"] for warning in analyze_back_emf(three(tmp_path, "CH1 CH2 CH3", line=True))["warnings"]}
    assert "one-line" not in ids


def test_a_record_given_twice_is_refused(tmp_path: Path) -> None:
    first = stored(tmp_path, SETUP, "first")
    second = tmp_path / "second.csv"
    second.write_bytes(first.read_bytes())
    with pytest.raises(CaptureError, match="holds the same readings as"):
        analyze_back_emf([first, second], speeds=2)
