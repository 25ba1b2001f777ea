"""The armature equivalent resistance, measured on the virtual dynamometer, against the exact model's own figures."""

import math

import pytest

from bench.motor.motor_file import load_motor
from sim_instruments.six_step import balance
from sim_instruments.six_step.state import Bridge

LOADS = (0.3, 0.5, 0.7, 0.9)
MOTOR = "92bl-30-25l"


@pytest.fixture(scope="module")
def drive():
    return load_motor(MOTOR).six_step


@pytest.fixture
def measured(motorbench, drive):
    inductance = drive.self_inductance - drive.mutual_inductance
    status, given = motorbench(
        *("run", "equivalent-resistance", "--station", "virtual", "--motor", MOTOR, "--seed", "5"),
        *("--set", f"loads={list(LOADS)}"),
        *("--set", f"winding_resistance={drive.resistance}", "--set", f"winding_inductance={inductance}"),
    )
    assert status == 0, given
    return given


def test_parts_agree_with_the_model(measured, drive):
    points = measured["procedures"]["equivalent-resistance"]["findings"]["points"]
    bridge = Bridge(drive)
    for point in points:
        # The dynamometer's own bearings brake too; the speed tells the load that the model has to carry.
        truth = _at_speed(bridge, point["speed_rpm"] * math.pi / 30.0)
        resistive, inductive = balance.equivalent_resistance(truth, 2)
        assert point["R_11r"] == pytest.approx(resistive, rel=0.01)
        assert point["R_11L"] == pytest.approx(inductive, rel=0.03)
        assert point["bus_current"] == pytest.approx(truth.average_supply_current, rel=0.01)
        assert point["copper_loss"] == pytest.approx(balance.losses(truth).copper, rel=0.02)


def test_reported_figures_hold_the_truth(measured, drive):
    parameters = measured["parameters"]
    truths = {"switch_resistance": drive.switch_resistance, "line_emf_constant": 3.0 / math.pi * drive.emf_constant}
    for name, truth in truths.items():
        figure = parameters[name]
        assert abs(figure["value"] - truth) <= 3.0 * figure["standard_uncertainty"] + 1e-3 * truth, (
            name,
            figure["value"],
            truth,
        )
    assert parameters["equivalent_resistance"]["note_value"] == pytest.approx(
        2.0 * drive.switch_resistance + 2.0 / 3.0 * drive.resistance, rel=0.03
    )


def test_commutation_explains_the_speed_and_the_simple_model_does_not(measured):
    findings = measured["procedures"]["equivalent-resistance"]["findings"]
    for prediction in findings["predicted_speeds"]:
        speed = prediction["speed_rpm"]
        assert abs(prediction["with_commutation_rpm"] / speed - 1.0) < 0.003
        assert prediction["simple_model_rpm"] / speed - 1.0 > 0.05
    assert findings["commutation_over_speed"]["slope"] > 0.0
    assert {"E14", "delta-from-outside"} <= {w["id"] for w in measured["warnings"]}


def test_no_load_can_be_chosen_without_a_torque_constant(motorbench):
    status, given = motorbench("run", "equivalent-resistance", "--station", "virtual", "--motor", MOTOR)
    assert status == 1
    assert "set loads" in given["cause"]


def _at_speed(bridge, speed):
    from sim_instruments.six_step.steady_state import steady_state

    return steady_state(bridge, speed)
