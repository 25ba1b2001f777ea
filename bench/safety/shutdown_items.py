"""How each item of a shutdown sequence is done to its instrument."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from bench.safety.limits.units import unit_check
from bench.station.shutdown_sequence import Do, Item, method_of
from drivers.interfaces import Clock, Reading, Role
from drivers.interfaces.declarations import declarations

_WHAT: Mapping[Do, str] = {
    Do.VOLTAGE_DECAYED: "the voltage",
    Do.CURRENT_ZERO: "the current",
    Do.SPEED_ZERO: "the speed",
}
#: How often (s) a measuring item looks.
_LOOK = 0.05


class Hurry(Protocol):
    """Whether nobody waits any more."""

    def is_set(self) -> bool:
        """Say so."""


@dataclass(frozen=True)
class Measured:
    """What a measuring item found in the end."""

    value: float
    unit: str


class NotReachedError(Exception):
    """What was to be measured did not come about in time."""

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
    if one.do is Do.VOLTAGE_DECAYED:
        if one.role is Role.VOLTMETER:
            # Its range is whatever the last measurement needed, millivolts perhaps.
            instrument.configure(max(100.0, one.below))
        return Measured(_read(one.role, instrument, "measure_voltage"), "V")
    if one.do is Do.CURRENT_ZERO:
        return Measured(_read(one.role, instrument, "measure_current"), "A")
    if one.role is Role.DYNAMOMETER:
        return Measured(abs(instrument.measure().speed), "rad/s")
    if one.role is Role.TACHOMETER:
        return Measured(_read(one.role, instrument, "measure_speed"), "rad/s")
    return Measured(_read(one.role, instrument, "measure_frequency") * 2.0 * math.pi, "rad/s")


def _read(role: Role, instrument: Any, method: str) -> float:
    reading: Reading = getattr(instrument, method)()
    # Kilovolts taken for volts would pass for harmless.
    unit_check(role.value, type(instrument).__name__, method, declarations(role.interface)[method].unit)(reading)
    return abs(reading.value)


def _await(one: Item, instrument: Any, clock: Clock, hurry: Hurry) -> Measured:
    deadline = clock.now() + one.within
    while not (result := measured(one, instrument)).value <= one.below:
        if hurry.is_set() or clock.now() >= deadline:
            waited = "" if hurry.is_set() else f" after {one.within:g} s"
            what = _WHAT[one.do]
            raise NotReachedError(
                result,
                f"{what} is {result.value:.4g} {result.unit}{waited}; at most {one.below:g} {result.unit} is safe",
            )
        clock.sleep(_LOOK)
    return result
