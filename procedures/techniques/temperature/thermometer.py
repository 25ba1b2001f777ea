"""The thermometer on the winding: read once as long as nothing warms it, and one error behind all that it says."""

import math

from GTC.lib import UncertainReal

from procedures.core.budget import Uncertainties

#: A reading older than this (s) is taken anew: the room may have changed.
_STALE = 1800.0
#: What a room, and a winding that nothing has warmed, is usually at (°C); from one reading to the next it changes by this (K) at most.
USUAL, _CHANGE = (5.0, 45.0), 10.0
#: The hottest (°C) that a winding is where its motor states no limit: insulation of class F.
_HOTTEST = 155.0


class Thermometer:
    """The last reading of the winding's temperature, with its time.

    The same thermometer reads it every time, so its error is one input for all resistances and fluxes of a run.
    """

    def __init__(self, uncertainties: Uncertainties) -> None:
        self._uncertainties = uncertainties
        self._inputs: dict[float, UncertainReal] = {}
        self._last: tuple[float, float] | None = None
        self._hidden: tuple[UncertainReal, float] | None = None
        self._earlier: float | None = None
        self._warm = False
        #: Between which temperatures (°C) the last reading was expected to be, where it is not and was confirmed.
        self.unlike: tuple[float, float] | None = None

    def known(self, now: float) -> float | None:
        """Return the last reading (°C), None where there is none, it is old, or a current has warmed the winding since."""
        if self._last is None or now - self._last[1] > _STALE:
            return None
        return self._last[0]

    def warmed(self) -> None:
        """Forget the last reading: a current flows that warms the winding."""
        self._last = self._hidden = None
        self._warm = True

    def hides(self, kelvin: float, now: float) -> UncertainReal:
        """Return by how much (K) the winding is warmer than the thermometer shows: `kelvin` at most, as of `now` (s).

        Readings soon after have it too.
        """
        hidden = self._uncertainties.one_sided("warmth that the thermometer does not show", 0.0, kelvin)
        self._hidden = hidden, now
        return hidden

    def usual(self, limit: float | None) -> tuple[float, float]:
        """Return between which temperatures (°C) a reading is no surprise, by what was read before and whether a current has flowed since.

        `limit` (°C) is the motor's, where it is stated.
        """
        low, high = USUAL
        if self._earlier is not None:
            low, high = (
                self._earlier - _CHANGE if self._earlier <= high else low,
                self._earlier + _CHANGE if self._earlier >= low else high,
            )
        return low, max(high, _HOTTEST if limit is None else limit) if self._warm else high

    def take(self, celsius: float, half_width: float, now: float) -> UncertainReal:
        """Keep a reading (°C), known within ± `half_width` (K) and taken at `now` (s), and return it with its uncertainty.

        What is known less well than the thermometer reads (magnets taken to be as warm as the winding) has an input of its own besides.
        """
        self._last, self._earlier, self._warm = (celsius, now), celsius, False
        finest = min(self._inputs, default=half_width)
        if finest > half_width or not self._inputs:
            finest = half_width
            self._inputs[finest] = self._uncertainties.limit("winding temperature", celsius, finest)
        first = self._inputs[finest]
        reading: UncertainReal = first + (celsius - float(first.x))
        if half_width > finest:
            beyond = math.sqrt(half_width**2 - finest**2)
            reading = reading + self._uncertainties.limit("temperature beside the thermometer's", 0.0, beyond)
        if self._hidden is not None and now - self._hidden[1] <= _STALE:
            reading = reading + self._hidden[0]
        return reading
