"""The shaft and the currents while the inverter is on."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from sim_instruments.physics.circuits.windings import FloatArray
from sim_instruments.physics.closed_loops import braked
from sim_instruments.physics.field import ImpressedField, Synchronous, q_current_within
from sim_instruments.physics.mapped.field import MappedSynchronous
from sim_instruments.physics.mapped.windings import MappedWindings
from sim_instruments.physics.motion.motion import Motion, Ramp, RestingShaft
from sim_instruments.world.segment import DynamometerLaw, FieldState, Outcome, Segment
from sim_instruments.world.segment_inputs import SegmentInputs
from sim_instruments.world.shaft.free_shaft import drag, mean_speed, until_changed
from sim_instruments.world.sources import rotor_current_drive


def imposed(inputs: SegmentInputs, motion: Motion, end: float, law: DynamometerLaw, direction: int) -> Segment:
    """Return the segment of a shaft that something else holds or turns.

    A rotating field cannot take such a shaft along: it is out of step.
    """
    if _in_rotor_frame(inputs):
        return rotor_current_drive.imposed(inputs, motion, end, law, direction)
    if inputs.settings.inverter.mode == "current":
        return _segment(inputs, motion, None, _q_current(inputs, motion, direction), end, law)
    state = inputs.state.field or FieldState(inputs.electrical_angle - inputs.windings.phase_shift, 0.0, False)
    field, field_end = _field(inputs, state, direction)
    return _segment(inputs, motion, field, _slipping(inputs, field), min(end, field_end), law, in_step=False)


def free(inputs: SegmentInputs, torque: float, law: DynamometerLaw, direction: int) -> Segment:
    """Return the segment of a free shaft, with the dynamometer's torque (N·m) on it where that is on."""
    if _in_rotor_frame(inputs):
        return rotor_current_drive.free(inputs, torque, law, direction)
    if inputs.settings.inverter.mode == "current":
        return _regulated(inputs, torque, law, direction)
    return _rotating_field(inputs, torque, law, direction)


def _in_rotor_frame(inputs: SegmentInputs) -> bool:
    """Say whether the currents are found in the rotor's coordinates: regulated there, or a q current of a motor on a flux map."""
    mode = inputs.settings.inverter.mode
    return mode == "dq" or (mode == "current" and isinstance(inputs.windings, MappedWindings))


def _segment(
    inputs: SegmentInputs,
    motion: Motion,
    field: Motion | None,
    amplitude: Callable[[FloatArray], FloatArray],
    end: float,
    law: DynamometerLaw,
    *,
    in_step: bool = True,
) -> Segment:
    stage = inputs.constants.inverter
    circuit = ImpressedField(
        inputs.network,
        motion,
        field,
        amplitude,
        ripple=stage.current_ripple,
        switching_frequency=stage.switching_frequency,
        source=inputs.open_source(),
    )
    return inputs.segment(motion, circuit, end, law, live=True, in_step=in_step)


# Open-loop rotating field


def _synchronous(inputs: SegmentInputs) -> Synchronous:
    motor, windings = inputs.constants.motor, inputs.windings
    if isinstance(windings, MappedWindings):
        return MappedSynchronous(windings, inputs.settings.inverter.amplitude)
    return Synchronous(
        windings.resistance_y,
        motor.d_axis_inductance_y,
        motor.q_axis_inductance_y,
        windings.flux_linkage_y,
        motor.pole_pairs,
        inputs.settings.inverter.amplitude,
    )


def _field(inputs: SegmentInputs, state: FieldState, direction: int) -> tuple[Ramp, float]:
    """Return the field's rotation (electrical, in the motor's coordinates) and the end of its ramp (s)."""
    target = 2.0 * math.pi * inputs.settings.field_frequency * direction
    rate = 2.0 * math.pi * inputs.constants.inverter.frequency_ramp
    change = target - state.speed
    if abs(change) <= 1e-9 * max(abs(target), 1.0):
        return Ramp(inputs.time, state.angle, target), math.inf
    stop = 0.0 if state.speed * target < 0.0 else target
    end = max(inputs.time + abs(stop - state.speed) / rate, float(np.nextafter(inputs.time, math.inf)))
    return Ramp(inputs.time, state.angle, state.speed, math.copysign(rate, change)), end


def _slipping(inputs: SegmentInputs, field: Motion) -> Callable[[FloatArray], FloatArray]:
    """Return the amplitude that the DC link can drive through the impedance of a rotor that does not follow."""
    motor, limit = inputs.constants.motor, inputs.constants.inverter.maximum_phase_voltage
    resistance, wanted = inputs.windings.resistance_y, inputs.settings.inverter.amplitude
    inductance = 0.5 * (motor.d_axis_inductance_y + motor.q_axis_inductance_y)

    def amplitude(times: FloatArray) -> FloatArray:
        return np.minimum(wanted, limit / np.hypot(resistance, field.speed(times) * inductance))

    return amplitude


def _rotating_field(inputs: SegmentInputs, torque: float, law: DynamometerLaw, direction: int) -> Segment:
    """Let the rotor follow the field from its present speed on, as long as torque and voltage suffice.

    The pull-in swing at the start is left out: the field begins at the load angle of the speed it is going to.
    """
    windings, motor, state = inputs.windings, inputs.constants.motor, inputs.state
    synchronous = _synchronous(inputs)
    electrical = state.speed * motor.pole_pairs
    field_state = state.field or FieldState(0.0, electrical, True)
    if field_state.in_step:
        target = 2.0 * math.pi * inputs.settings.field_frequency * direction
        lead = synchronous.load_angle(_load(inputs, torque, target, 0.0))
        start = FieldState(inputs.electrical_angle - windings.phase_shift + lead, electrical, True)
        field, end = _field(inputs, start, direction)
        lost = _loses_step(inputs, synchronous, torque, field, end)
        if lost > inputs.time:
            rotor = Ramp(inputs.time, state.angle, state.speed, field.rate / motor.pole_pairs)
            motion: Motion = rotor if field.start_speed or field.rate else RestingShaft(state.angle)
            wanted = inputs.settings.inverter.amplitude
            segment = _segment(inputs, motion, field, lambda t: np.full_like(t, wanted), min(end, lost), law)
            return _lost_at(segment, lost)
        field_state = FieldState(start.angle, start.speed, False)
    field, field_end = _field(inputs, field_state, direction)
    motion, stops, outcome = drag(inputs, torque, math.inf)
    segment = _segment(inputs, motion, field, _slipping(inputs, field), min(stops, field_end), law, in_step=False)
    return _with_outcome(segment, outcome) if segment.end == stops else segment


def _load(inputs: SegmentInputs, torque: float, electrical_speed: float, rate: float) -> float:
    """Return the torque (N·m, signed) that the field must make at an electrical speed (rad/s) and its rate (rad/s²)."""
    p, amplitude = inputs.windings.pole_pairs, inputs.settings.inverter.amplitude
    # Lightly loaded, the currents lie along the magnets.
    shaft = braked(inputs.constants.shaft(inputs.settings), inputs.network, complex(amplitude))
    speed = electrical_speed / p
    return shaft.friction(speed) + shaft.inertia * rate / p - torque


def _loses_step(inputs: SegmentInputs, synchronous: Synchronous, torque: float, field: Ramp, end: float) -> float:
    """Return when (s) torque or voltage no longer suffice; infinite where they do throughout."""
    limit = inputs.constants.inverter.maximum_phase_voltage

    def margin(time: float) -> float:
        speed = field.start_speed + field.rate * (time - inputs.time)
        load = _load(inputs, torque, speed, field.rate)
        left = 1.0 - abs(load) / max(synchronous.pull_out_torque, 1e-12)
        return min(left, 1.0 - synchronous.voltage(speed, load) / limit)

    if math.isinf(end):
        return math.inf if margin(inputs.time) >= 0.0 else inputs.time
    times = np.linspace(inputs.time, end, 65)
    margins = [margin(float(t)) for t in times]
    if margins[0] < 0.0:
        return inputs.time
    for index, value in enumerate(margins):
        if value < 0.0:
            return float(brentq(margin, times[index - 1], times[index], xtol=1e-12))
    return math.inf


def _lost_at(segment: Segment, lost: float) -> Segment:
    return _with_outcome(segment, "lost step") if segment.end == lost else segment


# Regulated q-axis current


def _wanted_current(inputs: SegmentInputs) -> float:
    """Return the q-axis current (A, signed) that the drive regulates to, three times the command where it runs away."""
    current = inputs.settings.inverter.q_current
    if inputs.settings.faults.inverter_runaway is None:
        return current
    most = inputs.constants.inverter.maximum_current
    return min(max(3.0 * current, -most), most)


def _limits(inputs: SegmentInputs) -> tuple[float, float, float, float]:
    motor, windings = inputs.constants.motor, inputs.windings
    return (
        inputs.constants.inverter.maximum_phase_voltage,
        windings.resistance_y,
        motor.q_axis_inductance_y,
        windings.flux_linkage_y,
    )


def _q_current(inputs: SegmentInputs, motion: Motion, direction: int) -> Callable[[FloatArray], FloatArray]:
    """Return the commanded q-axis current as far as the DC link drives it at the present speed."""
    voltage, resistance, inductance, flux = _limits(inputs)
    wanted, p = direction * _wanted_current(inputs), inputs.windings.pole_pairs

    def current(times: FloatArray) -> FloatArray:
        return q_current_within(
            wanted,
            motion.speed(times) * p,
            voltage=voltage,
            resistance=resistance,
            inductance=inductance,
            flux_linkage=flux,
        )

    return current


def _voltage_limited_speed(inputs: SegmentInputs, current: float) -> float:
    """Return the largest mechanical speed (rad/s) at which a motoring q-axis current (A) still flows in full."""
    voltage, resistance, inductance, flux = _limits(inputs)
    size = abs(current)
    a = flux**2 + (inductance * size) ** 2
    half_b = resistance * size * flux
    discriminant = half_b**2 - a * ((resistance * size) ** 2 - voltage**2)
    return max(0.0, (-half_b + math.sqrt(max(discriminant, 0.0))) / a) / inputs.windings.pole_pairs


def _regulated(inputs: SegmentInputs, torque: float, law: DynamometerLaw, direction: int) -> Segment:
    """Constant torque up to the speed where the voltage runs out; the drive then holds that speed."""
    constant = 1.5 * inputs.windings.pole_pairs * inputs.windings.flux_linkage_y
    wanted = direction * _wanted_current(inputs)
    speed = mean_speed(inputs)
    shaft = braked(inputs.constants.shaft(inputs.settings), inputs.network)
    limit = _voltage_limited_speed(inputs, wanted)
    needed = shaft.friction(speed) - torque
    if wanted * speed >= 0.0 and abs(speed) > limit * (1.0 + 1e-9):
        # As it does a shaft that is held, what current flows then brakes it.
        course = _q_current(inputs, Ramp(inputs.time, inputs.state.angle, speed), direction)
        flowing = float(course(np.array([inputs.time]))[0])
        motion, end, outcome = drag(inputs, torque + constant * flowing, math.inf)
        if not isinstance(motion, RestingShaft):
            due = min(until_changed(inputs, motion), motion.time_of_speed(math.copysign(limit, speed)))
            segment = _segment(inputs, motion, None, lambda t: np.full_like(t, flowing), min(end, due), law)
            return _with_outcome(segment, outcome) if segment.end == end else segment
    if wanted * speed > 0.0 and abs(speed) >= limit * (1.0 - 1e-9):
        share = needed / constant
        if 0.0 <= share * math.copysign(1.0, wanted) <= abs(wanted):
            held = Ramp(inputs.time, inputs.state.angle, speed)
            return _segment(inputs, held, None, lambda t: np.full_like(t, share), math.inf, law)
    motion, end, outcome = drag(inputs, torque + constant * wanted, limit if wanted else math.inf)
    segment = _segment(inputs, motion, None, lambda t: np.full_like(t, wanted), end, law)
    return _with_outcome(segment, outcome) if segment.end == end and not math.isinf(end) else segment


def _with_outcome(segment: Segment, outcome: Outcome) -> Segment:
    return replace(segment, outcome=outcome)
