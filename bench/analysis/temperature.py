"""The temperature of winding and magnets while a capture was taken."""

import math
from dataclasses import dataclass

from bench.i18n.errors import UsageError
from drivers.interfaces.text import text


@dataclass(frozen=True)
class Temperature:
    """Temperature (°C) known within ± `half_width` (K), all values in it equally likely; `coefficient` (1/K) is the
    copper's at 20 °C, or the magnets' at 25 °C.
    """

    celsius: float
    half_width: float
    coefficient: float


def copper_temperature(celsius: float | None, half_width: float | None, coefficient: float) -> Temperature | None:
    """Return the winding's temperature, or None where none is given. Raises UsageError naming option and what is allowed."""
    _within("copper-coefficient", coefficient, 0.0, 0.01, "1/K")
    return _known(celsius, half_width, coefficient)


def magnet_temperature(celsius: float | None, half_width: float | None, coefficient: float) -> Temperature | None:
    """Return the magnets' temperature, or None where none is given. Raises UsageError naming option and what is allowed."""
    _within("magnet-coefficient", coefficient, -0.01, 0.0, "1/K")
    return _known(celsius, half_width, coefficient)


def _known(celsius: float | None, half_width: float | None, coefficient: float) -> Temperature | None:
    if celsius is None:
        if half_width is not None:
            raise UsageError(
                text("--temperature-uncertainty {half_width:g}: give --temperature too, °C", half_width=half_width)
            )
        return None
    half_width = 2.0 if half_width is None else half_width
    _within("temperature", celsius, -60.0, 250.0, "°C")
    _within("temperature-uncertainty", half_width, 0.0, 50.0, "K, a half-width")
    return Temperature(celsius, half_width, coefficient)


def _within(option: str, value: float, low: float, high: float, unit: str) -> None:
    if not (math.isfinite(value) and low <= value <= high):
        raise UsageError(
            text(
                "--{option} {value:g}: allowed is a number from {low:g} to {high:g} {unit}",
                option=option,
                value=value,
                low=low,
                high=high,
                unit=unit,
            )
        )
