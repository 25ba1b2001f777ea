"""Captures taken with instruments whose errors were drawn within the limits stated: the intervals hold the truth."""

import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench.analysis import (
    Temperature,
    analyze_back_emf,
    analyze_coast_down,
    analyze_rotor_sweep,
    analyze_step_response,
    read_statements,
)
from bench.i18n.errors import InputError
from tests.studies.worlds import simulated as sim

#: Of 40 intervals of 95 %, fewer than 34 hold the truth once in 300 studies.
TRIALS, ENOUGH = 40, 34


def table(folder: Path, heading: str, *columns: np.ndarray, name: str = "record.csv") -> Path:
    path = folder / name
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=heading, comments="", fmt="%.9g")
    return path


def holds(parameter: dict[str, Any], truth: float) -> bool:
    low, high = parameter["coverage_interval"]
    return bool(low <= truth <= high)


def sums_up(found: dict[str, Any]) -> None:
    for name, parameter in found["parameters"].items():
        rows = parameter["budget"]
        combined = math.hypot(*(row["contribution"] for row in rows)) if rows else 0.0
        assert combined == pytest.approx(parameter["standard_uncertainty"], rel=1e-9), name
        for row in rows:
            product = abs(row["sensitivity"]) * row["standard_uncertainty"]
            assert product == pytest.approx(row["contribution"], rel=1e-9)


def sources(parameter: dict[str, Any], kind: str = "B") -> set[str]:
    return {row["source"] for row in parameter["budget"] if row["kind"] == kind}


def assert_held(counts: dict[str, int], names: Iterable[str]) -> None:
    assert set(counts) == set(names)
    assert min(counts.values()) >= ENOUGH, counts


@pytest.mark.slow
def test_step_response_holds_the_truth_of_a_scope_and_a_winding_off_by_what_is_stated(tmp_path: Path) -> None:
    random = np.random.default_rng(11)
    truth = {"loop_resistance": sim.R, "loop_inductance": sim.L, "d_axis_inductance": 2 / 3 * sim.L}
    counts = dict.fromkeys(truth, 0)
    accuracy = read_statements(["voltage=2%+20mV", "CH2=3%+100mA", "time=0.5%"])
    for _ in range(TRIALS):
        time, v, i, _, _ = sim.step_record(random, 8)
        drawn = random.uniform(-1, 1, 6)
        warm = 60 + 3 * drawn[5]
        # The record shows the resistance of a winding at the temperature `warm`.
        path = table(
            tmp_path,
            "t (s),CH1 (V),CH2 (A)",
            time * (1 + 0.005 * drawn[0]),
            v * (1 + 0.02 * drawn[1]) + 0.02 * drawn[2],
            i * (1 + 0.03 * drawn[3]) + 0.1 * drawn[4],
        )
        found = analyze_step_response(path, axis="d", accuracy=accuracy, temperature=Temperature(60.0, 3.0, 0.00393))
        sums_up(found)
        cold = sim.R * (1 + 0.00393 * 5) / (1 + 0.00393 * (warm - 20))
        for name, true in {**truth, "loop_resistance": cold}.items():
            counts[name] += holds(found["parameters"][name], true)
    assert_held(counts, truth)
    resistance = found["parameters"]["loop_resistance"]
    assert sources(resistance) == {
        "voltage channels: gain, as stated",
        "current channels: gain, as stated",
        "winding temperature",
    }
    assert resistance["convention"] == "loop, at 25 °C"
    assert sources(resistance, "A") == {"step fit of the resistance"}
    assert found["parameters"]["d_axis_inductance"]["degrees_of_freedom"] is not None
    assert any("the fit includes the offset of the current channel" in note for note in found["assumptions"])


def test_a_step_without_a_baseline_is_withheld_and_says_what_to_do(tmp_path: Path) -> None:
    time, v, i, _, _ = sim.step_record(np.random.default_rng(3), 12, before=0.0)
    found = analyze_step_response(table(tmp_path, "t (s),u (V),i (A)", time, v, i), axis="q")
    assert found["parameters"] == {}
    assert set(found["withheld"]) == {"loop_resistance", "loop_inductance", "q_axis_inductance"}
    assert {entry["cause"] for entry in found["withheld"].values()} == {"no-baseline"}
    assert any("record begins before the supply is switched on" in w["text"] for w in found["warnings"])


DC = {"": "dc"}


@pytest.mark.slow
def test_back_emf_holds_the_truth_of_one_scope_whose_channels_err_together(tmp_path: Path) -> None:
    random = np.random.default_rng(5)
    accuracy = read_statements(["voltage=3%+50mV", "time=1%"])
    names = ("flux_linkage", "back_emf_constant_mechanical", "torque_constant", "electrical_frequency")
    counts = dict.fromkeys(names, 0)
    for _ in range(TRIALS):
        time, v = sim.emf_record(random)
        gain, offset, base, warm, grade = random.uniform(-1, 1, 5)
        read = v * (1 + 0.03 * gain) + 0.05 * offset
        path = table(tmp_path, "t (s),a (V),b (V),c (V)", time * (1 + 0.01 * base), *read)
        found = analyze_back_emf(
            path,
            connection="phase",
            pole_pairs=4,
            coupling=DC,
            accuracy=accuracy,
            temperature=Temperature(80.0, 5.0, -0.001),
        )
        sums_up(found)
        cold = sim.FLUX / (1 - 0.001 * (1 + 0.3 * grade) * (80 + 5 * warm - 25))
        for name, true in zip(names, (cold, 4 * cold, 6 * cold, 53.0), strict=True):
            counts[name] += holds(found["parameters"][name], true)
    assert_held(counts, names)
    assert sources(found["parameters"]["flux_linkage"]) == {
        "voltage channels: gain, as stated",
        "time base: gain, as stated",
        "magnet temperature",
        "magnets' temperature coefficient",
    }
    assert any("the fit includes the offsets of the voltage channels" in note for note in found["assumptions"])


def test_averaging_channels_reduces_only_what_they_do_not_share(tmp_path: Path) -> None:
    time, v = sim.emf_record(np.random.default_rng(1))
    path = table(tmp_path, "t (s),CH1 (V),CH2 (V),CH3 (V)", time, *v)
    single = table(tmp_path, "t (s),CH1 (V)", time, v[0], name="one.csv")
    probes = tmp_path / "probes.toml"
    probes.write_text("".join(f'[CH{k}]\ngain = 0.03\ninstrument = "probe {k}"\n' for k in (1, 2, 3)), encoding="utf-8")

    def spread(file: Path, *words: str, stated: Path | None = None) -> float:
        found = analyze_back_emf(file, connection="phase", coupling=DC, accuracy=read_statements(words, stated))
        sums_up(found)
        return float(found["parameters"]["flux_linkage"]["standard_uncertainty"] / sim.FLUX)

    one = spread(single, "voltage=3%")
    assert one == pytest.approx(0.03 / math.sqrt(3), rel=0.02)
    assert spread(path, "voltage=3%") == pytest.approx(one, rel=0.02)
    assert spread(path, "CH1=3%", "CH2=3%", "CH3=3%") == pytest.approx(one, rel=0.02)
    assert spread(path, stated=probes) == pytest.approx(one / math.sqrt(3), rel=0.02)
    # A channel's own statement overrules that of its kind.
    assert spread(path, "voltage=3%", "chan3=0%") == pytest.approx(2 / 3 * one, rel=0.02)


def test_a_drifting_speed_keeps_its_budget(tmp_path: Path) -> None:
    time, v = sim.emf_record(np.random.default_rng(2), drift=0.05)
    path = table(tmp_path, "t (s),a (V),b (V),c (V)", time, *(1.02 * v))
    found = analyze_back_emf(path, connection="phase", accuracy=read_statements(["voltage=3%"]))
    flux = found["parameters"]["flux_linkage"]
    assert flux["estimator"] == "voltage integrated over whole periods"
    assert holds(flux, sim.FLUX)
    sums_up(found)


@pytest.mark.slow
def test_coast_down_holds_the_truth_of_a_tachometer_and_a_transducer(tmp_path: Path) -> None:
    random = np.random.default_rng(6)
    names = ("inertia", "coulomb_friction", "viscous_friction")
    counts = dict.fromkeys(names, 0)
    accuracy = read_statements(["omega=1%+2rad/s", "torque=2%+2mN·m", "time=0.1%"])
    for _ in range(TRIALS):
        up, down = sim.ramps(random)
        gain, offset, torque_gain, torque_offset, base = random.uniform(-1, 1, 5)
        time = np.concatenate((up.time, up.time[-1] + 1e-3 + down.time)) * (1 + 0.001 * base)
        speed = np.concatenate((up.speed, down.speed)) * (1 + 0.01 * gain) + 2 * offset
        # The transducer is off while it drives; the coast-down's torque is known to be none.
        torque = np.where(
            np.arange(time.size) < up.time.size, sim.TORQUE * (1 + 0.02 * torque_gain) + 0.002 * torque_offset, 0.0
        )
        path = table(tmp_path, "time (s),omega (rad/s),torque (N·m)", time, speed, torque)
        found = analyze_coast_down(path, accuracy=accuracy)
        sums_up(found)
        for name, true in zip(names, (sim.INERTIA, sim.COULOMB, sim.VISCOUS), strict=True):
            counts[name] += holds(found["parameters"][name], true)
    assert_held(counts, names)
    assert {"speed: gain, as stated", "torque: gain, as stated"} <= sources(found["parameters"]["inertia"])


def test_coast_down_with_a_known_inertia_and_a_torque_given(tmp_path: Path) -> None:
    up, down = sim.ramps(np.random.default_rng(1))
    coast = table(tmp_path, "t (s),speed (rad/s)", down.time, down.speed * 1.01)
    accuracy = read_statements(["speed=2%"])
    known = analyze_coast_down(coast, inertia=sim.INERTIA, inertia_uncertainty=1e-6, accuracy=accuracy)
    sums_up(known)
    friction = known["parameters"]["coulomb_friction"]
    assert holds(friction, sim.COULOMB)
    assert sources(friction) == {"inertia as given", "speed: gain, as stated"}
    driven = table(tmp_path, "t (s),speed (rad/s)", up.time, up.speed, name="up.csv")
    both = analyze_coast_down([driven, coast], torque=sim.TORQUE * 1.03, accuracy=read_statements(["torque=5%"]))
    inertia = both["parameters"]["inertia"]
    assert sources(inertia) == {"torque: gain, as stated"}
    assert inertia["standard_uncertainty"] == pytest.approx(0.05 / math.sqrt(3) * inertia["value"], rel=0.05)
    with pytest.raises(
        InputError, match="accuracy of speed, offset ±300: readings with an error of that size give no estimate"
    ):
        analyze_coast_down(coast, accuracy=read_statements(["speed=300rad/s"]))


def test_rotor_sweep_holds_the_truth_of_a_meter(tmp_path: Path) -> None:
    random = np.random.default_rng(8)
    names = ("d_axis_inductance", "q_axis_inductance")
    counts = dict.fromkeys(names, 0)
    accuracy = read_statements(["inductance=0.5%+1uH"])
    for _ in range(TRIALS):
        at, readings = sim.sweep_record(random)
        gain, offset = random.uniform(-1, 1, 2)
        off = readings * (1 + 0.005 * gain) + 1e-6 * offset
        found = analyze_rotor_sweep(table(tmp_path, "angle (rad),L (H)", 2 * np.pi * at, off), accuracy=accuracy)
        sums_up(found)
        for name, true in zip(names, (sim.LD, sim.LQ), strict=True):
            counts[name] += holds(found["parameters"][name], true)
    assert_held(counts, names)


def test_without_a_statement_only_type_a_is_in_and_it_is_said(tmp_path: Path) -> None:
    time, v, i, _, _ = sim.step_record(np.random.default_rng(1), 8)
    path = table(tmp_path, "t (s),CH1 (V),CH2 (A)", time, v, i)
    bare = analyze_step_response(path)
    assert any("statistical (Type A)" in note for note in bare["assumptions"])
    assert any("not referred to 25 °C" in note for note in bare["assumptions"])
    stated = {row["source"] for p in bare["parameters"].values() for row in p["budget"] if row["kind"] == "B"}
    assert stated == {"skew of the channels: gain, as taken"}
    sums_up(bare)
    some = analyze_step_response(path, accuracy=read_statements(["CH1=2%"]))
    assert not any("statistical (Type A)" in note for note in some["assumptions"])
    assert "accuracy of voltage (CH1) as stated: ±2 %, rectangular (Type B)" in some["assumptions"]
    assert any(n.startswith("accuracy of current, time not stated: assumed exact") for n in some["assumptions"])


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("CH9=2%", "the capture has no channel 'CH9'; allowed are voltage, time .* and its channels CH1, CH2"),
        ("torque=2%", "this analysis uses no torque; allowed are voltage, time"),
        ("CH1=5mA", "an offset in A; allowed for voltage is one in V"),
        ("time=5ms", "a time base has a gain only"),
    ],
)
def test_a_statement_that_does_not_fit_the_capture_is_refused(tmp_path: Path, word: str, said: str) -> None:
    time, v = sim.emf_record(np.random.default_rng(1))
    path = table(tmp_path, "t (s),CH1 (V),CH2 (V)", time, v[0], v[1])
    with pytest.raises(InputError, match=rf"--accuracy {word}: {said}"):
        analyze_back_emf(path, accuracy=read_statements([word]))
