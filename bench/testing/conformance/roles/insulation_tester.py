"""Use of an insulation tester: windings of good and of poor insulation, at several voltages."""

import math
from typing import Any

from bench.testing.conformance.report import Checks
from bench.testing.conformance.session import CheckSession
from bench.testing.conformance.stand import OneInstrumentBench
from drivers.interfaces import InsulationReading

#: What may be left (V) on a winding, and how far (relative) a tester may be from its test voltage.
_HARMLESS, _SET = 60.0, 0.02


def _prepare(stand: OneInstrumentBench) -> None:
    stand.world.connect({"A": "insulation_high"})
    stand.watch(stand.world.insulation, "start")


def _measure(
    stand: OneInstrumentBench, tester: Any, checks: Checks, voltage: float, duration: float
) -> InsulationReading:
    began = stand.bench.clock.now()
    reading: InsulationReading = tester.measure(voltage, duration)
    took = stand.bench.clock.now() - began
    applied, _, held = stand.calls["start"][-1]
    remedy = "Compare the command with the manual: V or kV, s"
    checks.close("set point: test voltage", applied, voltage, _SET * voltage, remedy)
    checks.close("set point: test time", held, duration, 0.1 + 0.02 * duration, remedy)
    checks.close("reading: test voltage", reading.voltage, applied, 0.01 * voltage + 2.0, remedy)
    right, advice = took >= 0.9 * duration, remedy
    checks.that("the test lasts as long as asked for", right, f"{took:.3g} s of {duration:g} s", advice)
    _off(stand, checks)
    return reading


def _off(stand: OneInstrumentBench, checks: Checks) -> None:
    left = stand.world.insulation.voltage()
    remedy = "Switch off and wait for the discharge, however the measurement ends"
    checks.that("off at the end", not stand.energised, "the output is on", remedy)
    checks.that("discharged at the end", left <= _HARMLESS, f"{left:.3g} V are left", remedy)


def _compare(stand: OneInstrumentBench, checks: Checks, reading: InsulationReading) -> None:
    actual = stand.world.motor.insulation_resistance
    remedy = "Look at the sign before it"
    checks.that("resistance within the range", not reading.beyond_range, "said to be beyond", remedy)
    checks.reading("resistance", reading.resistance, actual, "Ω", 0.0)


def _brief(stand: OneInstrumentBench, tester: Any, checks: Checks) -> None:
    voltage = min(500.0, tester.maximum_voltage)
    _compare(stand, checks, _measure(stand, tester, checks, voltage, 1.0))


def _full(stand: OneInstrumentBench, tester: Any, checks: Checks) -> None:
    for voltage, duration in ((250.0, 2.0), (tester.maximum_voltage, 1.5)):
        _compare(stand, checks, _measure(stand, tester, checks, voltage, duration))
    voltages = ((voltage, 1.0) for voltage in (2.0 * tester.maximum_voltage, -100.0, 0.0, math.nan))
    durations = ((500.0, duration) for duration in (-1.0, math.nan, 1e6))
    checks.rejects("set points that cannot be", tester.measure, *voltages, *durations)
    _other_windings(stand, tester, checks)


def _other_windings(stand: OneInstrumentBench, tester: Any, checks: Checks) -> None:
    """Nothing on the lead is beyond the range."""
    stand.world.connect({})
    reading = _measure(stand, tester, checks, 500.0, 1.0)
    checks.that("an open lead is beyond the range", reading.beyond_range, f"{reading.resistance.value:g} Ω", "Tell it")
    stand.world.connect({"A": "insulation_high"})


SESSION = CheckSession(_prepare, _brief, _full)
