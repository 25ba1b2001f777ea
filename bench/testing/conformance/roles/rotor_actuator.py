"""Use of a rotor actuator: the shaft locked, turned, moved by angles, let go, and coupled."""

import math
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any

from bench.testing.conformance.report import Checks
from bench.testing.conformance.session import CheckSession
from bench.testing.conformance.stand import OneInstrumentBench
from drivers.interfaces import InstrumentError

_ANGLE = math.radians(2.5)
#: How long (s) parts and ramps may take beside a movement.
_MOVING = 10.0


def _prepare(_: OneInstrumentBench) -> None:
    """Nothing to do: it holds and frees the shaft itself."""


@contextmanager
def _turning(actuator: Any) -> Iterator[None]:
    actuator.turn(2.0)
    try:
        yield
    finally:
        actuator.stop()


def _energise(_: OneInstrumentBench, actuator: Any) -> AbstractContextManager[None]:
    return _turning(actuator)


def _free(stand: OneInstrumentBench, checks: Checks, when: str) -> None:
    truth = stand.world.truth()
    remedy = "Take the torque away and open the clutch"
    checks.that(f"the shaft is free {when}", truth["shaft_holder"] == "free", truth["shaft_holder"], remedy)


def _brief(stand: OneInstrumentBench, actuator: Any, checks: Checks) -> None:
    actuator.release()
    with stand.sampling(stand.world.shaft_velocity) as speeds:
        actuator.turn(2.0)
    fastest = max(map(abs, speeds))
    advice = "Command none before it is held"
    checks.that("turn(): no faster on the way", fastest <= 2.2, f"{fastest:.3g} rad/s", advice)
    remedy = "Compare the command with the manual: increments, rpm, sign; return once it turns"
    checks.close("set point: speed", stand.world.shaft_velocity(), 2.0, 0.12, remedy)
    actuator.stop()
    _free(stand, checks, "after stop()")
    _angle(stand, actuator, checks)
    actuator.lock()
    actuator.release()
    _move(stand, actuator, checks, 0.2)
    actuator.couple_dynamometer()
    actuator.uncouple_dynamometer()


def _angle(stand: OneInstrumentBench, actuator: Any, checks: Checks) -> None:
    reading = actuator.angle()
    actual = stand.world.dial_angle()
    checks.that("angle: unit", reading.unit == "rad", reading.unit, "An angle is in rad")
    checks.accuracy("angle", reading.accuracy, reading.value, "rad", actual, 1e-3)


def _move(stand: OneInstrumentBench, actuator: Any, checks: Checks, angle: float) -> None:
    before, began = stand.world.dial_angle(), stand.bench.clock.now()
    actuator.move_by(angle)
    moved = stand.world.dial_angle() - before
    remedy = "Compare the command with the manual: increments per turn, absolute or relative; return once it is there"
    checks.close("set point: angle", moved, angle, _ANGLE, remedy)
    took = stand.bench.clock.now() - began
    least = abs(angle) / actuator.maximum_speed
    checks.that("move_by() keeps to the speed", took >= 0.9 * least, f"{took:.3g} s for {angle:.3g} rad", remedy)
    late = took > 2.0 * least + _MOVING
    checks.that("move_by(): in time", not late, f"{took:.3g} s for {angle:.3g} rad", "Return once it is there")
    _free(stand, checks, "after move_by()")
    _angle(stand, actuator, checks)


def _full(stand: OneInstrumentBench, actuator: Any, checks: Checks) -> None:
    highest = actuator.maximum_speed
    for share in (stand.between(0.4, 0.9), -stand.between(0.02, 0.1)):
        speed = float(f"{share * highest:.3g}")
        actuator.turn(speed)
        stand.wait(0.2)
        found = stand.world.shaft_velocity()
        remedy = "Compare the command with the manual: increments, rpm, sign"
        checks.close("set point: speed", found, speed, 0.03 * abs(speed), remedy)
        for block in (actuator.couple_dynamometer, actuator.uncouple_dynamometer, actuator.lock):
            what = f"{block.__name__}() while the shaft turns"
            with checks.refuses(what, InstrumentError, remedy="Ask the speed first"):
                block()
        actuator.stop()
        checks.close("stop(): speed", stand.world.shaft_velocity(), 0.0, 0.1, "Return once the drive stands")
        _free(stand, checks, "after stop()")
    for angle in (stand.between(0.5, 2.0), -stand.between(8.0, 12.0), math.radians(7.0)):
        _move(stand, actuator, checks, angle)
    _parts(stand, actuator, checks)
    checks.rejects("speeds that cannot be", actuator.turn, (2.0 * highest,), (-2.0 * highest,), (math.nan,))
    checks.rejects("angles that cannot be", actuator.move_by, (math.nan,), (1e12,))
    stand.world.set_stuck_rotor(True)
    for act in (actuator.turn, actuator.move_by):
        with checks.refuses(f"{act.__name__}() of a jammed shaft", InstrumentError, remedy="Watch it move"):
            act(1.0)
        checks.that("nothing drives a jammed shaft", not stand.energised, "it is driven", "Let go on errors")
    stand.world.set_stuck_rotor(False)
    actuator.make_safe()


def _parts(stand: OneInstrumentBench, actuator: Any, checks: Checks) -> None:
    remedy = "Return once the mechanism has followed, by its own end switches"
    actuator.lock()
    checks.that("lock() locks", stand.world.truth()["rotor_locked"], "the shaft is not locked", remedy)
    for act in (actuator.turn, actuator.move_by):
        what, ask = f"{act.__name__}() with the brake closed", "Ask the brake first"
        with checks.refuses(what, InstrumentError, remedy=ask, says=("brake",)):
            act(1.0)
    actuator.make_safe()
    checks.that("make_safe() leaves the brake", stand.world.truth()["rotor_locked"], "the brake has opened", remedy)
    actuator.release()
    _free(stand, checks, "after release()")
    for act, coupled in ((actuator.couple_dynamometer, True), (actuator.uncouple_dynamometer, False)):
        act()
        found = stand.world.truth()["dynamometer_coupled"]
        checks.that(f"{act.__name__}()", found is coupled, "the coupling has not followed", remedy)


SESSION = CheckSession(_prepare, _brief, _full, _energise)
