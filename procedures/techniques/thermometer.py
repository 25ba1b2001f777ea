"""The thermometer on the winding: read once as long as nothing warms it, and one error behind all that it says."""

import math

from GTC.lib import UncertainReal

from procedures.core.budget import Uncertainties

#: A reading older than this (s) is taken anew: the room may have changed.
_STALE = 1800.0


class Thermometer:
    """What was last read of the winding's temperature, and when.

    The same thermometer reads it every time, so its error is one input for all resistances and fluxes of a run.
    """

    def __init__(self, uncertainties: Uncertainties) -> None:
        self._uncertainties = uncertainties
        self._inputs: dict[float, UncertainReal] = {}
        self._last: tuple[float, float] | None = None

    def known(self, now: float) -> float | None:
        """Return the last reading (°C), None where there is none, it is old, or a current has warmed the winding since."""
        if self._last is None or now - self._last[1] > _STALE:
            return None
        return self._last[0]

    def warmed(self) -> None:
        """Forget the last reading: a current flows that warms the winding."""
        self._last = None

    def take(self, celsius: float, half_width: float, now: float) -> UncertainReal:
        """Keep a reading (°C), known within ± `half_width` (K) and taken at `now` (s), and return it with its uncertainty.

        What is known less well than the thermometer reads (magnets taken to be as warm as the winding) has an input of its own besides.
        """
        self._last = celsius, now
        finest = min(self._inputs, default=half_width)
        if finest > half_width or not self._inputs:
            finest = half_width
            self._inputs[finest] = self._uncertainties.limit("winding temperature", celsius, finest)
        first = self._inputs[finest]
        reading: UncertainReal = first + (celsius - float(first.x))
        if half_width > finest:
            beyond = math.sqrt(half_width**2 - finest**2)
            reading = reading + self._uncertainties.limit("temperature beside the thermometer's", 0.0, beyond)
        return reading
