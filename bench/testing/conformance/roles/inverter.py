"""Use of an inverter, as far as it says that it can: a field that turns both ways, a regulated q-axis current, currents of both axes."""

import math
from contextlib import AbstractContextManager
from typing import Any

from bench.testing.conformance.report import Checks, enter
from bench.testing.conformance.roles.dq_currents import both_currents, both_currents_fully, holding_still
from bench.testing.conformance.session import CheckSession
from bench.testing.conformance.stand import OneInstrumentBench
from drivers.interfaces import InstrumentError, InverterAbility

_SETTLED = 0.1
#: How long (s) a hand holds a shaft until it stands.
_STOPPED = 2.0


def _prepare(stand: OneInstrumentBench) -> None:
    stand.world.connect({"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"})


def _can(inverter: Any, ability: InverterAbility) -> bool:
    return ability in inverter.abilities


def _energise(stand: OneInstrumentBench, inverter: Any) -> AbstractContextManager[None]:
    current = _current(inverter, 0.2)
    if _can(inverter, InverterAbility.FREQUENCY):
        turning: AbstractContextManager[None] = inverter.driving_frequency(5.0, current)
        return turning
    # A current would speed the rotor up: it is held from now on.
    stand.world.lock_rotor()
    if _can(inverter, InverterAbility.Q_CURRENT):
        holding: AbstractContextManager[None] = inverter.driving_current(current)
        return holding
    regulating: AbstractContextManager[None] = inverter.driving_dq_current(0.0, current)
    return regulating


def _current(inverter: Any, share: float) -> float:
    return float(f"{share * min(inverter.maximum_current, 10.0):.3g}")


def _compare(stand: OneInstrumentBench, inverter: Any, checks: Checks, what: str) -> None:
    reading = inverter.measure_frequency()
    actual = stand.world.inverter
    checks.reading(f"{what}: frequency reading", reading, actual.output_frequency(), "Hz", 0.05)
    reading = inverter.measure_current()
    checks.reading(f"{what}: current reading", reading, actual.q_current(), "A", 0.05)


def _turn(stand: OneInstrumentBench, inverter: Any, checks: Checks, frequency: float, current: float) -> None:
    turning = stand.world.inverter
    sampling = stand.sampling(lambda: turning.output_frequency() if turning.enabled else 0.0)
    with sampling as shown, inverter.driving_frequency(frequency, current):
        against, way = (
            min(one * math.copysign(1.0, frequency) for one in shown),
            "Command no speed before it is enabled",
        )
        checks.close("no turning against the command on the way", min(against, 0.0), 0.0, 1e-6, way)
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


def _brief(stand: OneInstrumentBench, inverter: Any, checks: Checks) -> None:
    if _can(inverter, InverterAbility.FREQUENCY):
        _turn(stand, inverter, checks, 5.0, _current(inverter, 0.2))
    if _can(inverter, InverterAbility.DQ_CURRENT):
        both_currents(stand, inverter, checks)
    if _can(inverter, InverterAbility.Q_CURRENT):
        _regulate(stand, inverter, checks, _current(inverter, 0.2))


def _full(stand: OneInstrumentBench, inverter: Any, checks: Checks) -> None:
    if _can(inverter, InverterAbility.FREQUENCY):
        _turn_fully(stand, inverter, checks)
    if _can(inverter, InverterAbility.Q_CURRENT):
        inverter.make_safe()
        for share in (-stand.between(0.1, 0.3), stand.between(0.4, 0.9)):
            _regulate(stand, inverter, checks, _current(inverter, share))
        most = inverter.maximum_current
        for act in (inverter.driving_current, inverter.set_current):
            checks.rejects("currents that cannot be", act, *((one,) for one in (2.0 * most, -2.0 * most, math.nan)))
        _cannot_flow(stand, checks, lambda: inverter.driving_current(_current(inverter, 0.5)))
    if _can(inverter, InverterAbility.DQ_CURRENT):
        inverter.make_safe()
        both_currents_fully(stand, inverter, checks)
        _cannot_flow(stand, checks, lambda: inverter.driving_dq_current(0.0, _current(inverter, 0.5)))
    if _can(inverter, InverterAbility.FREQUENCY):
        _run_away(stand, inverter, checks)


def _turn_fully(stand: OneInstrumentBench, inverter: Any, checks: Checks) -> None:
    for frequency in (stand.between(10.0, 20.0), -stand.between(5.0, 10.0)):
        # From rest, as a field may begin with the rotor's own speed.
        stand.world.hold_shaft()
        stand.wait(_STOPPED)
        stand.world.let_go()
        _turn(stand, inverter, checks, frequency, _current(inverter, stand.between(0.4, 0.9)))
    # By the program that drives it, and by a guardian, which knows nothing of what was set up.
    guard: Any = stand.open(guarding=True, elsewhere=True)
    for name, one in (("command_zero()", inverter), ("command_zero() by a second connection", guard)):
        with inverter.driving_frequency(5.0, _current(inverter, 0.5)):
            one.command_zero()
            stand.wait(2.0)
            found = stand.world.inverter.output_frequency()
            checks.close(f"{name}: frequency", found, 0.0, 0.1, "Command no current and no speed")
    guard.close()
    highest, current = inverter.maximum_frequency, inverter.maximum_current
    wrong = ((2.0 * highest, 1.0), (-2.0 * highest, 1.0), (math.nan, 1.0), (1.0, -1.0), (1.0, 2.0 * current))
    checks.rejects("set points that cannot be", inverter.driving_frequency, *wrong)


def _regulate(stand: OneInstrumentBench, inverter: Any, checks: Checks, current: float) -> None:
    remedy = "Compare the command with the manual: rms or peak, mA, per mille of rated, sign"
    sampling = stand.sampling(stand.world.inverter.current_amplitude)
    with sampling as currents, holding_still(stand, lambda: inverter.driving_current(current)):
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


def _cannot_flow(stand: OneInstrumentBench, checks: Checks, drive: Any) -> None:
    stand.world.connect({})
    remedy = "Wait for it, and raise where it does not come"
    with checks.refuses("a current that cannot flow", InstrumentError, remedy=remedy):
        enter(drive())
    stand.off(checks)
    _prepare(stand)
    stand.wait(5.0)


def _run_away(stand: OneInstrumentBench, inverter: Any, checks: Checks) -> None:
    remedy = "Wait until the ramp has ended, for settle_timeout at most"
    stand.world.damage.run_inverter_away(80.0)
    with checks.refuses("a frequency that is not reached", InstrumentError, remedy=remedy):
        enter(inverter.driving_frequency(5.0, _current(inverter, 0.5)))
    stand.world.damage.run_inverter_away(None)
    stand.off(checks)
    stand.wait(5.0)


SESSION = CheckSession(_prepare, _brief, _full, _energise, stuck="inverter")
