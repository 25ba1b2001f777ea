"""A motor assumed from its plate: what is known is kept, and what is not is said."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.rehearsal.assumed import assumed_drive, assumed_motor
from procedures.core.nameplate import Nameplate, WindingConnection
from sim_instruments.six_step.machine import virtual_motor

PLATE: dict[str, Any] = {"name": "x", "rated_current": 10.0, "rated_speed_rpm": 3000.0, "rated_voltage": 48.0}


def test_what_the_file_expects_goes_before_any_rule() -> None:
    expected = {
        "pole_pairs": 5.0, "stator_resistance": 0.2, "d_axis_inductance": 1e-4, "q_axis_inductance": 2e-4,
        "back_emf_constant_mechanical": 0.1, "inertia": 2e-5, "coulomb_friction": 0.01, "viscous_friction": 1e-5,
    }  # fmt: skip
    motor, assumed = assumed_motor(Nameplate(connection=WindingConnection.DELTA, expected=expected, **PLATE))
    assert motor.pole_pairs == 5
    assert motor.stator_resistance_y == pytest.approx(0.2)
    assert motor.d_axis_inductance_y == pytest.approx(1e-4)
    assert motor.flux_linkage == pytest.approx(math.sqrt(3.0) * 0.1 / 5)
    assert motor.inertia == 2e-5
    told = {one.name: str(one.why) for one in assumed}
    assert set(told) == {
        "flux_linkage", "stator_resistance", "d_axis_inductance", "q_axis_inductance", "inertia", "coulomb_friction",
        "viscous_friction",
    }  # fmt: skip
    assert told["inertia"] == "type value, [expected] of the motor file"


def test_a_bare_plate_is_enough_and_every_figure_is_told() -> None:
    plate = Nameplate("x", WindingConnection.WYE, rated_current=10.0)
    motor, assumed = assumed_motor(plate)
    told = {one.name: (one.value, one.unit) for one in assumed}
    assert told["pole_pairs"] == (4, "1")
    assert told["rated_speed"] == (3000.0, "rpm")
    assert told["rated_voltage"] == (48.0, "V")
    assert told["flux_linkage"][0] == motor.flux_linkage
    drive, more = assumed_drive(motor, plate)
    assert {one.name for one in more} == {"source_voltage", "source_resistance", "switch_resistance", "diode_drop"}
    assert virtual_motor(drive).flux_linkage == pytest.approx(motor.flux_linkage)


@given(
    current=st.floats(0.05, 500.0),
    speed=st.floats(100.0, 50_000.0),
    voltage=st.floats(3.0, 800.0),
    pairs=st.integers(1, 40),
    connection=st.sampled_from(list(WindingConnection)),
)
def test_any_plate_gives_a_motor_that_reaches_its_rating(
    current: float, speed: float, voltage: float, pairs: int, connection: WindingConnection
) -> None:
    plate = Nameplate(
        "x", connection, rated_current=current, rated_speed_rpm=speed, rated_voltage=voltage, pole_pairs=pairs
    )
    motor, _ = assumed_motor(plate)
    linked = motor.flux_linkage / (math.sqrt(3.0) if connection is WindingConnection.DELTA else 1.0)
    emf = linked * pairs * speed * math.pi / 30.0
    drop = motor.stator_resistance_y * current
    assert math.sqrt(3.0) * (emf + drop) < voltage
    assert assumed_drive(motor, plate)[0].source_voltage == voltage
