"""States of the bench that the simulation does not model; readings in them must not be used."""

import math

import numpy as np

from sim_instruments.physics.mapped.windings import windings_of
from sim_instruments.physics.motor.hall import SimulatedHallSensors
from sim_instruments.world.constants import INVERTER_POLES, Constants
from sim_instruments.world.segment import Segment, State
from sim_instruments.world.settings import WorldSettings
from sim_instruments.world.sources.six_step_drive import SOCKETS

#: Sensors within this angle (rad) switch at the same place.
_SAME_ANGLE = 1e-6
_TURN = np.linspace(0.0, 2.0 * math.pi, 721)
_OFF = (
    "the diodes of {drive} that is off: the motor's EMF reaches {emf:.3g} V between its terminals and the bus has {bus:.3g} V, so that "
    "they conduct and brake the shaft; turn it more slowly, or take the wires off"
)
_HALL_FAULTS = "a six-step drive that commutates by faulty or turned Hall sensors; leave the motor's Hall faults out, or measure without it"
_IRON = "a six-step drive on a motor whose iron takes currents; leave [virtual.iron] and [virtual.flux_map] out"


def unmodelled(constants: Constants, settings: WorldSettings, state: State, segment: Segment) -> str | None:
    """Return what of a segment's beginning or end is not modelled and what to leave out, None where all is."""
    if settings.six_step.enabled:
        return _under_six_step(constants)
    if settings.inverter.enabled:
        return None
    sockets = settings.sockets()
    for poles, drive, bus in (
        (SOCKETS, "a six-step drive", _six_step_bus(constants)),
        (INVERTER_POLES, "an inverter", constants.inverter.dc_voltage),
    ):
        joined = [k for k, socket in enumerate(sockets) if socket in poles]
        if len(joined) < 2:
            continue
        emf = _largest_emf(constants, state, segment, joined)
        if emf > bus:
            return _OFF.format(drive=drive, emf=emf, bus=bus)
    return None


def _under_six_step(constants: Constants) -> str | None:
    motor = constants.motor
    if constants.six_step is not None:
        # The drive commutates as its advance angle says, whatever the motor's sensors show.
        sound = SimulatedHallSensors(offset=-constants.six_step.drive.advance_angle)
        if motor.halls is None or not _switches_as(motor.halls, sound):
            return _HALL_FAULTS
    if motor.follows_flux or motor.iron.lowers_emf or motor.iron.has_eddy_currents:
        return _IRON
    return None


def _switches_as(halls: SimulatedHallSensors, sound: SimulatedHallSensors) -> bool:
    off = max(abs(halls.offset - sound.offset), *map(abs, halls.placements))
    return off < _SAME_ANGLE and (halls.order, halls.inverted, halls.stuck) == (
        sound.order,
        sound.inverted,
        sound.stuck,
    )


def _six_step_bus(constants: Constants) -> float:
    """Return the voltage (V) between two terminals above which a six-step drive's diodes conduct."""
    if constants.six_step is None:
        return math.inf
    drive = constants.six_step.drive
    return drive.source_voltage + 2.0 * drive.diode_drop


def _largest_emf(constants: Constants, state: State, segment: Segment, joined: list[int]) -> float:
    """Return the largest EMF (V) between two of these terminals at the segment's faster end."""
    ends = np.array([segment.start, segment.end if math.isfinite(segment.end) else segment.start])
    speed = float(np.abs(segment.motion.speed(ends)).max()) * constants.motor.pole_pairs
    if not speed:
        return 0.0
    windings = windings_of(constants.motor, state.temperature, state.magnet_temperature)
    a, b, c = windings.emf_per_speed(_TURN)
    nodes = np.array(
        [a, b, c] if constants.motor.connection == "wye" else [(a - c) / 3.0, (b - a) / 3.0, (c - b) / 3.0]
    )
    spans = [np.abs(nodes[k] - nodes[m]).max() for k in joined for m in joined if k < m]
    return speed * float(max(spans))
