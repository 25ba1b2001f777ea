"""Use of a dynamometer: the shaft driven both ways by speed and by torque, braked, and left to coast."""

import math
from contextlib import AbstractContextManager
from typing import Any

from bench.testing.conformance.report import Checks, enter
from bench.testing.conformance.session import CheckSession
from bench.testing.conformance.stand import OneInstrumentBench
from drivers.interfaces import InstrumentError, MeasurementError

#: How far a speed may be from the one commanded: relative, and rad/s.
_SLIP, _STEP = 0.06, 0.1
#: The torque (share of the largest) that turns a free shaft, up to a speed (rad/s); and how many readings are taken then.
_PUSH, _TURNING, _READINGS = 0.05, 30.0, 3
#: How much (relative) a speed that has settled may still change.
_SETTLED = 0.005
_REST = 0.1


def _prepare(stand: OneInstrumentBench) -> None:
    stand.world.couple_dynamometer()


def _speed(dynamometer: Any, share: float) -> float:
    return float(f"{share * min(dynamometer.maximum_speed, 150.0):.4g}")


def _torque_of(dynamometer: Any) -> float:
    return float(f"{_PUSH * dynamometer.maximum_torque:.3g}")


def _energise(_: OneInstrumentBench, dynamometer: Any) -> AbstractContextManager[None]:
    block: AbstractContextManager[None] = dynamometer.driving_speed(_speed(dynamometer, 0.1))
    return block


def _compare(stand: OneInstrumentBench, dynamometer: Any, checks: Checks, what: str) -> None:
    before = stand.bench.clock.now()
    reading = dynamometer.measure()
    actual = stand.world.dynamometer
    speed, torque = actual.speed(0.02), actual.torque(0.02)
    slack = 2e-3 * abs(speed) + 0.02
    checks.accuracy(f"{what}: speed reading", reading.speed_accuracy, reading.speed, "rad/s", speed, slack)
    checks.accuracy(f"{what}: torque reading", reading.torque_accuracy, reading.torque, "N·m", torque, 5e-3)
    power = reading.speed * reading.torque
    remedy = "Power is torque times speed, with its sign"
    checks.close(f"{what}: power", reading.power, power, 0.02 * abs(power) + 0.1, remedy)
    now = stand.bench.clock.now()
    checks.that("time of the reading", before <= reading.time <= now, f"{reading.time:g} s", "Give the clock's time")


def _hold(stand: OneInstrumentBench, checks: Checks, speed: float) -> None:
    actual = stand.world.dynamometer.speed(0.02)
    remedy = "Compare the command with the manual (rpm, Hz, pole pairs, direction), and wait until it has settled"
    checks.close("set point: speed", actual, speed, _SLIP * abs(speed) + _STEP, remedy)
    checks.that("drives in a block", stand.energised, "the drive is off", "Enable it in the block")
    stand.wait(0.5)
    later = stand.world.dynamometer.speed(0.02)
    slack = _SETTLED * abs(speed) + _STEP
    checks.close("the speed has settled", actual, later, slack, "Wait until it changes no more")


def _brief(stand: OneInstrumentBench, dynamometer: Any, checks: Checks) -> None:
    speed = _speed(dynamometer, 0.1)
    dynamometer.stop()
    dynamometer.zero_torque()
    _compare(stand, dynamometer, checks, "at rest")
    # By torque first: nothing that a driven speed would settle is settled yet.
    with dynamometer.driving_torque(_torque_of(dynamometer), _TURNING):
        checks.that("drives in a block", stand.energised, "the drive is off", "Enable it in the block")
        stand.wait(1.0)
        for _ in range(_READINGS):
            _compare(stand, dynamometer, checks, "at a torque")
    stand.off(checks)
    dynamometer.stop()
    with dynamometer.driving_speed(speed):
        _hold(stand, checks, speed)
        _compare(stand, dynamometer, checks, "at speed")
    stand.off(checks)
    dynamometer.stop()


def _full(stand: OneInstrumentBench, dynamometer: Any, checks: Checks) -> None:
    dynamometer.zero_torque()
    for share in (stand.between(0.5, 0.9), -stand.between(0.2, 0.6)):
        speed = _speed(dynamometer, share)
        with dynamometer.driving_speed(speed):
            _hold(stand, checks, speed)
            stand.wait(0.1)
            _compare(stand, dynamometer, checks, "forwards" if speed > 0.0 else "backwards")
            dynamometer.set_speed(-speed / 3.0)
            _hold(stand, checks, -speed / 3.0)
            wrong = (math.nan, 2.0 * dynamometer.maximum_speed, -2.0 * dynamometer.maximum_speed)
            checks.rejects("a speed beyond the maximum", dynamometer.set_speed, *((one,) for one in wrong))
            with checks.refuses("zeroing a turning shaft", MeasurementError, remedy="Ask the speed first"):
                dynamometer.zero_torque()
            dynamometer.command_zero()
            stand.wait(2.0)
            advice = "Command no speed and no torque"
            checks.close("command_zero(): speed", stand.world.dynamometer.speed(), 0.0, 1.0, advice)
        stand.off(checks)
    with dynamometer.driving_speed(1.0):
        _hold(stand, checks, 1.0)
    _brake(stand, dynamometer, checks)
    _torque(stand, dynamometer, checks)
    # It cannot get there: the speed that was commanded is not reported as reached.
    stand.world.set_stuck_rotor(True)
    remedy = "Wait for the speed, and raise where it does not come"
    with checks.refuses("a shaft that is jammed", MeasurementError, remedy=remedy):
        enter(dynamometer.driving_speed(_speed(dynamometer, 0.3)))
    stand.off(checks)
    stand.world.set_stuck_rotor(False)
    stand.wait(5.0)
    dynamometer.make_safe()
    # It runs away: that it does not come to rest is told.
    remedy = "Wait until the shaft stands, for settle_timeout at most"
    with checks.refuses("a shaft that does not come to rest", InstrumentError, remedy=remedy):
        with dynamometer.driving_speed(_speed(dynamometer, 0.1)):
            stand.world.damage.run_dynamometer_away(60.0)
            stand.wait(1.0)
            dynamometer.stop()
    stand.world.damage.run_dynamometer_away(None)
    dynamometer.make_safe()
    dynamometer.stop()


def _brake(stand: OneInstrumentBench, dynamometer: Any, checks: Checks) -> None:
    """Check that the shaft coasts at the end of a block, and that stop() brakes it."""
    enter(dynamometer.driving_speed(_speed(dynamometer, 0.9)))
    # What somebody sets at the front panel meanwhile changes nothing.
    stand.find()
    coasts = abs(stand.world.dynamometer.speed()) > 1.0
    checks.that("coasts at the end of a block", coasts, "it was braked", "Coast to a stop at the end of a block")
    dynamometer.stop()
    speed = stand.world.dynamometer.speed()
    checks.close("stop(): at rest", speed, 0.0, _REST, "Return once the shaft stands")
    stand.off(checks)


def _torque(stand: OneInstrumentBench, dynamometer: Any, checks: Checks) -> None:
    remedy = "Compare the torque command with the manual: share of the rated torque, sign, scale"
    stand.world.set_stuck_rotor(True)
    for share in (stand.between(0.3, 0.6), -stand.between(0.1, 0.2)):
        torque = float(f"{share * dynamometer.maximum_torque:.3g}")
        with dynamometer.driving_torque(torque, 40.0):
            stand.wait(0.5)
            actual = stand.world.dynamometer.torque(0.02)
            slack = 0.02 * abs(torque) + 2e-3 * dynamometer.maximum_torque
            checks.close("set point: torque", actual, torque, slack, remedy)
            reading = dynamometer.measure()
            checks.close("torque reading at rest", reading.torque, actual, 0.02 * abs(actual) + 0.02, remedy)
            if share < 0.0:
                dynamometer.command_zero()
                stand.wait(0.2)
                left = stand.world.dynamometer.torque()
                checks.close("command_zero(): torque", left, 0.0, 0.02, "Command no speed and no torque")
        stand.off(checks)
    stand.world.set_stuck_rotor(False)
    for sign in (-1.0, 1.0):
        with dynamometer.driving_torque(sign * _torque_of(dynamometer), _TURNING):
            stand.wait(1.0)
            _compare(stand, dynamometer, checks, "at a torque")
            dynamometer.stop()
            speed, advice = stand.world.dynamometer.speed(), "Switch off before the mode is changed"
            checks.close("stop() in a block of torque: at rest", speed, 0.0, _REST, advice)
    wrong = ((math.nan, 40.0), (2.0 * dynamometer.maximum_torque, 40.0), (0.1, -1.0), (0.1, 1e5))
    checks.rejects("torques that cannot be", dynamometer.driving_torque, *wrong)
    dynamometer.stop()


SESSION = CheckSession(_prepare, _brief, _full, _energise, stuck="dynamometer")
