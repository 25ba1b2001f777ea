"""A motor for more than a small virtual inverter's 48 V and a small dynamometer's 10 N·m: the virtual bench's are as large as the motor."""

import pytest

MOTOR = """
[nameplate]
name = "high voltage"
connection = "wye"
rated_current = 20.0
maximum_current = 22.0
rated_speed_rpm = 1600.0
rated_voltage = {voltage}
maximum_speed_rpm = 2000.0

[virtual]
phase_resistance = [0.6, 0.6, 0.6]
d_axis_inductance = 20.4e-3
q_axis_inductance = 136e-3
flux_linkage = 0.444
pole_pairs = 2
inertia = 0.015
coulomb_friction = 0.2
viscous_friction = 1.0e-3
"""


def _count(motorbench, tmp_path, voltage: float) -> tuple[int, dict]:
    file = tmp_path / "motor.toml"
    file.write_text(MOTOR.format(voltage=voltage))
    return motorbench("run", "pole-pairs-inverter", "--station", "virtual", "--operator", "virtual", "--motor", str(file))  # fmt: skip


def test_the_virtual_inverter_has_the_motors_voltage(motorbench, tmp_path):
    status, result = _count(motorbench, tmp_path, 600.0)
    assert status == 0
    assert result["parameters"]["pole_pairs"]["value"] == 2


def test_a_rotor_that_falls_out_of_step_for_want_of_voltage_is_told_why(motorbench, tmp_path):
    status, result = _count(motorbench, tmp_path, 48.0)
    assert status != 0
    assert "the inverter's DC link may be too low" in str(result)


@pytest.mark.slow
def test_the_virtual_dynamometer_holds_the_motors_torque(motorbench, tmp_path):
    """At 20 A and 41° it makes 89 N·m by its constants."""
    file = tmp_path / "motor.toml"
    file.write_text(MOTOR.format(voltage=600.0))
    settings = ("flux-map.locations=12", "flux-map.d_from=0", "flux-map.d_to=0.2", "flux-map.symmetric=true")
    status, result = motorbench(
        "run", "pole-pairs-back-emf", "flux-map", "--station", "virtual", "--operator", "virtual", "--motor", str(file),
        *(word for setting in settings for word in ("--set", setting)),
    )  # fmt: skip
    assert status == 0
    found = result["procedures"]["flux-map"]
    torque = found["findings"]["torque"]
    assert max(torque["readings"]["shaft_torque"]) > 20.0
    assert torque["ratio"] == pytest.approx(1.0, abs=0.01)
