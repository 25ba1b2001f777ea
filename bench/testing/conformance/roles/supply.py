"""Use of a DC supply: line A–B of a locked motor is fed, at several voltages and at the current limit."""

import math
from contextlib import AbstractContextManager
from typing import Any

from bench.testing.conformance.report import Checks
from bench.testing.conformance.session import CheckSession
from bench.testing.conformance.stand import OneInstrumentBench, rounded
from drivers.interfaces import OutputMode, Regulated, ReportedError, Supply

#: What an output may be off its set point: share of the value, and of the largest one.
_SET = 2e-3
_SETTLED = 0.3


def _prepare(stand: OneInstrumentBench) -> None:
    stand.world.connect({"A": "supply+", "B": "supply-"})
    stand.world.lock_rotor()


def _resistance(stand: OneInstrumentBench) -> float:
    a, b, _ = stand.world.motor.phase_resistances
    return float(a + b)


def _level(stand: OneInstrumentBench, supply: Supply, share: float) -> tuple[float, float]:
    """Return a voltage (V) that stays below the current limit (A) given with it."""
    most = min(supply.maximum_voltage, 0.7 * supply.maximum_current * _resistance(stand))
    voltage = rounded(share * most)
    return voltage, rounded(min(supply.maximum_current, 1.4 * voltage / _resistance(stand)))


def _energise(stand: OneInstrumentBench, supply: Any) -> AbstractContextManager[None]:
    block: AbstractContextManager[None] = supply.energised(*_level(stand, supply, 0.5))
    return block


def _compare(stand: OneInstrumentBench, supply: Supply, checks: Checks, what: str) -> None:
    actual = stand.world.truth()
    checks.reading(f"{what}: voltage reading", supply.measure_voltage(), actual["supply_voltage"], "V", 1e-3)
    checks.reading(f"{what}: current reading", supply.measure_current(), actual["supply_current"], "A", 2e-3)


def _hold_voltage(stand: OneInstrumentBench, supply: Supply, checks: Checks, voltage: float, limit: float) -> None:
    with supply.energised(voltage, limit):
        stand.wait(_SETTLED)
        actual = stand.world.truth()
        checks.that("energised: output is on", actual["output_on"], "the output is off", "Switch it on in energised()")
        remedy = "Compare the voltage command with the manual: unit, scale, channel"
        checks.close("set point: voltage", actual["supply_voltage"], voltage, _SET * supply.maximum_voltage, remedy)
        mode = supply.output_mode()
        remedy = "Compare the status bits with the manual"
        checks.that("output_mode at voltage", mode is OutputMode.CONSTANT_VOLTAGE, f"{mode}", remedy)
        _compare(stand, supply, checks, "at voltage")
    _off(stand, supply, checks)


def _hold_current(stand: OneInstrumentBench, supply: Supply, checks: Checks, limit: float) -> None:
    voltage = min(supply.maximum_voltage, rounded(1.5 * limit * _resistance(stand)))
    with supply.energised(voltage, limit, Regulated.CURRENT):
        stand.wait(_SETTLED)
        actual, slack = stand.world.truth()["supply_current"], 2.0 * _SET * supply.maximum_current
        remedy = "Compare the current command with the manual: unit, scale, channel; protection off here"
        checks.close("set point: current limit", actual, limit, slack, remedy)
        mode = supply.output_mode()
        remedy = "Compare the status bits with the manual"
        checks.that("output_mode at current", mode is OutputMode.CONSTANT_CURRENT, f"{mode}", remedy)
        _compare(stand, supply, checks, "at current")
    _off(stand, supply, checks)


def _off(stand: OneInstrumentBench, supply: Supply, checks: Checks) -> None:
    mode = supply.output_mode()
    checks.that("output_mode when off", mode is OutputMode.OFF, f"{mode}", "Ask the output's state as well")
    stand.off(checks)
    # What the output's capacitors hold would trip the protection of a lower level.
    stand.wait(_SETTLED)


def _brief(stand: OneInstrumentBench, supply: Any, checks: Checks) -> None:
    _hold_voltage(stand, supply, checks, *_level(stand, supply, 0.5))


def _full(stand: OneInstrumentBench, supply: Any, checks: Checks) -> None:
    for share in (0.9, 0.2, stand.between(0.3, 0.8)):
        _hold_voltage(stand, supply, checks, *_level(stand, supply, share))
        protections = stand.world.supply.protections()
        voltage, _ = _level(stand, supply, share)
        over = protections["over_voltage"]
        right = over is None or _protects(stand, supply, voltage, over)
        remedy = "Set it above the level by over_voltage_margin and over_voltage_headroom"
        checks.that("over-voltage protection", right, f"it stands at {over} V for a level of {voltage:g} V", remedy)
    highest = min(supply.maximum_current, 0.9 * supply.maximum_voltage / (1.5 * _resistance(stand)))
    for share in (0.8, stand.between(0.2, 0.6)):
        _hold_current(stand, supply, checks, rounded(share * highest))
    _trip(stand, supply, checks, highest)
    _set_without_output(stand, supply, checks)
    # The largest voltage too, with nothing connected.
    stand.world.connect({})
    with supply.energised(supply.maximum_voltage, rounded(supply.maximum_current)):
        stand.wait(_SETTLED)
        level = stand.world.truth()["supply_voltage"]
    remedy = "Compare maximum_voltage with the model's rating"
    checks.close("set point: largest voltage", level, supply.maximum_voltage, _SET * supply.maximum_voltage, remedy)
    _prepare(stand)
    stand.wait(_SETTLED)


def _protects(stand: OneInstrumentBench, supply: Any, voltage: float, over: float) -> bool:
    """Tell whether over-voltage protection (V) stands above a level (V) as the options of every supply have it."""
    options = stand.subject.options
    wanted = voltage * (1.0 + options.over_voltage_margin) + options.over_voltage_headroom
    return abs(over - wanted) <= 0.01 + 1e-3 * voltage or bool(supply.maximum_voltage < over < wanted)


def _trip(stand: OneInstrumentBench, supply: Any, checks: Checks, highest: float) -> None:
    """Check that an over-current protection, where there is one, switches off at the limit and is reported at the block's end."""
    limit = rounded(0.3 * highest)
    voltage = min(supply.maximum_voltage, rounded(3.0 * limit * _resistance(stand)))
    remedy = "Tell a tripped protection at the end of the block, and release its latch"
    protected, tripped, told = False, False, False
    try:
        with supply.energised(voltage, limit):
            protected = bool(stand.world.supply.protections()["over_current"])
            stand.wait(1.0)
            tripped = stand.world.supply.tripped is not None
            shown = supply.output_mode()
    except ReportedError:
        told = True
    checks.that("a trip is told", told or not protected, "no ReportedError at the end of the block", remedy)
    checks.that("the limit trips", tripped or not protected, "it has not tripped after 1 s", "Set protection and delay")
    if tripped:
        checks.that("output_mode when tripped", shown is OutputMode.TRIPPED, f"{shown}", remedy)
    checks.that("a trip is released", stand.world.supply.tripped is None, "the latch holds", remedy)
    checks.that("off after a trip", not stand.energised, "the output is on", remedy)
    # One that has tripped at somebody else's hands is for a person to look into.
    stand.world.supply.set_over_current(True, 0.01)
    stand.world.supply.set_current_limit(limit)
    stand.world.supply.set_voltage(voltage)
    stand.world.supply.switch(True)
    stand.wait(0.5)
    if stand.world.supply.tripped is not None:
        tells = supply.output_mode() is OutputMode.TRIPPED
        stand.messages.clear()
        with checks.refuses("a protection that tripped earlier", ReportedError, remedy="Ask before switching on"):
            with supply.energised(*_level(stand, supply, 0.5)):
                pass
        # A supply without a query for it refuses to be switched on, no more.
        sent = [message for message, _ in stand.messages if tells and "?" not in message]
        checks.that("nothing is sent to a tripped output", not sent, f"{sent}", "Ask before anything is set")
        stand.world.supply.clear_trip()
    supply.make_safe()


def _set_without_output(stand: OneInstrumentBench, supply: Any, checks: Checks) -> None:
    """Both orders: to a higher level and to a lower one, while the output is off; the protection stays above the level."""
    stand.watch(stand.world.supply, "set_voltage")

    def above() -> float:
        over, levels = stand.world.supply.protections()["over_voltage"], stand.calls["set_voltage"]
        return math.inf if over is None or not levels else float(over - levels[-1][0])

    with stand.sampling(above) as margins:
        for share in (0.2, 0.7, 0.2):
            supply.configure(*_level(stand, supply, share))
            remedy = "Switch on in energised() only"
            checks.that("configure() leaves the output off", not stand.energised, "it is on", remedy)
    least, advice = min(margins, default=math.inf), "Raise it before the level, and lower it after the level"
    checks.that("over-voltage protection while levels change", least >= 0.0, f"{-least:.3g} V below the level", advice)
    checks.rejects("negative voltage", supply.configure, (-1.0, 0.1))


SESSION = CheckSession(_prepare, _brief, _full, _energise, stuck="supply")
