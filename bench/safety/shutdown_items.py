"""Execution of each item of a shutdown sequence on its instrument."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from bench.safety.limits.units import unit_check
from bench.station.shutdown_sequence import Item, ShutdownAction, method_of
from drivers.interfaces import Clock, OverloadError, Reading, Role, SetpointError
from drivers.interfaces.declarations import declarations

_WHAT: Mapping[ShutdownAction, str] = {
    ShutdownAction.VOLTAGE_DECAYED: "the voltage",
    ShutdownAction.CURRENT_ZERO: "the current",
    ShutdownAction.SPEED_ZERO: "the speed",
}
#: How often (s) a measuring item looks.
_LOOK = 0.05
#: Full scales (V) asked of a voltmeter, the first that it has: there are models that end at 60 V.
_FULL_SCALES = (100.0, 50.0, 20.0, 10.0, 5.0, 2.0)


class Hurry(Protocol):
    """A flag that is set once nobody waits any more."""

    def is_set(self) -> bool:
        """Say so."""


@dataclass(frozen=True)
class Measured:
    """Final reading of a measuring item."""

    value: float
    unit: str


class NotReachedError(Exception):
    """The measured quantity did not reach its condition in time."""

    def __init__(self, found: Measured, message: str) -> None:
        self.found = found
        super().__init__(message)


def perform(one: Item, instrument: Any, clock: Clock, hurry: Hurry) -> Measured | None:
    """Do an item to its instrument; return what was measured, if it measures.

    With `hurry` set, a measuring item looks once. Raises what the driver raises, NotReachedError for a value that is
    still too large.
    """
    if one.measures:
        return _await(one, instrument, clock, hurry)
    getattr(instrument, method_of(one.do, one.role))()
    return None


def measured(one: Item, instrument: Any) -> Measured:
    """Measure once what a measuring item looks at. Raises what the driver raises, InstrumentError for another unit than is declared."""
    if one.do is ShutdownAction.VOLTAGE_DECAYED:
        if one.role is Role.VOLTMETER:
            _widest_range(instrument, one.below)
        return Measured(_read(one.role, instrument, "measure_voltage"), "V")
    if one.do is ShutdownAction.CURRENT_ZERO:
        return Measured(_read(one.role, instrument, "measure_current"), "A")
    if one.role is Role.DYNAMOMETER:
        return Measured(abs(instrument.measure().speed), "rad/s")
    if one.role is Role.TACHOMETER:
        return Measured(_read(one.role, instrument, "measure_speed"), "rad/s")
    return Measured(_read(one.role, instrument, "measure_frequency") * 2.0 * math.pi, "rad/s")


def _widest_range(voltmeter: Any, least: float) -> None:
    """Set a range for whatever may still be on the leads: the last measurement's may be of millivolts.

    Raises SetpointError where none holds `least` (V).
    """
    for full_scale in (full for full in _FULL_SCALES if full > least):
        try:
            voltmeter.configure(full_scale)
        except SetpointError:
            continue
        return
    voltmeter.configure(least)


def _read(role: Role, instrument: Any, method: str) -> float:
    reading: Reading = getattr(instrument, method)()
    # Kilovolts taken for volts would pass for harmless.
    unit_check(role.value, type(instrument).__name__, method, declarations(role.interface)[method].unit)(reading)
    return abs(reading.value)


def _await(one: Item, instrument: Any, clock: Clock, hurry: Hurry) -> Measured:
    deadline = clock.now() + one.within
    while True:
        last = hurry.is_set() or clock.now() >= deadline
        try:
            result = measured(one, instrument)
        except OverloadError:
            # More than the widest range holds: it may come down yet.
            if last:
                raise
        else:
            if result.value <= one.below:
                return result
            if last:
                waited = "" if hurry.is_set() else f" after {one.within:g} s"
                what = _WHAT[one.do]
                raise NotReachedError(
                    result,
                    f"{what} is {result.value:.4g} {result.unit}{waited}; at most {one.below:g} {result.unit} is safe",
                )
        clock.sleep(_LOOK)
