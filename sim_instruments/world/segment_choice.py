"""The choice of the laws that hold next, from the bench's settings and the present state to a segment."""

import math
from dataclasses import replace

import numpy as np

from sim_instruments.physics.circuits.network import Network
from sim_instruments.physics.circuits.source import CurrentSource
from sim_instruments.physics.mapped.rotation import MappedRotation
from sim_instruments.physics.motion.motion import Motion, RestingShaft, Wavering
from sim_instruments.physics.rotating import Rotating
from sim_instruments.world import clamps
from sim_instruments.world.constants import Constants
from sim_instruments.world.segment import DynamometerLaw, Outcome, Segment, State
from sim_instruments.world.segment_inputs import SegmentInputs, dynamometer_ramp
from sim_instruments.world.settings import SupplySettings, WorldSettings
from sim_instruments.world.shaft import free_shaft
from sim_instruments.world.shaft.torque_limit import torque_beyond, until_speed
from sim_instruments.world.sources import inverter_drive, six_step_drive
from sim_instruments.world.sources.supply_regime import Regime, is_open, over_voltage, regime
from sim_instruments.world.thermal import next_update

#: Rate (rad/s) at which a hand's speed wavers.
_HAND_RATE = 2.0 * math.pi * 0.7


def plan(constants: Constants, settings: WorldSettings, state: State, time: float) -> Segment:
    """Return the segment that starts at `time` (s) from a state.

    What a protection does at once (a trip, a fault of the inverter or the six-step drive) is written into the settings first.
    """
    if over_voltage(settings.supply, state.source_voltage):
        settings.supply.tripped, settings.supply.on = "voltage", False
    direction = constants.inverter_direction(settings) if settings.inverter.enabled else 0
    if settings.inverter.enabled and direction == 0:
        settings.inverter.enabled, settings.inverter.fault = False, "output phase missing"
    output, network = _supplied(constants, settings, state, time)
    inputs = SegmentInputs(constants, settings, state, time, network.windings, network, output)
    try:
        segment = _with_shaft(inputs, direction)
    except six_step_drive.DriveTripError as trip:
        settings.six_step.enabled, settings.six_step.fault = False, trip.fault
        segment = _with_shaft(inputs, direction)
    segment = _with_over_current(settings.supply, state, segment)
    segment = clamps.next_update(constants.contacts, state.contact_warmth, segment)
    return next_update(
        constants.motor,
        settings.ambient_temperature,
        settings.faults.heating,
        state.temperature,
        state.magnet_temperature,
        segment,
    )


def _supplied(
    constants: Constants, settings: WorldSettings, state: State, time: float
) -> tuple[Regime | None, Network]:
    """Return what the supply's output does, None where it is open, and the circuit that it is or is not part of."""
    carried = {"eddy_currents": state.eddy_currents, "contact_warmth": state.contact_warmth}
    # What turns the shaft outlasts the output's fall by far.
    falls_unseen = not settings.supply.on and _turned_from_outside(settings)
    if not (falls_unseen or is_open(settings.supply, state)):
        windings = constants.windings(settings, state.temperature, state.magnet_temperature, supplied=True)
        supplied = constants.network(windings, settings, supplied=True, **carried)
        output = regime(settings.supply, settings.supply_limit, constants.supply, state, supplied, time)
        if output is not None:
            return output, supplied
    windings = constants.windings(settings, state.temperature, state.magnet_temperature, supplied=False)
    return None, constants.network(windings, settings, supplied=False, **carried)


def _with_shaft(inputs: SegmentInputs, direction: int) -> Segment:
    """Choose the law of the shaft, and with it that of the circuit."""
    settings, state = inputs.settings, inputs.state
    driven = settings.shaft.coupled and settings.dynamometer.enabled
    speed_mode = driven and settings.dynamometer_mode == "speed"
    if settings.rotor_held:
        law = DynamometerLaw()
        if driven:
            limit = inputs.constants.dynamometer.maximum_torque
            command = settings.dynamometer_target
            law = DynamometerLaw("constant", math.copysign(limit, command) if speed_mode and command else 0.0)
            if not speed_mode:
                law = DynamometerLaw("constant", command)
        if settings.inverter.enabled:
            return inverter_drive.imposed(inputs, RestingShaft(state.angle), math.inf, law, direction)
        if settings.six_step.enabled:
            return six_step_drive.imposed(inputs, RestingShaft(state.angle), math.inf, law)
        return resting(inputs, law)
    if settings.shaft.holder in ("turning", "pulling"):
        motion, end = _hand(inputs)
        outcome: Outcome = "let go" if settings.shaft.holder == "pulling" else "none"
        if settings.inverter.enabled:
            segment = inverter_drive.imposed(inputs, motion, end, DynamometerLaw(), direction)
        elif settings.six_step.enabled:
            segment = six_step_drive.imposed(inputs, motion, end, DynamometerLaw())
        else:
            segment = turning(inputs, motion, end, DynamometerLaw())
        return replace(segment, outcome=outcome) if segment.end == end else segment
    if speed_mode:
        held = _held_to_speed(inputs, direction)
        beyond = torque_beyond(held, inputs.constants.dynamometer.maximum_torque)
        if not beyond:
            return held
        limited = _free(inputs, beyond, DynamometerLaw("constant", beyond), direction)
        return until_speed(limited, settings.dynamometer_target)
    torque = settings.dynamometer_target if driven else 0.0
    return _free(inputs, torque, DynamometerLaw("constant", torque) if driven else DynamometerLaw(), direction)


def _held_to_speed(inputs: SegmentInputs, direction: int) -> Segment:
    """Return the segment of a shaft that the dynamometer holds to its speed or brings there, whatever that takes."""
    settings, law = inputs.settings, DynamometerLaw("balance")
    motion, end = dynamometer_ramp(inputs)
    if settings.inverter.enabled:
        return inverter_drive.imposed(inputs, motion, end, law, direction)
    if settings.six_step.enabled:
        return six_step_drive.imposed(inputs, motion, end, law)
    if isinstance(motion, RestingShaft):
        return resting(inputs, law)
    return turning(inputs, motion, end, law)


def _free(inputs: SegmentInputs, torque: float, law: DynamometerLaw, direction: int) -> Segment:
    """Return the segment of a shaft that the dynamometer pushes with a torque (N·m), or not at all."""
    settings = inputs.settings
    if settings.inverter.enabled:
        return inverter_drive.free(inputs, torque, law, direction)
    if settings.six_step.enabled:
        return six_step_drive.free(inputs, torque, law)
    if inputs.output is None:
        return free_shaft.coasting(inputs, torque, law)
    return free_shaft.energised(inputs, torque, law, inputs.time)


def resting(inputs: SegmentInputs, law: DynamometerLaw) -> Segment:
    """Return the segment of a shaft that something holds."""
    state = inputs.state
    circuit, end = inputs.standing_circuit()
    return inputs.segment(RestingShaft(state.angle), circuit, end, law, live=bool(inputs.network.loops))


def turning(inputs: SegmentInputs, motion: Motion, end: float, law: DynamometerLaw) -> Segment:
    """Return the segment of a shaft that is turned from outside."""
    circuit = inputs.turning_circuit(motion)
    segment = inputs.segment(motion, circuit, end, law, live=bool(inputs.network.loops))
    if isinstance(circuit, Rotating | MappedRotation) and isinstance(circuit.source, CurrentSource):
        return replace(segment, supply_mode="cc")
    return replace(segment, supply_mode="cv") if segment.supply_mode == "cc" else segment


def _turned_from_outside(settings: WorldSettings) -> bool:
    drive = settings.dynamometer
    by_drive = settings.shaft.coupled and drive.enabled and settings.dynamometer_mode == "speed"
    fed = settings.inverter.enabled or settings.six_step.enabled
    return fed or by_drive or settings.shaft.holder in ("turning", "pulling")


def _hand(inputs: SegmentInputs) -> tuple[Motion, float]:
    shaft, state = inputs.settings.shaft, inputs.state
    if shaft.holder == "pulling":
        return Wavering(inputs.time, state.angle, shaft.pull_speed, 0.0, 0.0), max(shaft.pull_until, inputs.time)
    phase = shaft.wobble_phase + _HAND_RATE * inputs.time
    end = math.inf
    for begin, over in shaft.pauses:
        if begin <= inputs.time < over:
            return RestingShaft(state.angle), over
        if begin > inputs.time:
            end = begin
            break
    return Wavering(inputs.time, state.angle, shaft.turning_speed, shaft.wobble, _HAND_RATE, phase), end


def _with_over_current(supply: SupplySettings, state: State, segment: Segment) -> Segment:
    """Cut the segment short where over-current protection is due."""
    if segment.supply_mode != "cc" or not supply.over_current:
        return segment
    since = segment.start if state.constant_current_since is None else state.constant_current_since
    delay = supply.over_current_delay
    due = max(since, supply.changed + delay) if supply.over_current_from_change else since + delay
    due = max(due, float(np.nextafter(segment.start, math.inf)))
    return replace(segment, end=due, outcome="trip current") if due < segment.end else segment
