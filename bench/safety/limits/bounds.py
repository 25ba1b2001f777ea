"""Limits of each quantity of an instrument, and whether they are the motor's or the station's."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from drivers.interfaces import LimitError, Role, SetpointError
from drivers.interfaces.declarations import Amount, Quantity, quantities
from drivers.interfaces.text import Text, text
from procedures.core.nameplate import Nameplate
from procedures.core.result import Parameter

#: A reading is beyond a limit from here on (times the limit): a regulated quantity overshoots, and meters have errors.
OVERSHOOT = 1.05

RPM = 2.0 * math.pi / 60.0


@dataclass(frozen=True)
class Limit:
    """A bound in SI units and whose it is."""

    value: float
    owner: Text


NO_LIMIT = Limit(math.inf, text("every instrument: a set point must be a finite number"))


@dataclass(frozen=True)
class SetPoint:
    """One quantity that an instrument was asked to take: value and the bound that holds for it, whose it is, and whether it may."""

    instrument: str
    call: str
    parameter: str
    value: float
    unit: str
    bound: float
    owner: Text
    allowed: bool


Observer = Callable[[SetPoint], None]


def nobody(_: SetPoint) -> None:
    """Hear nothing."""


@dataclass(frozen=True)
class Limits:
    """The limits of one instrument: the motor's on set points, on readings, and the station's on both.

    A rated figure of the plate bounds set points where it names no maximum; readings are held against maxima only,
    for a motor under test may well run beyond its rating by itself.
    """

    set_points: Mapping[Quantity, Limit] = field(default_factory=dict)
    readings: Mapping[Quantity, Limit] = field(default_factory=dict)
    station: Mapping[Quantity, Limit] = field(default_factory=dict)

    def bound(self, quantity: Quantity) -> Limit:
        """Return the least limit of a set point."""
        return _least(self.set_points.get(quantity), self.station.get(quantity))

    def reading_bound(self, quantity: Quantity) -> Limit:
        """Return the least limit of a reading."""
        return _least(self.readings.get(quantity), self.station.get(quantity))


def _least(*limits: Limit | None) -> Limit:
    return min((limit for limit in limits if limit is not None), key=lambda limit: limit.value, default=NO_LIMIT)


def limits_of(role: Role, nameplate: Nameplate, station: Mapping[str, float]) -> Limits:
    """Return the limits of the instrument in a role; `station` is its table of limits in the station file, by key."""
    by_key = {quantity.limit_key: quantity for quantity in quantities(role.interface)}
    by_station = {
        by_key[key]: Limit(value, text("the station ({key})", key=f"instruments.{role.value}.limits.{key}"))
        for key, value in station.items()
    }
    return Limits(_of_set_points(nameplate), _of_readings(nameplate), by_station)


def _of_insulation(plate: Nameplate) -> Limit:
    # No figure for the winding itself says what its insulation bears.
    allowed = plate.insulation_test_voltage
    if allowed is None:
        return Limit(0.0, text("the motor: its file gives no nameplate.insulation_test_voltage"))
    return Limit(allowed, _motor("insulation_test_voltage"))


def _of_set_points(plate: Nameplate) -> dict[Quantity, Limit]:
    result = {
        Quantity.CURRENT: Limit(plate.current_bound, _bounding("current", plate.maximum_current)),
        Quantity.INSULATION_VOLTAGE: _of_insulation(plate),
    }
    if plate.voltage_bound is not None:
        result[Quantity.VOLTAGE] = Limit(plate.voltage_bound, _bounding("voltage", plate.maximum_voltage))
    if plate.speed_bound_rpm is not None:
        result[Quantity.SPEED] = Limit(plate.speed_bound_rpm * RPM, _bounding("speed_rpm", plate.maximum_speed_rpm))
    return result


def _of_readings(plate: Nameplate) -> dict[Quantity, Limit]:
    result = {}
    for quantity, key, value, scale in (
        (Quantity.CURRENT, "current", plate.maximum_current, 1.0),
        (Quantity.VOLTAGE, "voltage", plate.maximum_voltage, 1.0),
        (Quantity.SPEED, "speed_rpm", plate.maximum_speed_rpm, RPM),
    ):
        if value is not None:
            result[quantity] = Limit(value * scale, _bounding(key, value))
    return result


def _bounding(quantity: str, maximum: float | None) -> Text:
    return _motor(f"{'maximum' if maximum is not None else 'rated'}_{quantity}")


def _motor(key: str) -> Text:
    return text("the motor ({key})", key=f"nameplate.{key}")


def known_pole_pairs(nameplate: Nameplate, measured: Mapping[str, Parameter]) -> int | None:
    """Return the number of pole pairs by measurement and by the plate, the smaller where they differ, None without either.

    The smaller makes the higher speed of a frequency.
    """
    result = [nameplate.pole_pairs] if nameplate.pole_pairs is not None else []
    if "pole_pairs" in measured:
        result.append(max(1, round(measured["pole_pairs"].value)))
    return min(result, default=None)


def check_set_point(instrument: str, call: str, amount: Amount, value: float, limit: Limit, observe: Observer) -> None:
    """Tell the observer of a set point, and raise SetpointError where it is beyond the limit or no finite number."""
    low = -limit.value if amount.signed else 0.0
    allowed = math.isfinite(value) and low <= value <= limit.value
    observe(SetPoint(instrument, call, amount.label, value, amount.unit, limit.value, limit.owner, allowed))
    if not allowed:
        raise SetpointError(instrument, amount.label, value, amount.unit, low, limit.value, limit.owner)


def check_reading(instrument: str, amount: Amount, value: float, limit: Limit) -> None:
    """Raise LimitError where a reading's size is beyond the limit by more than an overshoot."""
    if abs(value) > OVERSHOOT * limit.value:
        raise LimitError(instrument, amount.label, value, amount.unit, limit.value, limit.owner)
