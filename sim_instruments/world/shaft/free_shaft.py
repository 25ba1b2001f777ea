"""A shaft that nobody holds: it coasts, stands by friction, or swings under current."""

import math
from dataclasses import replace

import numpy as np

from sim_instruments.physics.circuits.crossing import first_rise
from sim_instruments.physics.circuits.transient import LinearTransient
from sim_instruments.physics.circuits.windings import FloatArray
from sim_instruments.physics.closed_loops import BrakedShaft, braked
from sim_instruments.physics.mapped.windings import MappedWindings
from sim_instruments.physics.motion.coasting import BearingDrag, Cogged, CoggingWaves
from sim_instruments.physics.motion.motion import Drag, Motion, Ramp, RestingShaft
from sim_instruments.physics.swing import Shaft, StaticFriction, Swing
from sim_instruments.world.segment import Circuit, DynamometerLaw, Outcome, Segment
from sim_instruments.world.segment_inputs import SegmentInputs

#: Slower than this (rad/s), a shaft without dry friction counts as standing.
_CREEP = 1e-4
#: A swing is integrated at most this far ahead (s).
_HORIZON = 1.0
#: A shaft that friction stops at once has moved for so long (s).
_INSTANT = 1e-9
#: A rotor slower than this (rad/s) under current is stopped by static friction where that can hold it.
_SLOW = 1e-3
#: Torques that change with the speed are found anew after so long (s), and where it has changed by this share.
_AGAIN, _OTHER_SPEED = 0.02, 0.1
#: Sliding friction lies below static friction by this share, so that what breaks away does move.
_SLIP = 1e-3


def drag(
    inputs: SegmentInputs, torque: float, limit: float, current: complex = 0j
) -> tuple[Drag | BearingDrag | Cogged | RestingShaft, float, Outcome]:
    """Return motion under a constant torque (N·m), until it stands still or a speed limit (rad/s) is met, and that end (s).

    Where it feels the waves of its cogging (`Constants.cogging`), it turns as long as it comes over the next one, and then stays where it
    is. `current` (A, d + j·q of the Y-equivalent) is what an inverter impresses, which the iron's loss depends on.
    """
    state, network = inputs.state, inputs.network
    shaft = braked(inputs.constants.coasting_shaft(inputs.settings), network, current)
    speed, cogging = state.speed, inputs.constants.cogging(shaft)
    grip = shaft.static_friction + (0.0 if cogging is None else cogging.torque)
    if abs(speed) <= (0.0 if grip else _CREEP) and abs(torque) <= grip:
        return RestingShaft(state.angle), math.inf, "none"
    way = math.copysign(1.0, speed if speed else torque)
    if not shaft.bearing.plain or isinstance(shaft, BrakedShaft):
        return _dragged(inputs, shaft, cogging, torque, way, limit)
    last = 0.0 if shaft.coulomb_friction or torque * way < 0.0 else _CREEP
    if cogging is not None:
        speed = way * math.sqrt(cogging.mean_square(state.angle, speed))
        last = max(last, cogging.slowest)
        if abs(speed) <= last and abs(torque) <= grip:
            return _at_once(inputs, shaft, torque, way, limit)
    motion = Drag(
        inputs.time, state.angle, speed, torque - way * shaft.coulomb_friction, shaft.inertia, shaft.viscous_friction
    )
    # What is pushed over its first waves is slower than that and does not stop.
    stops = motion.time_of_speed(way * last) if abs(speed) > last else math.inf
    limited = motion.time_of_speed(way * limit) if abs(speed) < limit else math.inf
    moved = motion if cogging is None else Cogged(motion, cogging)
    if stops <= limited:
        return moved, stops, "standstill"
    return moved, limited, "none"


def until_changed(inputs: SegmentInputs, motion: Drag | BearingDrag | Cogged) -> float:
    """Return when (s) torques that hang on the speed of a motion are to be found anew."""
    speed = inputs.state.speed
    bounds = (motion.time_of_speed((1.0 + part) * speed) for part in (-_OTHER_SPEED, _OTHER_SPEED))
    return min(inputs.time + _AGAIN, *bounds)


def mean_speed(inputs: SegmentInputs) -> float:
    """Return the speed (rad/s) at which the shaft turns without the waves of its cogging."""
    cogging, speed = inputs.constants.cogging(inputs.constants.shaft(inputs.settings)), inputs.state.speed
    if cogging is None or speed == 0.0:
        return speed
    return math.copysign(math.sqrt(cogging.mean_square(inputs.state.angle, speed)), speed)


def _at_once(
    inputs: SegmentInputs, shaft: Shaft, torque: float, way: float, limit: float
) -> tuple[BearingDrag, float, Outcome]:
    """Return the motion of a shaft that stops where it is, its end (s) and outcome."""
    mean = BearingDrag(
        inputs.time, inputs.state.angle, 0.0, torque, shaft, way=way, last=-math.inf, limit=limit, horizon=_INSTANT
    )
    return mean, float(np.nextafter(inputs.time, math.inf)), "standstill"


def _dragged(
    inputs: SegmentInputs, shaft: Shaft, cogging: CoggingWaves | None, torque: float, way: float, limit: float
) -> tuple[BearingDrag | Cogged, float, Outcome]:
    """Return motion, end (s) and outcome as `drag` does, for what only integrating finds."""
    state, speed, last = inputs.state, abs(inputs.state.speed), 0.0 if shaft.static_friction else _CREEP
    if cogging is not None:
        speed = math.sqrt(cogging.mean_square(state.angle, speed))
        last = max(last, cogging.slowest)
    if speed <= last and abs(torque) <= shaft.static_friction + (cogging.torque if cogging else 0.0):
        return _at_once(inputs, shaft, torque, way, limit)
    falls = last if speed > last else -math.inf
    mean = BearingDrag(
        inputs.time, state.angle, way * speed, torque, shaft, way=way, last=falls, limit=limit, horizon=_HORIZON
    )
    outcome: Outcome = "standstill" if mean.stopped else "none"
    return (mean if cogging is None else Cogged(mean, cogging)), mean.end, outcome


def coasting(inputs: SegmentInputs, torque: float, law: DynamometerLaw) -> Segment:
    """Return the segment of a shaft under the dynamometer's torque (N·m), or none, with no current from the supply.

    Joined terminals brake it by the mean torque of their currents.
    """
    machine, state = inputs.constants.dynamometer, inputs.state
    shaft = inputs.constants.shaft(inputs.settings)
    limit = machine.maximum_speed if law.kind == "constant" else math.inf
    needed = shaft.friction(limit) if math.isfinite(limit) else math.inf
    at_limit = math.isfinite(limit) and abs(mean_speed(inputs)) >= limit * (1.0 - 1e-9)
    if at_limit and torque * math.copysign(1.0, state.speed) >= needed:
        # The drive's own speed limit takes over from its torque control.
        top: Ramp = Ramp(inputs.time, state.angle, state.speed)
        return _turning(inputs, top, math.inf, DynamometerLaw("balance"))
    motion, end, outcome = drag(inputs, torque, limit)
    if isinstance(motion, RestingShaft):
        circuit, threshold = inputs.standing_circuit()
        return inputs.segment(motion, circuit, threshold, law, live=bool(inputs.network.loops))
    return _turning(inputs, motion, end, law, outcome)


def _turning(
    inputs: SegmentInputs, motion: Motion, end: float, law: DynamometerLaw, outcome: Outcome = "none"
) -> Segment:
    return inputs.segment(
        motion, inputs.turning_circuit(motion), end, law, live=bool(inputs.network.loops), outcome=outcome
    )


def energised(inputs: SegmentInputs, torque: float, law: DynamometerLaw, time: float) -> Segment:
    """Return the segment of a free shaft with the supply in the circuit, `torque` (N·m) from outside included."""
    output, state, windings = inputs.output, inputs.state, inputs.windings
    if output is None:
        raise ValueError("energised(): the supply's output is open; this is a coasting shaft")
    if not inputs.network.drives_current:
        return coasting(inputs, torque, law)
    total = inputs.constants.swinging_shaft(inputs.settings, torque)
    circuit, end = inputs.standing_circuit()
    static = windings.cogging(np.array([state.angle])) + torque

    def push(times: FloatArray) -> FloatArray:
        currents = circuit.winding_currents(times)
        return windings.torque(np.full_like(times, inputs.electrical_angle), currents) + static

    settled = 30.0 / float(circuit.rates.min()) if len(circuit.rates) else 0.0
    now, lasting = push(np.array([time, time + settled])).tolist()
    # One hysteresis for standing and sliding, lest what breaks away stop at once.
    hysteresis = _iron_grip(inputs, circuit, time + settled)
    grip = max(total.static_friction + hysteresis, _rounding(inputs))
    # Against the braking of joined terminals a rotor creeps to its rest without end: static friction ends that.
    creeps = 0.0 < abs(state.speed) <= _SLOW and abs(lasting) <= grip
    if (state.speed == 0.0 or creeps) and not state.breaking_away and abs(now) <= grip:
        until = min(end, output.end)
        breaks = math.inf
        if not (isinstance(circuit, LinearTransient) and circuit.settled):
            constants = np.concatenate([1.0 / circuit.rates, 0.5 / circuit.rates])
            breaks = first_rise(lambda t: np.abs(push(t)) - grip, time, until, constants)
        if breaks < until:
            return inputs.segment(RestingShaft(state.angle), circuit, breaks, law, live=True, outcome="breakaway")
        return inputs.segment(RestingShaft(state.angle), circuit, end, law, live=True)
    dry = (total.coulomb_friction + hysteresis) * (1.0 - _SLIP)
    sliding = Shaft(total.inertia, dry, total.viscous_friction, torque)
    return _swinging(inputs, sliding, 1 if (state.speed or now) > 0.0 else -1, grip, law)


def _swinging(inputs: SegmentInputs, shaft: Shaft, direction: int, grip: float, law: DynamometerLaw) -> Segment:
    output, state = inputs.output, inputs.state
    if output is None:
        raise ValueError("_swinging(): the supply's output is open")
    swing = Swing(
        inputs.network,
        shaft,
        output.source,
        start=inputs.time,
        horizon=min(output.end, inputs.time + _HORIZON),
        angle=state.angle,
        speed=state.speed,
        loops=inputs.loops(),
        direction=direction,
        thresholds=output.thresholds,
        grip=StaticFriction(grip, _SLOW),
    )
    outcome: Outcome = "standstill" if swing.ending == "standstill" else "none"
    if swing.ending == "horizon" and output.end <= swing.end and output.trips_voltage:
        outcome = "trip voltage"
    segment = inputs.segment(swing, swing, swing.end, law, live=True, outcome=outcome)
    return replace(segment, reversals=swing.reversals)


def _iron_grip(inputs: SegmentInputs, circuit: Circuit, time: float) -> float:
    """Return the torque (N·m) with which the iron's hysteresis holds a rotor that stands, at the currents of a time (s)."""
    windings = inputs.windings
    if not isinstance(windings, MappedWindings) or not windings.motor.iron.hysteresis_loss:
        return 0.0
    loss = windings.iron_loss(
        np.array([inputs.electrical_angle]), circuit.winding_currents(np.array([time])), np.full(1, 1e-9)
    )
    return float(loss[0]) / 1e-9 * windings.pole_pairs


def _rounding(inputs: SegmentInputs) -> float:
    """Return a torque (N·m) too small to matter: where a motor without dry friction counts as having arrived."""
    current = float(np.abs(inputs.state.winding_currents).max())
    return 1e-4 * 1.5 * inputs.windings.pole_pairs * inputs.windings.flux_linkage * current
