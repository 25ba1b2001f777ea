"""Records that look sound and are not: iron that holds back the field from a bridge, and a channel bent so far that its pitch doubles."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from drivers.interfaces import Accuracy, NotOfferedError
from drivers.keysight.e4980a import KeysightE4980A
from tests.studies.worlds.measured_motor import measure, study_plan

MOTORS = Path(__file__).parents[2] / "bench" / "motors"
BRIDGES = ("dq-inductance-aligned", "dq-inductance-extremes")


@pytest.mark.parametrize(("coupling", "resistance"), [(0.4, 6.0), pytest.param(0.3, 30.0, marks=pytest.mark.slow)])
def test_bridges_give_the_inductance_for_slow_changes(motorbench, tmp_path, coupling, resistance):
    text = (MOTORS / "gimbal.toml").read_text(encoding="utf-8")
    motor = tmp_path / "eddy.toml"
    iron = f"\n[virtual.iron]\neddy_coupling = {coupling}\neddy_resistance = {resistance}\n"
    motor.write_text(text + iron, encoding="utf-8")
    slow = ("--set", "at_frequency=false")
    status, given = motorbench("run", *BRIDGES, *slow, "--station", "virtual", "--motor", str(motor))
    assert status == 0
    for name in BRIDGES:
        for axis, truth in (("d", 1.90e-3), ("q", 2.05e-3)):
            parameter = given["procedures"][name]["parameters"][f"{axis}_axis_inductance"]
            low, high = parameter["coverage_interval"]
            assert low <= truth <= high
            assert high - low < 0.12 * truth
        assert "second-time-constant" in {warning["id"] for warning in given["procedures"][name]["warnings"]}


@pytest.mark.slow
def test_the_inductance_at_the_bridges_frequency_has_no_part_of_what_circuits_hide(motorbench, tmp_path):
    arguments = ("run", "dq-inductance-extremes", "--station", "virtual", "--motor")
    slow = ("--set", "at_frequency=false")
    for options, most in ((slow, 0.3), ((), 0.005)):
        status, given = motorbench(*arguments, "lg-400w", *options)
        assert status == 0
        said = {warning["id"] for warning in given["warnings"]}
        assert ("slow-circuits-unseen" in said) == (options == slow)
        parameter = given["parameters"]["d_axis_inductance"]
        low, high = parameter["coverage_interval"]
        assert low <= parameter["truth"] <= high <= low + most * parameter["truth"]
    motor = tmp_path / "eddy.toml"
    iron = "\n[virtual.iron]\neddy_coupling = 0.4\neddy_resistance = 6.0\n"
    motor.write_text((MOTORS / "gimbal.toml").read_text(encoding="utf-8") + iron, encoding="utf-8")
    status, given = motorbench(*arguments, str(motor))
    assert status == 0
    # k² ω²τ²/(1 + ω²τ²) is held back, with τ = L/R of the circuit.
    turned = 2.0 * math.pi * 1000.0 * 1.90e-3 / 6.0
    parameter = given["parameters"]["d_axis_inductance"]
    low, high = parameter["coverage_interval"]
    assert parameter["truth"] == pytest.approx(1.90e-3 * (1.0 - 0.16 * turned**2 / (1.0 + turned**2)), rel=1e-12)
    assert low <= parameter["truth"] <= high <= 1.005 * low
    assert {(said["cause"], said["answer"]) for said in given["misfit"]} == {("second-time-constant", "said")}


@pytest.mark.parametrize("coupled", [True, False])
def test_what_iron_takes_is_no_resistance_of_the_winding(motorbench, tmp_path, coupled):
    text = (MOTORS / "gimbal.toml").read_text(encoding="utf-8")
    motor = tmp_path / "eddy.toml"
    iron = "\n[virtual.iron]\neddy_coupling = 0.5\neddy_resistance = 0.4\n" if coupled else ""
    motor.write_text(text + iron, encoding="utf-8")
    # Losses differ between lines as their inductances do: no contact is to blame.
    procedures = ("stator-resistance", "stator-resistance-dc")
    status, given = motorbench("run", *procedures, "--station", "virtual", "--motor", str(motor))
    assert status == 0
    for name in procedures:
        low, high = given["procedures"][name]["parameters"]["stator_resistance"]["coverage_interval"]
        assert low <= given["parameters"]["stator_resistance"]["truth"] <= high
    told = [(said["cause"], said["answer"]) for said in given["misfit"]]
    assert told == ([("second-time-constant", "modelled")] if coupled else [])


def test_a_bridge_of_few_frequencies_measures_at_its_own(motorbench, monkeypatch):
    own = KeysightE4980A.configure

    def configure(bridge, frequency, *level_and_aperture):
        if frequency not in (offered := (100.0, 1000.0)):
            raise NotOfferedError("lcr_meter", "frequency", frequency, "Hz", offered)
        return own(bridge, frequency, *level_and_aperture)

    monkeypatch.setattr(KeysightE4980A, "configure", configure)
    status, given = motorbench("run", *BRIDGES, "--station", "virtual", "--motor", "gimbal")
    assert status == 0
    assert given["misfit"] == []
    low, high = given["parameters"]["d_axis_inductance"]["coverage_interval"]
    assert low <= 1.90e-3 <= high


@pytest.mark.parametrize("known", [{}, {"inductance": math.nan}])
def test_a_bridge_that_states_no_accuracy_or_no_inductance_measures_all_the_same(motorbench, monkeypatch, known):
    own = KeysightE4980A.measure

    def measure(bridge, *wanted):
        accuracies = {"resistance_accuracy": Accuracy(), "inductance_accuracy": Accuracy()}
        return replace(own(bridge, *wanted), **accuracies, **known)

    monkeypatch.setattr(KeysightE4980A, "measure", measure)
    status, given = motorbench("run", "stator-resistance", "--station", "virtual", "--motor", "gimbal")
    assert (status, given["misfit"]) == (0, [])
    assert given["parameters"]["stator_resistance"]["value"] == pytest.approx(5.62, rel=5e-3)


@pytest.mark.parametrize(("bow", "told"), [(0.0, False), (0.003, False), (0.277, True)])
def test_twice_the_frequency_is_not_taken_for_the_frequency(motorbench, tmp_path, bow, told):
    file = tmp_path / "bow.toml"
    file.write_text(f"[channels.1]\nbow = {bow}\n", encoding="utf-8")
    arguments = ("run", "pole-pairs-back-emf", "--station", "virtual", "--motor", "gimbal")
    _, given = motorbench(*arguments, "--disturbances", str(file))
    if told:
        assert given["parameters"] == {}
        assert "pole_pairs" in given["withheld"]
        (said,) = given["misfit"]
        assert (said["cause"], said["answer"]) == ("wrong-period", "withheld")
        assert (said["figures"]["pairs"], said["figures"]["fewer"]) == (22.0, 11.0)
    else:
        assert given["parameters"]["pole_pairs"]["value"] == 11.0
        assert given["misfit"] == []


def test_hum_beside_a_small_current_is_no_lost_control(motorbench, tmp_path):
    file = tmp_path / "hum.toml"
    file.write_text("[channels.4]\nhum = 0.5\n", encoding="utf-8")
    arguments = ("run", "pole-pairs-inverter", "--station", "virtual", "--motor", "gimbal")
    status, given = motorbench(*arguments, "--disturbances", str(file))
    assert status != 0
    assert "50 Hz, as the mains have" in str(given)


def test_the_loop_of_two_joined_lines_is_no_circuit_beside_the_winding():
    """Friction holds the rotor a little off its axis, and so couples the loop of B and C; here with a delta of unlike windings."""
    drawn = measure(2, 137, study_plan(("dq-inductance-aligned",)))
    assert {figure.name for figure in drawn.figures} == {"d_axis_inductance", "q_axis_inductance"}
    assert all(figure.low <= figure.truth <= figure.high < 1.05 * figure.low for figure in drawn.figures)
