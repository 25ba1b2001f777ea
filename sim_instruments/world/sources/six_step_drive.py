"""The shaft and the currents while the six-step drive is on.

A load that changes takes the speed over to its new balance as exp(−t/τ), τ the inertia over the slope of the torque
at that balance, with the waveforms of the steady states on the way: neither the electrical transient nor the ripple of
the speed is followed, which `six_step.run_up` does. The drive turns the motor forwards only.
"""

import math

import numpy as np

from sim_instruments.physics.commutated import Commutated
from sim_instruments.physics.motion.motion import Drag, Motion, Ramp, RestingShaft, Wavering
from sim_instruments.six_step.drive import SixStepError
from sim_instruments.world.segment import DynamometerLaw, Segment
from sim_instruments.world.segment_inputs import SegmentInputs
from sim_instruments.world.settings import SixStepFault
from sim_instruments.world.sources.six_step_stage import SixStepStage

SOCKETS = ("drive_1", "drive_2", "drive_3")
#: Relative distance from the balance at which the shaft counts as having got there.
_ARRIVED = 1e-6
#: A speed that varies by no more than this share is one speed to the currents.
_EVEN = 1e-3


class DriveTripError(Exception):
    """The drive cannot run like this and switches itself off."""

    def __init__(self, fault: SixStepFault) -> None:
        self.fault = fault
        super().__init__(fault)


def imposed(inputs: SegmentInputs, motion: Motion, end: float, law: DynamometerLaw) -> Segment:
    """Return the segment of a shaft that something else holds or turns.

    Raises DriveTripError where it stands, where it turns backwards, and for wiring that is not the drive's.
    """
    stage = _wired(inputs)
    if isinstance(motion, RestingShaft):
        raise DriveTripError("no rotation")
    ahead = inputs.time + min(0.5 * (end - inputs.time), 1e-3)
    if float(motion.speed(np.array([ahead]))[0]) < 0.0:
        raise DriveTripError("overcurrent")
    if isinstance(motion, Ramp) and motion.rate == 0.0:
        return _segment(inputs, stage, motion, end, law, motion.start_speed)
    if isinstance(motion, Wavering):
        return _segment(inputs, stage, motion, end, law, motion.mean_speed, uniform=motion.depth <= _EVEN)
    final = float(motion.speed(np.array([end]))[0]) if math.isfinite(end) else 0.0
    return _segment(inputs, stage, motion, end, law, final, uniform=False)


def free(inputs: SegmentInputs, torque: float, law: DynamometerLaw) -> Segment:
    """Return the segment of a free shaft, with the dynamometer's torque (N·m) on it where that is on.

    Raises DriveTripError where the load is more than the drive carries, where the shaft turns backwards, and for wiring
    that is not the drive's.
    """
    stage, state = _wired(inputs), inputs.state
    if state.speed < 0.0:
        raise DriveTripError("overcurrent")
    shaft = inputs.constants.shaft(inputs.settings)
    fastest = inputs.constants.dynamometer.maximum_speed if law.kind == "constant" else math.inf
    try:
        balance = stage.balance(shaft, torque, fastest)
    except SixStepError:
        raise DriveTripError("no rotation") from None
    final = balance.speed
    if abs(state.speed - final) <= 2.0 * _ARRIVED * final:
        if balance.limited:
            law = DynamometerLaw("balance")
        return _segment(inputs, stage, Ramp(inputs.time, state.angle, final), math.inf, law, final)
    # The slope acts like viscous friction, and the balance is where it takes up all of the torque.
    motion = Drag(inputs.time, state.angle, state.speed, balance.slope * final, shaft.inertia, balance.slope)
    end = motion.time_of_speed(final * (1.0 + math.copysign(_ARRIVED, state.speed - final)))
    return _segment(inputs, stage, motion, end, law, final, uniform=False)


def _wired(inputs: SegmentInputs) -> SixStepStage:
    """Return the drive's stage at the winding's temperature. Raises DriveTripError where the terminals are not on its legs in their order.

    With two wires exchanged, or all three moved on, the currents hold against the Hall signals: no torque, all current.
    """
    stage, sockets = inputs.constants.six_step, inputs.settings.sockets()
    if stage is None or set(sockets) != set(SOCKETS):
        raise DriveTripError("output phase missing")
    if sockets != SOCKETS:
        raise DriveTripError("overcurrent")
    if inputs.settings.rotor_held:
        raise DriveTripError("no rotation")
    return stage.at(inputs.state.temperature)


def _segment(
    inputs: SegmentInputs,
    stage: SixStepStage,
    motion: Motion,
    end: float,
    law: DynamometerLaw,
    speed: float,
    *,
    uniform: bool = True,
) -> Segment:
    network = inputs.constants.network(inputs.windings, inputs.settings, supplied=False)
    circuit = Commutated(network, motion, stage, speed, source=inputs.open_source(), uniform=uniform)
    return inputs.segment(motion, circuit, end, law, live=True)
