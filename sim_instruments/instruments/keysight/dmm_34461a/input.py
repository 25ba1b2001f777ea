"""Input at the 34461A's terminals while it measures: from the bench's wiring to the quantity of a function."""

import math
from typing import TYPE_CHECKING

import numpy as np

from sim_instruments.instruments.keysight.dmm_34461a.functions import FRES, TEST_CURRENTS, Function

if TYPE_CHECKING:
    from sim_instruments.world.world import World

#: Both test leads of a two-wire measurement (Ω); a four-wire one does not see them.
TWO_WIRE_LEADS = 0.06
#: Points of a window; spread evenly with a golden-ratio jitter, which no frequency falls in step with.
_POINTS = 1 << 14
_GOLDEN = 0.6180339887498949
#: The peak (share of the range) that the converter takes, and among how many points it is looked for.
SATURATION = 1.5
_PEAK_POINTS = 256
#: The least signal that is counted, as a share of the range.
_SENSITIVITY = 0.1


class InputTerminals:
    """HI and LO with their sense wires, all on the bench's Kelvin leads; the current terminals are on nothing."""

    def __init__(self, world: "World") -> None:
        self._world = world

    def voltage(self, aperture: float, until: float | None = None) -> float:
        """Return the mean voltage (V) over the `aperture` s before `until` (s; now). Raises ValueError as the world does."""
        return self._world.voltmeter_voltage(aperture, until)

    def peak(self, aperture: float, until: float | None = None) -> float:
        """Return the largest absolute value (V) of the voltage over the `aperture` s before `until` (s; now)."""
        end = self._world.clock.now() if until is None else until
        return float(np.abs(self._world.voltmeter_signal(np.linspace(end - aperture, end, _PEAK_POINTS))).max())

    def resistance(self, function: Function, full_scale: float, aperture: float, until: float | None = None) -> float:
        """Return an ohmmeter's reading (Ω) at its terminals, in which every voltage is attributed to the test current.

        Infinite where a peak of it is beyond the range, though the mean may not be.
        """
        between, clamps = self._world.voltmeter_resistance(aperture, until)
        own = 0.0 if function is FRES else clamps + TWO_WIRE_LEADS
        current = TEST_CURRENTS[function.ranges.index(full_scale) if function.ranges[0] == 100.0 else 1]
        if self.peak(aperture, until) / current > SATURATION * full_scale:
            return math.inf
        return between + own + self._world.voltmeter_voltage(aperture, until) / current

    def rms(self, window: float, until: float | None = None) -> float:
        """Return the RMS (V) of the voltage without its mean over the `window` s before `until` (s; now)."""
        times, weights = _spread(window, self._world.clock.now() if until is None else until)
        voltage = self._world.voltmeter_signal(times)
        mean = float(weights @ voltage)
        return math.sqrt(max(float(weights @ (voltage - mean) ** 2), 0.0))

    def frequency(self, gate: float, until: float, full_scale: float) -> float:
        """Return the frequency (Hz) of the voltage over the `gate` s before `until` (s), 0 where there is too little of it."""
        times = until - gate + gate * np.linspace(0.0, 1.0, 8 * _POINTS)
        voltage = self._world.voltmeter_signal(times)
        voltage = voltage - 0.5 * (voltage.max() + voltage.min())
        if voltage.max() < _SENSITIVITY * full_scale:
            return 0.0
        low = voltage < 0.0
        rising = np.flatnonzero(low[:-1] & ~low[1:])
        if len(rising) < 2:
            return 0.0
        share = voltage[rising] / (voltage[rising] - voltage[rising + 1])
        crossings = times[rising] + share * (times[1] - times[0])
        return (len(crossings) - 1) / float(crossings[-1] - crossings[0])


def _spread(window: float, until: float) -> tuple[np.ndarray, np.ndarray]:
    """Return times in a window, and Hann's weights: the window need not hold whole periods."""
    number = np.arange(_POINTS)
    place = (number + (number * _GOLDEN) % 1.0) / _POINTS
    weights = np.sin(math.pi * place) ** 2
    return until - window * (1.0 - place), weights / weights.sum()
