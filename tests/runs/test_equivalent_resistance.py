"""The armature equivalent resistance, measured on the virtual dynamometer, against the exact model's own figures."""

import math
from pathlib import Path

import pytest

from bench.analysis.six_step_prediction import Friction, MeasuredDrive, findings_of, predictions
from bench.journal.finished_run import read_run
from bench.motor.motor_file import load_motor
from sim_instruments.bench import VirtualBench
from sim_instruments.six_step import balance
from sim_instruments.six_step.state import Bridge
from tests.runs.on_bench import measure

LOADS = (0.3, 0.5, 0.7, 0.9)
MOTOR = "92bl-30-25l"


@pytest.fixture(scope="module")
def drive():
    return load_motor(MOTOR).six_step


@pytest.fixture(scope="module")
def measured(motorbench_once, drive):
    inductance = drive.self_inductance - drive.mutual_inductance
    status, given = motorbench_once(
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


@pytest.mark.parametrize("typed", [pytest.param((), marks=pytest.mark.slow), ("winding_resistance_temperature=77",)])
def test_a_warm_winding_is_no_surprise(drive, typed):
    """R_11 is that of 25 °C and the winding at 77 °C: its temperature is asked for, before and after, and the copper's part held."""
    warm = 1.0 + 0.00393 / (1.0 + 0.00393 * 5.0) * 52.0
    entered = drive.resistance * (warm if typed else 1.0)
    motor = load_motor(MOTOR)
    with VirtualBench(motor.virtual, seed=4, six_step=drive, sockets=False) as bench:
        bench.world.set_ambient_temperature(77.0)
        bench.world.set_winding_temperature(77.0)
        found = measure(
            bench,
            motor.nameplate,
            "equivalent-resistance",
            f"loads={list(LOADS)}",
            f"winding_resistance={entered}",
            "winding_inductance=0.0004353",
            *typed,
        )
        stage = bench.world.six_step.stage.at(bench.world.truth()["winding_temperature"])
    truth = stage.steady(found.findings["points"][-1]["speed_rpm"] * math.pi / 30.0)
    copper = balance.losses(truth).copper / truth.average_supply_current**2
    assert copper == pytest.approx(warm * 0.1, rel=0.03)
    assert found.findings["winding_temperature"]["before"] == pytest.approx(77.0, abs=2.0)
    told = {p.name: p for p in found.parameters}
    truths = {
        "copper_resistance": copper,
        "switch_resistance": drive.switch_resistance,
        "line_emf_constant": 3.0 / math.pi * drive.emf_constant,
    }
    for name, value in truths.items():
        low, high = told[name].coverage_interval
        assert low <= value <= high, name
    assert "winding temperature" in {str(row.source) for row in told["copper_resistance"].budget}


def test_r_11_without_its_uncertainty_is_told_and_in_the_budget(measured):
    told = [w["message"] for w in measured["warnings"] if w["id"] == "unstated-uncertainty"]
    assert any("R_11" in each and "±2%" in each and "winding_resistance_uncertainty" in each for each in told)
    rows = {row["source"]: row for row in measured["parameters"]["copper_resistance"]["budget"]}
    share = rows["R_11 given"]["contribution"] / measured["parameters"]["copper_resistance"]["value"]
    assert share == pytest.approx(0.02 / math.sqrt(3.0), rel=0.05)


def test_commutation_is_a_line_with_a_band(measured, drive):
    line = measured["procedures"]["equivalent-resistance"]["findings"]["commutation_over_speed"]
    bridge = Bridge(drive)
    for row in line["band"]:
        speed = row["speed_rpm"] * math.pi / 30.0
        truth = _at_speed(bridge, speed)
        current = truth.average_supply_current
        part = (truth.average_bus_voltage - 3.0 / math.pi * drive.emf_constant * speed) / current
        part -= 2.0 * drive.switch_resistance + balance.losses(truth).copper / current**2
        assert row["low"] <= part <= row["high"]
        assert row["high"] - row["low"] < 0.2 * part
    assert measured["parameters"]["commutation_resistance_slope"]["value"] == pytest.approx(line["slope"])


def test_other_loads_and_voltages_are_predicted(motorbench, measured):
    status, made = motorbench(
        *("analyze", "six-step", measured["run"], "--motor", MOTOR, "--voltage", "12", "30", "--load", "0.1", "1.2"),
        *("--coulomb-friction", "0.0349", "--viscous-friction", "7.941e-6"),
    )
    assert status == 0, made
    assert [p["in_sample"] for p in made["points"]] == [False] * 4
    for point in made["points"]:
        for key in ("speed_rpm", "supply_current"):
            off = abs(point[key]["value"] - point["exact"][key])
            assert off <= 0.025 * point["exact"][key]
            assert off <= point[key]["U"]
    # The straight line alone knows nothing of how the current's shape changes.
    assert max(abs(p["deviation_percent"]["supply_current_by_line"]) for p in made["points"]) > 3.0


def test_a_prediction_far_off_is_the_motors_at_that_voltage(measured):
    read = read_run(measured["run"], Path("runs"))
    friction = Friction(0.0349, 7.941e-6)
    drive = MeasuredDrive(findings_of(read.view.finished, "run"), read.nameplate.connection.value, 0.7, friction)
    near, far, farther = predictions(drive, [30.0, 1e6, 1e9], [0.1])
    # By the straight line the current is the load's alone, and the speed goes with the voltage.
    assert near.line_current == far.line_current == farther.line_current == pytest.approx(2.29, rel=0.02)
    assert farther.line_speed == pytest.approx(1000.0 * far.line_speed, rel=1e-4)


def test_a_run_without_it_cannot_be_predicted_from(motorbench):
    status, run = motorbench("run", "pole-pairs-static", "--station", "virtual", "--motor", MOTOR)
    assert status == 0, run
    status, made = motorbench("analyze", "six-step", run["run"], "--load", "0.5")
    assert status == 2
    assert "motorbench run equivalent-resistance" in made["error"]


def test_all_that_is_needed_before_is_told_at_once(motorbench):
    status, given = motorbench("run", "equivalent-resistance", "--station", "virtual", "--motor", MOTOR)
    assert status == 1
    for setting in ("set loads", "set winding_resistance", "set winding_inductance"):
        assert given["cause"].count(setting) == 1, given["cause"]


def _at_speed(bridge, speed):
    from sim_instruments.six_step.steady_state import steady_state

    return steady_state(bridge, speed)
