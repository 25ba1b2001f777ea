"""Use of an LCR meter: a line of a locked motor, with the fixture's leads and without them."""

import math
from typing import Any

from bench.testing.conformance.report import Checks
from bench.testing.conformance.session import CheckSession
from bench.testing.conformance.stand import OneInstrumentBench
from drivers.interfaces import Aperture, ImpedanceReading, OverloadError, Wanted

#: Integration (s) that no aperture is shorter or longer than.
_SHORTEST, _LONGEST = 1e-3, 5.0


def _prepare(stand: OneInstrumentBench) -> None:
    stand.world.connect({"A": "lcr_high", "B": "lcr_low"})
    stand.world.lock_rotor()
    stand.watch(stand.world, "impedance")


def _compare(
    stand: OneInstrumentBench,
    checks: Checks,
    reading: ImpedanceReading,
    setting: tuple[float, float, Aperture],
    *,
    corrected: bool = False,
) -> float:
    """Compare a reading with the actual impedance, less that of the leads where they are `corrected`; return the integration time (s).

    An earlier use may have had them corrected, too, and nobody asks for that to be undone.
    """
    frequency, level, aperture = setting
    asked_frequency, asked_level, integration = stand.calls["impedance"][-1][:3]
    remedy = "Compare the command with the manual: unit, rms or peak"
    checks.close("set point: frequency", asked_frequency, frequency, 1e-4 * frequency, remedy)
    checks.close("set point: level", asked_level, level, 1e-3 * level, remedy)
    right, advice = _SHORTEST <= integration <= _LONGEST, remedy
    checks.that("set point: measurement time", right, f"{integration:g} s for {aperture}", advice)
    actual = stand.world.impedance(frequency, level, integration)
    without = actual - _shorted(stand, frequency, level, integration)
    measured = complex(reading.resistance, 2.0 * math.pi * frequency * reading.inductance)
    if corrected or abs(measured - without) < abs(measured - actual):
        actual = without
    omega = 2.0 * math.pi * frequency
    small = 1e-3 * abs(actual)
    checks.accuracy("resistance", reading.resistance_accuracy, reading.resistance, "Ω", actual.real, small)
    actual, small = actual / omega, small / omega
    checks.accuracy("inductance", reading.inductance_accuracy, reading.inductance, "H", actual.imag, small)
    checks.close("reading: frequency", reading.frequency, frequency, 1e-4 * frequency, remedy)
    return float(integration)


def _brief(stand: OneInstrumentBench, meter: Any, checks: Checks) -> None:
    meter.configure(1000.0, 1.0, Aperture.MEDIUM)
    reading = meter.measure(Wanted.BOTH)
    _compare(stand, checks, reading, (1000.0, 1.0, Aperture.MEDIUM))
    _correct(stand, meter, checks)


def _full(stand: OneInstrumentBench, meter: Any, checks: Checks) -> None:
    times: dict[Aperture, float] = {}
    for aperture, low, high in (
        (Aperture.LONG, 90.0, 150.0),
        (Aperture.SHORT, 2e3, 9e3),
        (Aperture.MEDIUM, 300.0, 2e3),
    ):
        setting = (stand.between(low, high), stand.between(0.3, 1.5), aperture)
        meter.configure(*setting)
        reading = meter.measure()
        times[aperture] = _compare(stand, checks, reading, setting)
        expected = meter.accuracy_at(reading.resistance, reading.inductance, setting[0], setting[1], aperture)
        same = all(
            abs(a.gain - b.gain) <= 1e-9 and abs(a.offset - b.offset) <= 1e-12
            for a, b in zip(expected, (reading.resistance_accuracy, reading.inductance_accuracy), strict=True)
        )
        checks.that("accuracy_at agrees with the reading", same, f"{expected}", "Work both out by the same function")
    right = times[Aperture.SHORT] < times[Aperture.MEDIUM] < times[Aperture.LONG]
    remedy = "Send the measurement time in configure()"
    checks.that("set point: measurement times differ", right, f"{times}", remedy)
    stand.world.connect({})
    with checks.refuses("open terminals", OverloadError, remedy="Look at the reading's status, and at 9.9E37"):
        meter.measure()
    stand.world.connect({"A": "lcr_high", "B": "lcr_low"})
    wrong = ((1e3, math.nan), (1e3, -1.0), (0.0, 1.0), (math.inf, 1.0), (1e3, 1e4))
    checks.rejects("set points that cannot be", meter.configure, *wrong)


def _correct(stand: OneInstrumentBench, meter: Any, checks: Checks) -> None:
    stand.world.short_leads(True)
    try:
        meter.correct_short()
    finally:
        stand.world.short_leads(False)
    meter.configure(1000.0, 1.0, Aperture.MEDIUM)
    _compare(stand, checks, meter.measure(), (1000.0, 1.0, Aperture.MEDIUM), corrected=True)


def _shorted(stand: OneInstrumentBench, frequency: float, level: float, integration: float) -> complex:
    """Return the impedance (Ω) of the leads."""
    stand.world.short_leads(True)
    try:
        return complex(stand.world.impedance(frequency, level, integration))
    finally:
        stand.world.short_leads(False)


#: A short correction takes up to two minutes.
SESSION = CheckSession(_prepare, _brief, _full, longest=240.0)
