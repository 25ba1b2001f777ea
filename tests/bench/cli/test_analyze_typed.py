"""Factors with a unit, and captures whose columns have to be named, as they are typed."""

import json
from pathlib import Path

import numpy as np
import pytest

from bench.captures import ProbeFactor
from bench.cli.analyze.typed import factors_of, seconds_of
from bench.i18n.errors import UsageError
from tests.command_line import Call
from tests.studies.worlds import simulated as sim


@pytest.mark.parametrize(
    ("typed", "factor"),
    [
        ("10A/V", 10.0),
        ("100mV/A", 10.0),
        ("5mOhm", 200.0),
        ("5mΩ", 200.0),
        ("-0.01A/mV", -10.0),
        ("1e-1 V/A", 10.0),
    ],
)
def test_a_probe_or_a_shunt_as_typed(typed: str, factor: float) -> None:
    known = factors_of([f"CH2={typed}"])["CH2"]
    assert known == ProbeFactor(pytest.approx(factor), "A")


@pytest.mark.parametrize("typed", ["CH2=10A", "CH2=A/V", "CH2=0mOhm", "=10A/V", "CH2=1.2.3A/V", "CH2"])
def test_what_is_no_factor_is_refused_with_the_ways_to_write_one(typed: str) -> None:
    with pytest.raises(UsageError, match="CHAN2=100mV/A"):
        factors_of([typed])


def test_two_voltages_become_a_step_by_the_probe_s_factor(call: Call, tmp_path: Path) -> None:
    time, v, i, *_ = sim.step_record(np.random.default_rng(1), 8)
    file = tmp_path / "step.csv"
    np.savetxt(file, np.column_stack((time, v, 0.1 * i)), delimiter=",", header="t (s),CH1 (V),CH2 (V)", comments="")
    status, _, err = call("analyze", "step-response", str(file))
    assert status == 2
    assert "--scale CH2=10A/V" in err
    status, out, _ = call("analyze", "step-response", str(file), "--scale", "CH2=100mV/A", "--json")
    assert status == 0
    parameters = json.loads(out)["parameters"]
    for name, true in (("loop_resistance", sim.R), ("loop_inductance", sim.L)):
        low, high = parameters[name]["coverage_interval"]
        assert low < true < high


def test_three_lines_of_inductance_are_named_one_by_one(call: Call, tmp_path: Path) -> None:
    angle = np.arange(72) * 5.0
    lines = [100.0 - 10.0 * np.cos(8.0 * np.radians(angle) + k * 2.1) for k in range(3)]
    file = tmp_path / "sweep.csv"
    header = "angle (deg),Lab (uH),Lbc (uH),Lca (uH)"
    np.savetxt(file, np.column_stack((angle, *lines)), delimiter=",", header=header, comments="", fmt="%.4f")
    status, _, err = call("analyze", "rotor-sweep", str(file), "--pole-pairs", "4")
    assert status == 2
    assert "name it with --inductance" in err
    status, out, _ = call("analyze", "rotor-sweep", str(file), "--pole-pairs", "4", "--inductance", "Lbc", "--json")
    assert status == 0
    assert json.loads(out)["parameters"]["d_axis_inductance"]["value"] == pytest.approx(45e-6, rel=1e-3)


@pytest.mark.parametrize("unit", ["Hz", "1/s"])
def test_periods_a_second_are_no_speed_by_themselves(call: Call, tmp_path: Path, unit: str) -> None:
    file = tmp_path / "coast.csv"
    table = np.column_stack((np.arange(50) * 0.1, 100.0 - np.arange(50)))
    np.savetxt(file, table, delimiter=",", header=f"t (s),n ({unit})", comments="")
    status, _, err = call("analyze", "coast-down", str(file))
    assert status == 2
    assert "write rps" in err


@pytest.mark.parametrize("kind", ["flux-map", "short-circuit"])
def test_half_a_pole_pair_is_none(call: Call, tmp_path: Path, kind: str) -> None:
    status, _, err = call("analyze", kind, str(tmp_path / "map.csv"), "--pole-pairs", "3.5")
    assert status == 2
    assert "a whole number from 1 to 200" in err


@pytest.mark.parametrize("word", ["nan ms", "inf s", "-1ms", "1e400s", "20", "ms"])
def test_a_filter_is_no_time_that_no_filter_has(word: str) -> None:
    with pytest.raises(UsageError, match="give a time, as in 20ms"):
        seconds_of("--speed-filter", word)


def test_micro_is_micro_in_both_of_its_signs() -> None:
    assert (
        seconds_of("--speed-filter", "20\u00b5s") == seconds_of("--speed-filter", "20\u03bcs") == pytest.approx(20e-6)
    )


def test_a_threshold_between_classes_is_a_share(call: Call) -> None:
    for word in ("nan", "0", "-0.1", "10"):
        status, _, err = call("analyze", "rotor-sweep", "none.csv", f"--threshold={word}")
        assert (status, "--threshold" in err and "as in 0.1 for 10 %" in err) == (2, True), err


@pytest.mark.parametrize(
    ("option", "values", "said"),
    [
        ("voltage", ("nan", "0", "-1", "1e9"), "above 0 and up to 10000"),
        ("load", ("nan", "-1", "inf"), "from 0 to 1e+06"),
        ("coulomb-friction", ("nan", "-1"), "from 0 to 1e+06"),
        ("viscous-friction", ("nan", "-1"), "from 0 to 1e+06"),
        ("diode-drop", ("nan", "-1", "100"), "from 0 to 5"),
    ],
)
def test_a_six_step_drives_figures_are_refused_by_their_option(
    call: Call, option: str, values: tuple[str, ...], said: str
) -> None:
    load = () if option == "load" else ("--load", "0.1")
    for value in values:
        status, _, err = call("analyze", "six-step", "none", *load, f"--{option}={value}")
        assert (status, f"--{option} {float(value):g}: allowed is a number {said}" in err) == (2, True), err
