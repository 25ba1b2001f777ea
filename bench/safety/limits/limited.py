"""What all instruments behind limits have: their bounds, and how set points and readings are held against them."""

import math
from collections.abc import Callable
from typing import Any

from bench.safety.limits.bounds import Limit, Limits, Observer, Quantity, check_reading, check_set_point
from drivers.interfaces import Reading

#: Gives the number of pole pairs, None where nobody knows it yet.
PolePairs = Callable[[], int | None]


class Limited:
    """An instrument behind its limits; what it does not check it passes on."""

    def __init__(self, instrument: Any, name: str, limits: Limits, pole_pairs: PolePairs, observe: Observer) -> None:
        self._instrument = instrument
        self._name = name
        self._bounds = {quantity: limits.bound(quantity) for quantity in Quantity}
        self._reading_bounds = {quantity: limits.reading_bound(quantity) for quantity in Quantity}
        self._pole_pairs = pole_pairs
        self._observe = observe

    def __getattr__(self, attribute: str) -> Any:
        return getattr(self._instrument, attribute)

    def _bound(self, quantity: Quantity) -> Limit:
        return self._bounds[quantity]

    def _check(self, call: str, parameter: str, value: float, unit: str, limit: Limit, *, signed: bool = False) -> None:
        check_set_point(self._name, call, parameter, value, unit, limit, signed=signed, observe=self._observe)

    def _held(self, parameter: str, reading: Reading, quantity: Quantity) -> Reading:
        check_reading(self._name, parameter, reading.value, reading.unit, self._reading_bounds[quantity])
        return reading

    def _held_frequency(self, reading: Reading) -> Reading:
        """Hold an electrical frequency against its own limit and, where the pole pairs are known, against the speed's."""
        pairs = self._pole_pairs()
        if pairs is not None:
            limit = as_frequency(self._reading_bounds[Quantity.SPEED], pairs)
            check_reading(self._name, "frequency", reading.value, reading.unit, limit)
        return self._held("frequency", reading, Quantity.FREQUENCY)


def as_frequency(speed: Limit, pole_pairs: int | None) -> Limit:
    """Return a limit of mechanical speed (rad/s) as one of electrical frequency (Hz).

    With a single pole pair a frequency means the highest speed that it can, so that is taken where the number is not known.
    """
    words = "pole pairs unknown: 1 taken" if pole_pairs is None else f"{pole_pairs} pole pairs"
    return Limit(speed.value / (2.0 * math.pi) * (pole_pairs or 1), f"{speed.owner}, {words}")
