"""Use of an inverter: a field that turns both ways, and a regulated current."""

import math
from contextlib import AbstractContextManager
from typing import Any

from bench.testing.conformance.report import Checks, enter
from bench.testing.conformance.session import CheckSession
from bench.testing.conformance.stand import Stand
from drivers.interfaces import InstrumentError

_SETTLED = 0.1


def _prepare(stand: Stand) -> None:
    stand.world.connect({"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"})


def _energise(_: Stand, inverter: Any) -> AbstractContextManager[None]:
    block: AbstractContextManager[None] = inverter.driving_frequency(5.0, _current(inverter, 0.2))
    return block


def _current(inverter: Any, share: float) -> float:
    return float(f"{share * min(inverter.maximum_current, 10.0):.3g}")


def _compare(stand: Stand, inverter: Any, checks: Checks, what: str) -> None:
    reading = inverter.measure_frequency()
    actual = stand.world.inverter
    checks.reading(f"{what}: frequency reading", reading, actual.output_frequency(), "Hz", 0.05)
    reading = inverter.measure_current()
    checks.reading(f"{what}: current reading", reading, actual.q_current(), "A", 0.05)


def _turn(stand: Stand, inverter: Any, checks: Checks, frequency: float, current: float) -> None:
    with inverter.driving_frequency(frequency, current):
        checks.that("drives in a block", stand.energised, "the drive is off", "Enable it in the block")
        found = stand.world.inverter.output_frequency()
        remedy = "Compare the command with the manual (rpm, pole pairs, scale), and wait until the ramp has ended"
        checks.close("set point: frequency", found, frequency, 0.01 * abs(frequency) + 0.1, remedy)
        stand.wait(_SETTLED)
        found = stand.world.inverter.current_amplitude()
        remedy = "Compare the command with the manual: rms or peak, mA, per mille of rated"
        checks.close("set point: amplitude", found, current, 0.02 * current, remedy)
        _compare(stand, inverter, checks, "at a frequency")
    stand.off(checks)


def _brief(stand: Stand, inverter: Any, checks: Checks) -> None:
    _turn(stand, inverter, checks, 5.0, _current(inverter, 0.2))


def _full(stand: Stand, inverter: Any, checks: Checks) -> None:
    for frequency in (stand.between(10.0, 20.0), -stand.between(5.0, 10.0)):
        _turn(stand, inverter, checks, frequency, _current(inverter, stand.between(0.4, 0.9)))
    inverter.make_safe()
    stand.world.lock_rotor()
    remedy = "Compare the command with the manual: rms or peak, mA, per mille of rated, sign"
    for share in (-stand.between(0.1, 0.3), stand.between(0.4, 0.9)):
        current = _current(inverter, share)
        with stand.sampling(stand.world.inverter.current_amplitude) as currents, inverter.driving_current(current):
            found, slack = stand.world.inverter.q_current(), 0.03 * abs(current) + 0.05
            checks.close("set point: current", found, current, slack, remedy)
            stand.wait(_SETTLED)
            _compare(stand, inverter, checks, "at a current")
            inverter.set_current(-current / 2.0)
            found = stand.world.inverter.q_current()
            checks.close("set point: current in a block", found, -current / 2.0, slack, remedy)
            most, none = max(currents, default=0.0), "Command no current before the drive is enabled"
            less = most <= 1.2 * abs(current) + 0.2
            checks.that("no more current on the way", less, f"{most:.3g} A for {current:.3g} A", none)
            inverter.command_zero()
            stand.wait(_SETTLED)
            found = stand.world.inverter.q_current()
            checks.close("command_zero(): current", found, 0.0, 0.05, "Command no current and no speed")
        stand.off(checks)
    stand.world.release_rotor()
    with inverter.driving_frequency(5.0, _current(inverter, 0.5)):
        inverter.command_zero()
        stand.wait(2.0)
        found = stand.world.inverter.output_frequency()
        checks.close("command_zero(): frequency", found, 0.0, 0.1, "Command no current and no speed")
    highest, current = inverter.maximum_frequency, inverter.maximum_current
    wrong = ((2.0 * highest, 1.0), (-2.0 * highest, 1.0), (math.nan, 1.0), (1.0, -1.0), (1.0, 2.0 * current))
    checks.rejects("set points that cannot be", inverter.driving_frequency, *wrong)
    for act in (inverter.driving_current, inverter.set_current):
        checks.rejects("currents that cannot be", act, *((one,) for one in (2.0 * current, -2.0 * current, math.nan)))
    stand.world.connect({})
    remedy = "Wait for it, and raise where it does not come"
    with checks.refuses("a current that cannot flow", InstrumentError, remedy=remedy):
        enter(inverter.driving_current(_current(inverter, 0.5)))
    stand.off(checks)
    _prepare(stand)
    stand.wait(5.0)
    remedy = "Wait until the ramp has ended, for settle_timeout at most"
    stand.world.damage.run_inverter_away(80.0)
    with checks.refuses("a frequency that is not reached", InstrumentError, remedy=remedy):
        enter(inverter.driving_frequency(5.0, _current(inverter, 0.5)))
    stand.world.damage.run_inverter_away(None)
    stand.off(checks)
    stand.wait(5.0)


SESSION = CheckSession(_prepare, _brief, _full, _energise, stuck="inverter")
