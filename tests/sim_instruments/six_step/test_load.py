"""Speed at a load, and loads that no speed balances."""

import math
from dataclasses import replace

import pytest

from sim_instruments.six_step.balance import power_residual
from sim_instruments.six_step.drive import SixStepDrive, SixStepError
from sim_instruments.six_step.load import balance_load, stall_torque
from sim_instruments.six_step.state import Bridge
from sim_instruments.six_step.steady_state import steady_state


@pytest.mark.parametrize("load", [-1.3, -0.4, 0.0, 0.5, 1.2, 5.0, 5.43])
def test_torque_balances(bridge: Bridge, load: float) -> None:
    point = balance_load(bridge, load)
    assert point.load_torque == pytest.approx(load, abs=1e-10)
    assert abs(power_residual(point)) < 1e-6


def test_stall_torque_is_the_limit_of_low_speed(bridge: Bridge) -> None:
    assert stall_torque(bridge) == pytest.approx(steady_state(bridge, 1e-4).electromagnetic_torque, rel=1e-6)


def test_stall_torque_by_hand(example: SixStepDrive, bridge: Bridge) -> None:
    # R parallel to 2R, behind source and two switches; the parallel EMF (a + b is −c) averages to 3/π of its peak.
    current = example.source_voltage / (2 / 3 * example.resistance + 0.06 + 0.124)
    assert stall_torque(bridge) == pytest.approx(current * 3 / math.pi * example.emf_constant, rel=1e-12)


def test_load_above_stall(bridge: Bridge) -> None:
    with pytest.raises(SixStepError, match=r"load 6 N·m is above the stall torque: less than 5\.432 N·m"):
        balance_load(bridge, 6.0)


def test_load_that_drives_too_hard(bridge: Bridge) -> None:
    with pytest.raises(SixStepError, match="drives the machine harder than it can brake"):
        balance_load(bridge, -100.0)


def test_drive_that_cannot_start(example: SixStepDrive) -> None:
    with pytest.raises(SixStepError, match=r"cannot start: it gives .* against 6 N·m of Coulomb friction"):
        balance_load(Bridge(replace(example, coulomb_friction=6.0)), 0.1)


@pytest.mark.parametrize("load", [math.nan, math.inf, -math.inf])
def test_load_not_finite(bridge: Bridge, load: float) -> None:
    with pytest.raises(SixStepError, match="a finite torque is needed"):
        balance_load(bridge, load)


@pytest.mark.parametrize("speed", [0.0, -1.0, math.nan, math.inf])
def test_speed_that_has_no_period(bridge: Bridge, speed: float) -> None:
    with pytest.raises(SixStepError, match="finite speed above 0"):
        steady_state(bridge, speed)


def test_speed_beyond_sense_and_resistances_too_small(example: SixStepDrive, bridge: Bridge) -> None:
    with pytest.raises(SixStepError, match="can be solved for this drive"):
        steady_state(bridge, 1e200)
    bare = Bridge(replace(example, resistance=1e-9, switch_resistance=0.0, source_resistance=0.0))
    with pytest.raises(SixStepError, match="resistances are too small"):
        steady_state(bare, 340.0)


def test_emf_above_any_motoring_point_is_a_generating_point(example: SixStepDrive) -> None:
    point = steady_state(Bridge(replace(example, emf_constant=10.0)), 340.0)
    assert point.average_supply_current < 0
    assert point.load_torque < 0
    assert abs(power_residual(point)) < 1e-6
