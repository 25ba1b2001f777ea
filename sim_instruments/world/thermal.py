"""Temperatures of winding and magnets: first order each, exact for the mean loss of each segment."""

import math
from dataclasses import replace

import numpy as np

from sim_instruments.physics.circuits.transient import LinearTransient
from sim_instruments.physics.motion.motion import RestingShaft
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.world.segment import Segment
from sim_instruments.world.settings import Heating

#: Departure (K) from the temperature a segment began with below which its resistances need no renewal.
_NEGLIGIBLE = 0.05
_LOOK_AHEAD = 10.0
#: Times in a segment at which the iron's loss is looked at.
_LOSS_POINTS = 16


def temperature_after(
    motor: VirtualMotor, ambient: float, heating: Heating | None, temperature: float, segment: Segment, until: float
) -> float:
    """Return the winding's temperature (°C) at a time (s) in a segment that began with `temperature`."""
    passed = until - segment.start
    if passed <= 0.0 or math.isinf(passed):
        return temperature if passed <= 0.0 else ambient
    if heating is not None:
        fallen = math.exp(-passed / heating.time_constant)
        return heating.temperature + (temperature - heating.temperature) * fallen
    loss = 0.0
    if segment.warms and motor.thermal_resistance > 0.0:
        circuit, heat = segment.circuit, None
        if isinstance(circuit, LinearTransient):
            heat = circuit.copper_heat(passed)
        if heat is None:
            times, weights = segment.nodes_between(segment.start, until)
            heat = float(weights @ segment.copper_loss(times))
        loss = heat / passed
    final = ambient + motor.thermal_resistance * loss
    return final + (temperature - final) * math.exp(-passed / motor.thermal_time_constant)


def magnets_after(
    motor: VirtualMotor,
    ambient: float,
    winding: tuple[float, float],
    magnets: float | None,
    segment: Segment,
    until: float,
) -> float | None:
    """Return the magnets' temperature (°C) at a time (s) in a segment that began with one; None where it is the winding's.

    `winding` are the winding's temperatures (°C) at the segment's start and at that time.
    """
    constant = motor.magnets.time_constant
    if magnets is None or constant is None:
        return None
    passed = until - segment.start
    if passed <= 0.0 or math.isinf(passed):
        return magnets if passed <= 0.0 else ambient
    final = _magnets_tend_to(motor, ambient, 0.5 * sum(winding), segment, until)
    return final + (magnets - final) * math.exp(-passed / constant)


def _magnets_tend_to(motor: VirtualMotor, ambient: float, winding: float, segment: Segment, until: float) -> float:
    loss = 0.0
    if motor.magnets.thermal_resistance > 0.0:
        loss = float(segment.iron_loss(np.linspace(segment.start, until, _LOSS_POINTS)).mean())
    return motor.magnets.final(ambient, winding, loss)


def next_update(
    motor: VirtualMotor,
    ambient: float,
    heating: Heating | None,
    temperature: float,
    magnet_temperature: float | None,
    segment: Segment,
) -> Segment:
    """Return the segment, cut short where its temperatures will have changed resistances or magnets by then."""
    segment = _next_of_winding(motor, ambient, heating, temperature, segment)
    constant = motor.magnets.time_constant
    if magnet_temperature is None or constant is None or isinstance(segment.motion, RestingShaft):
        return segment
    final = _magnets_tend_to(motor, ambient, temperature, segment, min(segment.end, segment.start + _LOOK_AHEAD))
    due = segment.start + constant / 100.0
    if abs(final - magnet_temperature) <= _NEGLIGIBLE or due >= segment.end:
        return segment
    return replace(segment, end=due, outcome="none")


def _next_of_winding(
    motor: VirtualMotor, ambient: float, heating: Heating | None, temperature: float, segment: Segment
) -> Segment:
    if not segment.live and segment.supply_mode == "off" and segment.dynamometer.kind == "idle":
        return segment
    if (
        isinstance(segment.motion, RestingShaft)
        and isinstance(segment.circuit, LinearTransient)
        and segment.circuit.dead
    ):
        return segment
    if heating is not None:
        final, constant = heating.temperature, heating.time_constant
    else:
        final = ambient
        if segment.warms:
            at = np.array([segment.start, min(segment.end, segment.start + _LOOK_AHEAD)])
            final += motor.thermal_resistance * float(segment.copper_loss(at).max())
        constant = motor.thermal_time_constant
    if abs(final - temperature) <= _NEGLIGIBLE:
        return segment
    due = segment.start + constant / 100.0
    return replace(segment, end=due, outcome="none") if due < segment.end else segment
