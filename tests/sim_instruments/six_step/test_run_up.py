"""The run-up against solve_ivp with the shaft free, and where it ends."""

import math

import numpy as np
import pytest

from sim_instruments.six_step.drive import SixStepDrive, SixStepError
from sim_instruments.six_step.load import balance_load
from sim_instruments.six_step.run_up import run_up
from sim_instruments.six_step.state import Bridge
from tests.sim_instruments.six_step.reference import Reference


def reference_run(drive: SixStepDrive, load: float, states: int) -> tuple[np.ndarray, np.ndarray]:
    other = Reference(drive, None, load)
    # Just above standstill, where the reference's friction holds.
    y, time, rows = np.array([0.0, 0.0, 0.0, 0.0, 1e-6]), 0.0, []
    for number in range(states):
        y, spent = other.run_state(y, number, t_end=1.0)
        time += spent
        y[3] = (number + 1) * math.pi / 3
        rows.append([time, *y[:3], y[4]])
    table = np.array(rows)
    return table[:, 0], table[:, 1:]


def test_agrees_with_the_reference(example: SixStepDrive, bridge: Bridge) -> None:
    times, table = reference_run(example, 0.5, 30)
    found = run_up(bridge, times[-1], load_torque=0.5)
    final = balance_load(bridge, 0.5).speed
    speeds = np.interp(times, found.times, found.speeds)
    assert np.abs(speeds - table[:, 3]).max() < 2e-5 * final
    currents = [np.interp(times, found.times, row) for row in found.winding_currents]
    assert np.abs(np.array(currents) - table[:, :3].T).max() < 0.01


def test_error_is_of_second_order(bridge: Bridge) -> None:
    ends = [run_up(bridge, 0.006, load_torque=0.5, steps_per_state=n).speeds[-1] for n in (8, 16, 32, 256)]
    errors = np.abs(np.array(ends[:3]) - ends[3])
    assert errors[2] < errors[0] / 8


def test_settles_at_the_balance(bridge: Bridge) -> None:
    found = run_up(bridge, 0.15, load_torque=0.5)
    late = found.times > 0.12
    expected = balance_load(bridge, 0.5)
    mean = np.trapezoid(found.speeds[late], found.times[late]) / np.ptp(found.times[late])
    assert mean == pytest.approx(expected.speed, rel=2e-4)
    assert np.abs(found.winding_currents[:, late]).max() == pytest.approx(7.56, rel=0.02)


def test_rotor_stays_where_the_brake_holds_it(bridge: Bridge) -> None:
    found = run_up(bridge, 0.02, load_torque=20.0)
    assert (found.speeds == 0.0).all()
    assert found.angles[-1] == 0.0
    # It stands with the currents of stall.
    assert found.winding_currents[:, -1] == pytest.approx([31.13, 31.13, -62.26], rel=2e-3)


def test_a_spinning_rotor_is_braked_to_rest_and_not_turned_back(bridge: Bridge) -> None:
    found = run_up(bridge, 0.02, load_torque=20.0, initial_speed=100.0)
    assert found.speeds[0] == 100.0
    assert found.speeds[-1] == 0.0
    assert (np.diff(found.angles) >= 0.0).all()


@pytest.mark.parametrize(
    "arguments",
    [
        {"duration": 0.0},
        {"duration": math.nan},
        {"duration": 1.0, "initial_speed": -1.0},
        {"duration": 1.0, "initial_angle": 2.0},
    ],
)
def test_arguments_out_of_range(bridge: Bridge, arguments: dict[str, float]) -> None:
    with pytest.raises(SixStepError, match=r"duration|run-up"):
        run_up(bridge, **arguments)
