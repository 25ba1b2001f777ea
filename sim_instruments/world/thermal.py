"""Temperature of the winding: first order, exact for the mean loss of each segment."""

import math
from dataclasses import replace

import numpy as np

from sim_instruments.physics.motion import Rest
from sim_instruments.physics.motor import VirtualMotor
from sim_instruments.physics.transient import LinearTransient
from sim_instruments.world.segment import Segment
from sim_instruments.world.settings import Heating

#: Departure (K) from the temperature a segment began with below which its resistances need no renewal.
_NEGLIGIBLE = 0.05
_LOOK_AHEAD = 10.0


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


def next_update(
    motor: VirtualMotor, ambient: float, heating: Heating | None, temperature: float, segment: Segment
) -> Segment:
    """Return the segment, cut short where the winding's temperature will have changed its resistances by then."""
    if not segment.live and segment.supply_mode == "off" and segment.dynamometer.kind == "idle":
        return segment
    if isinstance(segment.motion, Rest) and isinstance(segment.circuit, LinearTransient) and segment.circuit.dead:
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
