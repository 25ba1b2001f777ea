"""Checks of set points that a driver makes before it sends anything."""

import math
from collections.abc import Mapping
from typing import TypeVar

from drivers.interfaces import SetpointError, Slope
from drivers.interfaces.text import Text, text

T = TypeVar("T")

SLOPES = {Slope.RISING: text("rising"), Slope.FALLING: text("falling"), Slope.EITHER: text("rising or falling")}


def check_setpoint(
    instrument: str, parameter: Text | str, value: float, unit: str, low: float, high: float, whose: Text | str
) -> None:
    """Raise SetpointError, which names the limit and whose it is, for a value that is not finite and within `low` … `high` (`unit`)."""
    if not (math.isfinite(value) and low <= value <= high):
        raise SetpointError(instrument, parameter, value, unit, low, high, whose)


def probe_on(instrument: str, channel: int, probes: Mapping[int, T]) -> T:
    """Return the probe on a channel; raises SetpointError where the station puts none there."""
    try:
        return probes[channel]
    except KeyError:
        known = sorted(probes)
        low, high = (known[0], known[-1]) if known else (0, 0)
        raise SetpointError(
            instrument, "channel", channel, "", low, high, "the station (channels with a probe)"
        ) from None


def lesser(own: float, station: float | None) -> tuple[float, Text]:
    """Return the smaller of the model's and the station's limit, and whose it is."""
    if station is not None and station < own:
        return station, text("the station")
    return own, text("the model")


def step_up(value: float) -> float:
    """Return the least of 1, 2 and 5 times the powers of ten that is not below a value above 0: the steps of most front panels."""
    decade = 10.0 ** math.floor(math.log10(value))
    return next(step for step in (decade, 2 * decade, 5 * decade, 10 * decade) if step >= value * (1 - 1e-9))
