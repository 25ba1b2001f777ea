"""Use of a tachometer: a shaft turned at several speeds, either way."""

from typing import Any

from bench.testing.conformance.report import Checks
from bench.testing.conformance.session import CheckSession
from bench.testing.conformance.stand import OneInstrumentBench

#: Longer (s) than any gate.
_GATES = 3.0


def _prepare(stand: OneInstrumentBench) -> None:
    stand.world.turn_shaft(60.0)
    stand.wait(_GATES)


def _compare(stand: OneInstrumentBench, meter: Any, checks: Checks, what: str) -> None:
    before = stand.bench.clock.now()
    reading = meter.measure_speed()
    checks.reading(what, reading, abs(stand.world.shaft_speed(0.1)), "rad/s", 0.01)
    now = stand.bench.clock.now()
    checks.that("time of the reading", before <= reading.time <= now, f"{reading.time:g} s", "Give the clock's time")


def _brief(stand: OneInstrumentBench, meter: Any, checks: Checks) -> None:
    _compare(stand, meter, checks, "speed reading")


def _full(stand: OneInstrumentBench, meter: Any, checks: Checks) -> None:
    for speed in (stand.between(5.0, 20.0), -stand.between(20.0, 90.0), stand.between(150.0, 400.0)):
        stand.world.turn_shaft(speed)
        stand.wait(_GATES)
        _compare(stand, meter, checks, f"speed reading {'below' if abs(speed) < 104.0 else 'above'} 1000 rpm")
    stand.world.hold_shaft()
    stand.wait(_GATES)
    _compare(stand, meter, checks, "speed reading at rest")
    _prepare(stand)


SESSION = CheckSession(_prepare, _brief, _full)
