"""A quantity of a linear circuit over time: a constant, a ramp and decaying exponentials."""

import math
import sys
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from sim_instruments.physics.circuits.windings import FloatArray


@dataclass(frozen=True)
class Exponentials:
    """The sum constant + ramp·τ + Σ amplitude·exp(−rate·τ), τ being the time (s) since `start`; rates in 1/s."""

    start: float
    constant: float
    ramp: float
    amplitudes: FloatArray
    rates: FloatArray

    def at(self, times: FloatArray) -> FloatArray:
        """Return the values at n times (s), from the start on."""
        passed = np.maximum(times - self.start, 0.0)
        result: FloatArray = self.amplitudes @ np.exp(-self.rates[:, np.newaxis] * passed)
        result += self.constant
        return result + self.ramp * passed if self.ramp else result

    @property
    def rounding(self) -> float:
        """The largest rounding error of a value, near the start."""
        return 8.0 * sys.float_info.epsilon * (abs(self.constant) + float(np.abs(self.amplitudes).sum()))

    def passing(self, level: float, sense: int, until: float) -> float | None:
        """Return when (s, until `until`) the sum passes a level upwards, or with `sense` −1 downwards; infinite for never.

        None where it may turn back, or begins beyond the level.
        """
        speeds = sense * self.amplitudes * self.rates
        if self.ramp or (speeds > 0.0).any():
            return None
        terms: list[tuple[float, float]] = list(
            zip((sense * self.amplitudes).tolist(), self.rates.tolist(), strict=True)
        )
        missing = sense * (self.constant - level)

        def excess(passed: float) -> float:
            return missing + sum(amplitude * math.exp(-rate * passed) for amplitude, rate in terms)

        if excess(0.0) > 0.0:
            return None
        last = min(until - self.start, 40.0 / float(self.rates.min())) if terms else 0.0
        if last <= 0.0 or excess(last) <= 0.0:
            return math.inf
        return self.start + float(brentq(excess, 0.0, last, xtol=1e-15, rtol=8.9e-16))

    def stays_below(self, level: float, sense: int = 1) -> bool:
        """Say whether the sum certainly stays below a level, or with `sense` −1 above it; with a ramp nothing is certain."""
        most = sense * self.constant + float(np.maximum(sense * self.amplitudes, 0.0).sum())
        return self.ramp == 0.0 and most < sense * level
