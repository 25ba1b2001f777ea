"""The shaft and the currents while the inverter regulates d and q current at the rotor's own angle."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from sim_instruments.physics.circuits.current_step import CurrentStep
from sim_instruments.physics.circuits.rotor_frame import RotorFrame
from sim_instruments.physics.circuits.windings import ComplexArray, FloatArray
from sim_instruments.physics.closed_loops import braked
from sim_instruments.physics.field import RotorField
from sim_instruments.physics.motion.motion import Motion, Ramp, RestingShaft, Wavering
from sim_instruments.physics.motion.traced import Traced
from sim_instruments.world.segment import DynamometerLaw, Outcome, Segment
from sim_instruments.world.segment_inputs import SegmentInputs
from sim_instruments.world.shaft.free_shaft import drag, mean_speed, until_changed

#: The q current that gives way is looked for among those up to so many times the stage's largest.
_REACH = 4.0
#: A runaway inverter lets so many times the commanded current flow.
_RUNAWAY = 3.0
#: Share of the largest voltage below which nothing limits the currents.
_IN_RESERVE = 0.99
#: Speeds at which limited currents are solved where the shaft's speed wavers little.
_NODES = 9
#: A speed wavers little where it does so by less than this share.
_STEADY = 1.0e-2
#: Currents within this share of the stage's largest of what is wanted are there, and pieces that a step of theirs is integrated in.
_THERE, _PIECES = 1.0e-6, 96
_PHASES = np.arange(3) * (2.0 * math.pi / 3.0)
#: Within this share of it (of 1 rad/s at least) a held speed is reached.
_CLOSE = 1.0e-6


def imposed(inputs: SegmentInputs, motion: Motion, end: float, law: DynamometerLaw, direction: int) -> Segment:
    """Return the segment of a shaft that something else holds or turns."""
    frame, wanted = rotor_frame(inputs), _wanted(inputs, direction)
    held = _held_speed(inputs, direction)
    if held is None and isinstance(motion, RestingShaft) and (step := _step(inputs, frame, wanted)) is not None:
        return _stepped(inputs, motion, step, frame, min(end, step.end), law)
    if held is None and isinstance(motion, RestingShaft | Wavering) and _fits(inputs, frame, wanted, motion):
        return _constant(inputs, motion, wanted, frame, False, end, law)
    if held is None and (isinstance(motion, RestingShaft) or (isinstance(motion, Wavering) and motion.depth < _STEADY)):
        found = _limited_at(inputs, frame, wanted, motion)
        return _segment(inputs, motion, lambda t: found(t)[0], frame, lambda t: found(t)[1], end, law)
    # Currents, voltages and whether they are limited are asked for one after the other, at the same times.
    last: list[tuple[FloatArray, tuple[ComplexArray, FloatArray]]] = []

    def within(times: FloatArray) -> tuple[ComplexArray, FloatArray]:
        if not last or last[0][0] is not times:
            last[:] = [(times, _at_speeds(inputs, frame, wanted, motion.speed(times), held))]
        return last[0][1]

    return _segment(inputs, motion, lambda t: within(t)[0], frame, lambda t: within(t)[1], end, law)


def _limited_at(
    inputs: SegmentInputs, frame: RotorFrame, wanted: complex, motion: RestingShaft | Wavering
) -> Callable[[FloatArray], tuple[ComplexArray, FloatArray]]:
    """Return the currents (A) over time and where (1.0) the voltage limits them, solved once at a few speeds near the one that is held."""
    speeds = _speeds(motion, _NODES)
    currents, limited = _within(inputs, frame, wanted, speeds)

    def at(times: FloatArray) -> tuple[ComplexArray, FloatArray]:
        speed = motion.speed(times)
        parts = (np.interp(speed, speeds, part) for part in (currents.real, currents.imag, limited))
        direct, quadrature, share = parts
        return np.asarray(direct + 1j * quadrature, dtype=np.complex128), (share > 0.0).astype(np.float64)

    return at


def _speeds(motion: RestingShaft | Wavering, count: int) -> FloatArray:
    """Return so many rising speeds (rad/s) of a held shaft, the outmost ones that it comes to among them."""
    if isinstance(motion, RestingShaft):
        return np.zeros(1)
    around = np.linspace(-1.0, 1.0, count) * abs(motion.mean_speed * motion.depth)
    return np.unique(motion.mean_speed + around)


def _at_speeds(
    inputs: SegmentInputs, frame: RotorFrame, wanted: complex, speed: FloatArray, held: float | None
) -> tuple[ComplexArray, FloatArray]:
    """Return the currents (A) at speeds (rad/s) that something else gives, and where (1.0) the voltage limits them."""
    if held is None:
        return _within(inputs, frame, wanted, speed)
    # The regulator pushes as far as it may, either way, and not at all where there is nothing to correct.
    wanting = [_within(inputs, frame, complex(wanted.real, way * abs(wanted.imag)), speed) for way in (-1, 0, 1)]
    missing = held - speed
    which = np.where(np.abs(missing) <= _CLOSE * max(abs(held), 1.0), 0.0, np.sign(missing)).astype(int) + 1
    found = [np.choose(which, [one[part] for one in wanting]) for part in (0, 1)]
    return found[0].astype(np.complex128), found[1].astype(np.float64)


def free(inputs: SegmentInputs, torque: float, law: DynamometerLaw, direction: int) -> Segment:
    """Return the segment of a free shaft, with the dynamometer's torque (N·m) on it where that is on.

    Its torque is constant up to the speed at which the voltage runs out; the drive then holds that speed.
    """
    frame, wanted = rotor_frame(inputs), _wanted(inputs, direction)
    held = _held_speed(inputs, direction)
    if held is not None:
        return _to_speed(inputs, torque, law, frame, complex(wanted.real, abs(wanted.imag)), held)
    if (step := _step(inputs, frame, wanted)) is not None:
        return _stepping(inputs, torque, law, frame, step)
    pushing, speed = _torque(inputs, wanted), mean_speed(inputs)
    shaft = braked(inputs.constants.shaft(inputs.settings), inputs.network, wanted)
    way = math.copysign(1.0, pushing or speed)
    limit = _limit_speed(inputs, frame, wanted, way)
    if pushing * speed >= 0.0 and abs(speed) > limit * (1.0 + 1e-9):
        return _beyond_voltage(inputs, torque, law, frame, wanted, way * limit)
    if pushing * speed > 0.0 and abs(speed) >= limit * (1.0 - 1e-9):
        needed = way * (shaft.friction(abs(speed))) - torque
        if 0.0 <= needed * way <= abs(pushing):
            enough = _current_for(inputs, wanted, needed, 0.0)
            return _constant(inputs, Ramp(inputs.time, inputs.state.angle, speed), enough, frame, True, math.inf, law)
    motion, end, outcome = drag(inputs, torque + pushing, limit if pushing else math.inf, wanted)
    segment = _constant(inputs, motion, wanted, frame, False, end, law)
    return _with_outcome(segment, outcome) if segment.end == end and not math.isinf(end) else segment


def _beyond_voltage(
    inputs: SegmentInputs, torque: float, law: DynamometerLaw, frame: RotorFrame, wanted: complex, limit: float
) -> Segment:
    """Return the segment of a free shaft that is faster than the voltage allows, down to `limit` (rad/s): what currents flow then
    brake it, as they do a shaft that is held.
    """
    speed = mean_speed(inputs)
    flowing = complex(_within(inputs, frame, wanted, np.array([speed]))[0][0])
    motion, end, outcome = drag(inputs, torque + _torque(inputs, flowing), math.inf, flowing)
    if isinstance(motion, RestingShaft):
        return _constant(inputs, motion, flowing, frame, True, end, law)
    due = min(until_changed(inputs, motion), motion.time_of_speed(limit))
    segment = _constant(inputs, motion, flowing, frame, True, min(end, due), law)
    return _with_outcome(segment, outcome) if segment.end == end else segment


def _step(inputs: SegmentInputs, frame: RotorFrame, wanted: complex) -> CurrentStep | None:
    """Return the step that the currents have yet to make; None where they flow, are limited, or are there at once."""
    settings, stage = inputs.settings.inverter, inputs.constants.inverter
    if not settings.bandwidth:
        return None
    speed = inputs.state.speed * inputs.windings.pole_pairs
    if (
        float(np.abs(frame.voltage(np.array([wanted]), np.array([speed])))[0])
        >= _IN_RESERVE * stage.maximum_phase_voltage
    ):
        return None
    angle = inputs.electrical_angle - inputs.windings.phase_shift
    terminals = inputs.network.terminal_currents(inputs.state.winding_currents[:, np.newaxis])[:, 0]
    flowing = complex(terminals @ np.exp(1j * _PHASES)) * (2.0 / 3.0) * complex(np.exp(-1j * angle))
    if settings.mode == "dq":
        flowing -= settings.current_offset * complex(np.exp(-1j * angle))
    if abs(wanted - flowing) <= _THERE * stage.maximum_current:
        return None
    return CurrentStep.within(
        frame,
        inputs.time,
        flowing,
        wanted,
        bandwidth=settings.bandwidth,
        speed=speed,
        limit=stage.maximum_phase_voltage,
    )


def _stepping(
    inputs: SegmentInputs, torque: float, law: DynamometerLaw, frame: RotorFrame, step: CurrentStep
) -> Segment:
    """Return the segment of a free shaft while the currents make their step, until it is made or the shaft turns back."""
    windings, state = inputs.windings, inputs.state
    shaft = inputs.constants.shaft(inputs.settings)

    def pull(times: FloatArray) -> FloatArray:
        currents = step.currents(times)
        flux = windings.flux_linkages_y(currents, np.zeros(len(times)))
        return 1.5 * windings.pole_pairs * np.imag(np.conj(flux) * currents) + torque

    # Close at first: that is where the currents change.
    times = step.start + (step.end - step.start) * np.linspace(0.0, 1.0, _PIECES + 1) ** 2
    if state.speed == 0.0:
        breaks = np.flatnonzero(np.abs(pull(times)) > shaft.static_friction)
        if not breaks.size or breaks[0] > 0:
            end = step.end if not breaks.size else float(times[breaks[0]])
            return _stepped(inputs, RestingShaft(state.angle), step, frame, end, law)
    motion = Traced.under(pull, shaft, times, state.angle, state.speed)
    end = float(motion.times[-1]) if motion.reversed else step.end
    segment = _stepped(inputs, motion, step, frame, end, law)
    return _with_outcome(segment, "standstill") if motion.reversed and segment.end == end else segment


def _to_speed(
    inputs: SegmentInputs, torque: float, law: DynamometerLaw, frame: RotorFrame, most: complex, held: float
) -> Segment:
    """Return the segment of a free shaft that is brought to a speed (rad/s) with a torque of up to that of `most` (A), and held there."""
    state, strength = inputs.state, abs(_torque(inputs, most))
    shaft = braked(inputs.constants.shaft(inputs.settings), inputs.network, most)
    speed = mean_speed(inputs)
    way = math.copysign(1.0, held - speed)
    reachable = _limit_speed(inputs, frame, most, math.copysign(1.0, held))
    held = min(max(held, -reachable), reachable)
    if abs(speed - held) <= _CLOSE * max(abs(held), 1.0):
        needed = math.copysign(shaft.friction(abs(held)), held) - torque if held else -torque
        if not held and abs(torque) <= shaft.static_friction:
            needed = 0.0
        if abs(needed) <= strength:
            motion: Motion = Ramp(inputs.time, state.angle, held) if held else RestingShaft(state.angle)
            enough = _current_for(inputs, most, needed, -1.0)
            return _constant(inputs, motion, enough, frame, False, math.inf, law)
        way = math.copysign(1.0, needed)
    current = complex(most.real, way * most.imag)
    moved, end, outcome = drag(inputs, torque + way * strength, math.inf, current)
    if isinstance(moved, RestingShaft):
        return _constant(inputs, moved, current, frame, False, end, law)
    comes = moved.time_of_speed(held)
    segment = _constant(inputs, moved, current, frame, False, min(end, comes), law)
    return _with_outcome(segment, outcome) if segment.end == end and not math.isinf(end) else segment


def _held_speed(inputs: SegmentInputs, direction: int) -> float | None:
    held = inputs.settings.inverter.held_speed
    return None if held is None else direction * held


def rotor_frame(inputs: SegmentInputs) -> RotorFrame:
    """Return the motor at its present temperature in its rotor's coordinates, behind leads and bridge."""
    windings = inputs.windings
    return RotorFrame(
        windings.resistance_y + float(inputs.network.wire_resistances.mean()),
        windings.flux_linkages_y,
        inputs.constants.inverter.bridge_error,
    )


def _wanted(inputs: SegmentInputs, direction: int) -> complex:
    """Return the currents (A, d + j·q) that are regulated to; q drives backwards where two wires have changed places."""
    inverter = inputs.settings.inverter
    wanted = inverter.dq_current if inverter.mode == "dq" else complex(0.0, inverter.q_current)
    if inputs.settings.faults.inverter_runaway is not None:
        size, most = abs(wanted), inputs.constants.inverter.maximum_current
        wanted = wanted * (min(_RUNAWAY * size, most) / size) if size else wanted
    return complex(wanted.real, direction * wanted.imag)


def _fits(inputs: SegmentInputs, frame: RotorFrame, wanted: complex, motion: RestingShaft | Wavering) -> bool:
    """Tell whether the currents flow in full all the time, with something in reserve: |u| is largest at one of the outmost speeds."""
    speeds = _speeds(motion, 2)
    taken = np.abs(frame.voltage(np.full(speeds.shape, wanted), speeds * inputs.windings.pole_pairs))
    return bool(np.all(taken < _IN_RESERVE * inputs.constants.inverter.maximum_phase_voltage))


def _within(
    inputs: SegmentInputs, frame: RotorFrame, wanted: complex, speed: FloatArray
) -> tuple[ComplexArray, FloatArray]:
    stage = inputs.constants.inverter
    electrical = speed * inputs.windings.pole_pairs
    return frame.within(wanted, electrical, stage.maximum_phase_voltage, _REACH * stage.maximum_current)


def _torque(inputs: SegmentInputs, current: complex) -> float:
    """Return the torque (N·m) of currents (A) in the rotor's coordinates."""
    windings = inputs.windings
    flux = windings.flux_linkages_y(np.array([current]), np.zeros(1))[0]
    return float(1.5 * windings.pole_pairs * (np.conj(flux) * current).imag)


def _limit_speed(inputs: SegmentInputs, frame: RotorFrame, wanted: complex, way: float) -> float:
    """Return the largest mechanical speed (rad/s) in a direction at which the currents still flow in full, 0 where at none."""
    voltage = inputs.constants.inverter.maximum_phase_voltage

    def excess(speed: float) -> float:
        electrical = np.array([way * speed * inputs.windings.pole_pairs])
        return float(np.abs(frame.voltage(np.array([wanted]), electrical))[0]) - voltage

    if excess(0.0) >= 0.0:
        return 0.0
    top = voltage / max(abs(frame.flux(np.array([0j]), np.zeros(1))[0]), 1e-12) / inputs.windings.pole_pairs
    for _ in range(20):
        if excess(top) > 0.0:
            return float(brentq(excess, 0.0, top, xtol=1e-9))
        top *= 2.0
    return math.inf


def _current_for(inputs: SegmentInputs, most: complex, torque: float, least: float) -> complex:
    """Return the currents with the d current of `most` that make a torque (N·m) no larger than its own.

    The q current is a share of that of `most`, from `least` to 1.
    """

    def excess(share: float) -> float:
        return _torque(inputs, complex(most.real, share * most.imag)) - torque

    low, high = excess(least), excess(1.0)
    nearest = least if abs(low) < abs(high) else 1.0
    share = float(brentq(excess, least, 1.0, xtol=1e-12)) if low * high < 0.0 else nearest
    return complex(most.real, share * most.imag)


def _constant(
    inputs: SegmentInputs,
    motion: Motion,
    current: complex,
    frame: RotorFrame,
    limited: bool,
    end: float,
    law: DynamometerLaw,
) -> Segment:
    return _segment(
        inputs,
        motion,
        lambda t: np.full(len(t), current, dtype=np.complex128),
        frame,
        lambda t: np.full(len(t), float(limited)),
        end,
        law,
    )


def _stepped(
    inputs: SegmentInputs, motion: Motion, step: CurrentStep, frame: RotorFrame, end: float, law: DynamometerLaw
) -> Segment:
    return _segment(inputs, motion, step.currents, frame, np.zeros_like, end, law, slopes=step.slopes)


def _segment(
    inputs: SegmentInputs,
    motion: Motion,
    currents: Callable[[FloatArray], ComplexArray],
    frame: RotorFrame,
    limited: Callable[[FloatArray], FloatArray],
    end: float,
    law: DynamometerLaw,
    slopes: Callable[[FloatArray], ComplexArray] | None = None,
) -> Segment:
    stage = inputs.constants.inverter
    circuit = RotorField(
        inputs.network,
        motion,
        currents,
        frame,
        limited=limited,
        slopes=slopes,
        offset=inputs.settings.inverter.current_offset if inputs.settings.inverter.mode == "dq" else 0j,
        ripple=stage.current_ripple,
        switching_frequency=stage.switching_frequency,
        source=inputs.open_source(),
    )
    return inputs.segment(motion, circuit, end, law, live=True)


def _with_outcome(segment: Segment, outcome: Outcome) -> Segment:
    return replace(segment, outcome=outcome)
