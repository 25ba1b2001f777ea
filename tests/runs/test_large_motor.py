"""A motor of 85 kW on a virtual bench, which is as large as the motor."""

from pathlib import Path

import pytest

from bench.motor.motor_file import load_motor
from bench.testing import assert_holds_truth, run_procedures

MOTOR = """
[nameplate]
name = "traction, 85 kW"
connection = "wye"
rated_current = 250.0
maximum_current = 400.0
rated_speed_rpm = 3000.0
rated_voltage = 300.0

[virtual]
pole_pairs = 4
phase_resistance = 0.012
d_axis_inductance = 200e-6
q_axis_inductance = 500e-6
flux_linkage = 0.07
inertia = 0.05
coulomb_friction = 0.4
viscous_friction = 1e-3
"""


def measured(tmp_path: Path, *procedures: str):
    path = tmp_path / "motor.toml"
    path.write_text(MOTOR)
    ran = run_procedures(list(procedures), load_motor(path), tmp_path / "runs", seed=5, settings={}, faults=[])
    assert ran.status == "completed", ran.cause
    return ran


def test_a_supply_smaller_than_the_motor_is_used_and_told(tmp_path: Path) -> None:
    ran = measured(tmp_path, "pole-pairs-static", "dq-inductance-time-constant")
    assert ran.parameters["pole_pairs"].value == 4
    assert_holds_truth(ran, names=("d_axis_inductance", "q_axis_inductance"), times=1.5)
    assert ran.warnings.count("small-supply") == 2
    # The loop's resistance is read when the rotor no longer swings.
    assert "channels-differ" not in ran.warnings


@pytest.mark.slow
def test_a_rehearsal_on_the_virtual_station_is_as_large_as_the_motor(motorbench, tmp_path: Path) -> None:
    path = tmp_path / "motor.toml"
    path.write_text(MOTOR)
    procedures = ("pole-pairs-static", "pole-pairs-inverter", "inertia", "torque-constant")
    status, result = motorbench("run", *procedures, "--station", "virtual", "--motor", str(path), "--rehearse")
    assert status == 0, result
    assert result["good"]
    assert result["highest"]


@pytest.mark.slow
def test_inertia_and_friction_beside_a_dynamometer_of_its_size(tmp_path: Path) -> None:
    ran = measured(tmp_path, "inertia")
    assert_holds_truth(ran, names=("inertia", "coulomb_friction", "viscous_friction"), times=1.0)


@pytest.mark.slow
def test_the_short_circuit_s_current_is_within_the_probe_s_range(tmp_path: Path) -> None:
    ran = measured(tmp_path, "short-circuit")
    low, high = ran.parameters["d_axis_chord_inductance"].coverage_interval
    assert low < 200e-6 < high
    assert "clipped" not in ran.warnings
