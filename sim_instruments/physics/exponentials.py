"""A quantity of a linear circuit over time: a constant, a ramp and decaying exponentials."""

import sys
from dataclasses import dataclass

import numpy as np

from sim_instruments.physics.windings import FloatArray


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
        """What rounding makes of a value at most, near the start."""
        return 8.0 * sys.float_info.epsilon * (abs(self.constant) + float(np.abs(self.amplitudes).sum()))

    def stays_below(self, level: float, sense: int = 1) -> bool:
        """Say whether the sum certainly stays below a level, or with `sense` −1 above it; with a ramp nothing is certain."""
        most = sense * self.constant + float(np.maximum(sense * self.amplitudes, 0.0).sum())
        return self.ramp == 0.0 and most < sense * level
