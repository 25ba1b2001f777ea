import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.physics.circuits.windings import Windings
from sim_instruments.physics.motor.hall import SimulatedHallSensors
from sim_instruments.six_step.machine import virtual_motor
from sim_instruments.world.world import World
from tests.sim_instruments.motors import SIX_STEP

TURN = np.linspace(0.0, 2.0 * math.pi, 720, endpoint=False) + 1e-4


def rises(levels: np.ndarray) -> float:
    """Return the electrical angle (°) at which a signal over TURN rises."""
    at = np.nonzero((levels > 2.5) & (np.roll(levels, 1) < 2.5))[0]
    assert len(at) == 1
    return float(np.degrees(TURN[at[0]]))


def test_ideal_sensors_rise_a_third_of_a_turn_apart_and_are_high_for_half() -> None:
    levels = SimulatedHallSensors().levels(TURN)
    assert [rises(lead) for lead in levels] == pytest.approx([210.0, 330.0, 90.0], abs=0.6)
    assert np.all(levels.mean(axis=1) == pytest.approx(2.5, abs=0.02))


@given(offset=st.floats(-1.0, 1.0), placement=st.floats(-0.3, 0.3))
def test_offset_and_placement_add_up(offset: float, placement: float) -> None:
    levels = SimulatedHallSensors(offset=offset, placements=(0.0, placement, 0.0)).levels(TURN)
    for lead, ideal, own in zip(levels, (210.0, 330.0, 90.0), (0.0, placement, 0.0), strict=True):
        away = (rises(lead) - ideal - math.degrees(offset + own) + 180.0) % 360.0 - 180.0
        assert abs(away) <= 0.6


def test_order_inversion_and_what_is_stuck() -> None:
    ideal = SimulatedHallSensors().levels(TURN)
    wrong = SimulatedHallSensors(order=(2, 1, 3), inverted=(3,), stuck=((1, "high"),), voltage=3.3).levels(TURN)
    assert np.array_equal(wrong[0] > 1.0, ideal[1] > 1.0)
    assert np.all(wrong[1] == 3.3)
    assert np.array_equal(wrong[2] > 1.0, ideal[2] < 1.0)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"order": (1, 1, 3)}, "order"),
        ({"inverted": (4,)}, "sensor 4"),
        ({"stuck": ((0, "low"),)}, "sensor 0"),
        ({"offset": math.nan}, "offset"),
        ({"voltage": 0.0}, "voltage"),
    ],
)
def test_what_no_motor_has(wrong: dict[str, object], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        SimulatedHallSensors(**wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("connection", ["wye", "delta"])
def test_sensor_1_rises_30_degrees_after_the_emf_of_phase_a(connection: str, lab: Any) -> None:
    motor = replace((lab.lg_400w if connection == "wye" else lab.outrunner)(), halls=SimulatedHallSensors())
    assert motor.halls is not None
    windings = Windings(motor, 25.0)
    emf = windings.emf_per_speed(TURN)
    # Of a delta (AB, BC, CA) the phase of the Y-equivalent.
    phase = emf[0] if connection == "wye" else (emf[0] - emf[2]) / 3.0
    crossing = float(np.degrees(TURN[np.nonzero((phase > 0.0) & (np.roll(phase, 1) <= 0.0))[0][0]]))
    high = motor.halls.levels(TURN - windings.phase_shift)[0]
    assert (rises(high) - crossing) % 360.0 == pytest.approx(30.0, abs=1.1)


@pytest.mark.parametrize("connection", ["wye", "delta"])
@pytest.mark.parametrize("advance", [0.0, 0.1])
def test_the_leads_are_the_sensors_that_the_six_step_drive_commutates_by(connection: str, advance: float) -> None:
    drive = replace(SIX_STEP, connection=connection, advance_angle=advance)  # type: ignore[arg-type]
    clock = VirtualClock()
    world = World(virtual_motor(drive), clock, six_step=drive)
    for channel, node in ((1, "H1"), (2, "H2"), (3, "H3")):
        world.attach_voltage_probe(channel, node, "H0")  # type: ignore[arg-type]
    world.turn_shaft(1.0)
    assert world.six_step is not None
    for _ in range(40):
        clock.sleep(0.0437)
        seen = tuple(bool(world.probe_signal(channel, [clock.now()])[0] > 2.5) for channel in (1, 2, 3))
        assert seen == world.six_step.hall_state()


def test_leads_of_a_motor_without_sensors_are_dead(lab: Any) -> None:
    world = World(lab.lg_400w(), VirtualClock())
    world.attach_voltage_probe(1, "H1", "H0")
    assert world.probe_signal(1, [0.0])[0] == 0.0
