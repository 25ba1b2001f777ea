"""A virtual motor's true values by the table of parameters."""

from dataclasses import replace

import pytest

from bench.motor.motor_file import load_motor
from bench.virtual.true_values import _FORMULAS, MeasuredAt, true_values
from drivers.interfaces.text import text
from procedures.core.parameter_definition import ParameterDefinition, ParameterTable
from procedures.core.parameters import PARAMETERS


def test_every_parameter_with_a_true_value_has_one_of_a_motor_with_a_six_step_drive() -> None:
    motor = load_motor("92bl-30-25l")
    wanted = {name for name, definition in PARAMETERS.items() if definition.true_value}
    assert set(true_values(PARAMETERS, replace(motor.virtual_motor(), connection="wye"), motor.six_step)) == wanted


def test_every_formula_belongs_to_a_parameter() -> None:
    assert set(_FORMULAS) == {each.true_value for each in PARAMETERS.values() if "." not in each.true_value} - {""}


@pytest.mark.parametrize("place", ["motor.capacitance", "motor.connection", "drive.inertial", "weight", "bench.motor"])
def test_a_place_that_holds_no_number_is_named(place: str) -> None:
    motor = load_motor("92bl-30-25l")
    table = ParameterTable([ParameterDefinition("weight", "m", "kg", text("Weight"), true_value=place)])
    with pytest.raises(ValueError, match=f"parameter weight: true_value = '{place}' is no number"):
        true_values(table, motor.virtual_motor(), motor.six_step)


def test_a_motor_that_saturates_has_the_torque_constant_of_the_currents_it_is_measured_at() -> None:
    motor = load_motor("ipmsm-map").virtual_motor()
    assert motor.flux_map is not None
    at_none = true_values(PARAMETERS, motor)["torque_constant"]
    assert at_none == pytest.approx(1.5 * motor.pole_pairs * motor.flux_linkage_y)
    assert true_values(PARAMETERS, motor, None, MeasuredAt([-1e-3, 0.0, 1e-3]))["torque_constant"] == pytest.approx(
        at_none, rel=1e-3
    )
    flux, _ = motor.flux_map.flux(0.0, 60.0)
    loaded = true_values(PARAMETERS, motor, None, MeasuredAt([-60.0, 60.0]))["torque_constant"]
    assert loaded == pytest.approx(1.5 * motor.pole_pairs * float(flux), rel=1e-9)
    assert loaded < 0.95 * at_none
    constant = load_motor("ipmsm").virtual_motor()
    assert true_values(PARAMETERS, constant, None, MeasuredAt([-60.0, 60.0])) == true_values(PARAMETERS, constant)


def test_windings_of_unlike_emf_make_the_torque_of_their_mean() -> None:
    motor = load_motor("gimbal").virtual_motor()
    weak = replace(motor, emf_shares=(1.0, 0.85, 1.0))
    assert true_values(PARAMETERS, weak)["torque_constant"] == pytest.approx(0.95 * motor.torque_constant)
