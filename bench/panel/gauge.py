"""A value that a hand is to reach: the set point that was asked for, its band, the present reading, and whether it is inside."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

from bench.panel.live.live_view import LiveView, WantedValue
from drivers.interfaces.text import Text, text
from procedures.core.live_plot import Gauge

#: A hand sets no closer than this share; what is evaluated is what is read, not what was asked for.
BAND = 0.05
#: The band's share of the gauge's length, in its middle.
_SHARE = 0.4
#: Units that people read an instrument's display in.
_SHOWN = {"rad/s": ("rpm", math.pi / 30.0)}


class Place(Enum):
    """The place of a reading relative to its limits."""

    INSIDE = "inside"
    LOW = "low"
    HIGH = "high"
    UNREAD = "unread"


@dataclass(frozen=True)
class ShownGauge:
    """A gauge as it is drawn: the band from `low` to `high` and the reading `at`, in per cent of its length."""

    place: Place
    low: float
    high: float
    at: float
    reading: str
    band: str
    verdict: Text


def gauge_of(
    view: LiveView,
    question: Mapping[str, Any] | None,
    sources: Sequence[Mapping[str, Any]],
    *,
    old: bool = False,
    typed: float | None = None,
) -> Gauge | None:
    """Return the gauge that belongs to what a person is asked, None where there is none.

    A set point that the person is bringing about, where the run's `sources` read its quantity back; or one whose reading is asked for:
    then with what is `typed` so far, in the unit asked for. What was read back is no reading any more once it is `old`.
    """
    if question is None:
        return None
    if question["kind"] == "number":
        for point in view.set_points.values():
            unit, factor = _SHOWN.get(point.unit, (point.unit, 1.0))
            if unit == question["unit"] and not point.pending:
                return _gauge(point, unit, factor, None if typed is None else typed * factor)
    if question["kind"] == "confirm":
        read = {unit: value for one in sources for value, unit in one["values"]}
        for point in view.set_points.values():
            if point.pending and point.instrument == question["instrument"] and point.unit in read:
                value = None if old else read[point.unit]
                return _gauge(point, *_SHOWN.get(point.unit, (point.unit, 1.0)), value)
    return None


def _gauge(point: WantedValue, unit: str, factor: float, value: float | None) -> Gauge | None:
    wanted = point.value / factor
    if not wanted:
        return None
    low, high = sorted(((1.0 - BAND) * wanted, (1.0 + BAND) * wanted))
    return Gauge(point.quantity, unit, low, high, None if value is None else value / factor)


def shown_gauge(gauge: Gauge) -> ShownGauge:
    """Return how a gauge is drawn and told; outside is said in words and by the place, not by colour alone."""
    width = gauge.high - gauge.low
    edges = 50.0 * (1.0 - _SHARE), 50.0 * (1.0 + _SHARE)
    band = f"{_figure(gauge.low, width)} … {_figure(gauge.high, width)} {gauge.unit}"
    if gauge.value is None or not math.isfinite(gauge.value):
        return ShownGauge(Place.UNREAD, *edges, 50.0, "–", band, text("no reading"))
    at = 50.0 + 100.0 * _SHARE * (gauge.value - 0.5 * (gauge.low + gauge.high)) / width
    reading = f"{_figure(gauge.value, width)} {gauge.unit}"
    place, verdict = Place.INSIDE, text("✓ inside")
    if gauge.value < gauge.low:
        missing = _figure(gauge.low - gauge.value, width)
        place, verdict = Place.LOW, text("▲ too low: {amount} {unit} more", amount=missing, unit=gauge.unit)
    elif gauge.value > gauge.high:
        excess = _figure(gauge.value - gauge.high, width)
        place, verdict = Place.HIGH, text("▼ too high: {amount} {unit} less", amount=excess, unit=gauge.unit)
    return ShownGauge(place, *edges, min(max(at, 0.0), 100.0), reading, band, verdict)


def _figure(value: float, width: float) -> str:
    """Return a figure to a hundredth of the band's width or so."""
    decimals = max(0, 1 - math.floor(math.log10(width))) if width > 0.0 else 2
    return f"{value:.{min(decimals, 6)}f}".replace("-", "−")
