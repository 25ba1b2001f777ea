"""A record of a turning machine folded into one turn, or two: sums over parts of it say of its orders what all readings say."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from procedures.estimation.emf.harmonics import HarmonicModel
from procedures.estimation.fitting.fit import FloatArray

#: Parts of a turn: within one, a wave of the 41st order turns by a quarter of a radian, and loses 0.3 % of its size.
PARTS = 1024


@dataclass(frozen=True)
class Folded:
    """Sums over the readings of each part of a turn: how many there are, their speeds (rad/s), the speeds' squares, (P,); the values (C, P)
    and the values by their speeds.
    """

    counts: FloatArray
    rates: FloatArray
    powers: FloatArray
    sums: FloatArray
    weighted: FloatArray

    @classmethod
    def over(cls, time: FloatArray, values: FloatArray, model: HarmonicModel, turns: int = 1) -> "Folded":
        """Fold values (C, n) at times (s) along the model's course, into so many turns."""
        size = turns * PARTS
        part = np.floor(model.phase(time) * (PARTS / (2.0 * np.pi))).astype(np.intp) % size
        counts = np.bincount(part, minlength=size).astype(np.float64)
        sums = np.array([np.bincount(part, row, minlength=size) for row in values])
        if model.course.size == 2:
            steady = float(model.course[1]) / model.half
            return cls(counts, steady * counts, steady**2 * counts, sums, steady * sums)
        rate = model.speed(time)
        rates, powers = (np.bincount(part, row, minlength=size).astype(np.float64) for row in (rate, rate**2))
        return cls(
            counts, rates, powers, sums, np.array([np.bincount(part, rate * row, minlength=size) for row in values])
        )

    def products(self, basis: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the normal matrix of offset and flux linkages, whose voltages are the speed's times `basis` (2H, P), and the products of
        the values with them (C, 1 + 2H).
        """
        normal = np.empty((1 + len(basis), 1 + len(basis)))
        normal[0, 0] = self.counts.sum()
        normal[0, 1:] = normal[1:, 0] = basis @ self.rates
        normal[1:, 1:] = (basis * self.powers) @ basis.T
        return normal, np.column_stack((self.sums.sum(axis=1), self.weighted @ basis.T))

    def left(self, values: FloatArray, basis: FloatArray) -> FloatArray:
        """Return the sums (C, P) of what offset and flux linkages (C, 1 + 2H) leave."""
        return np.asarray(self.sums - values[:, :1] * self.counts - (values[:, 1:] @ basis) * self.rates)


@lru_cache(maxsize=8)
def flux_waves(orders: tuple[int, ...], turns: int = 1) -> FloatArray:
    """Return by what real and imaginary flux linkages of these orders make the voltage at a speed of 1 rad/s, (2H, P)."""
    centre = (np.arange(turns * PARTS) + 0.5) * (2.0 * np.pi / PARTS)
    angle = np.outer(orders, centre)
    waves = -np.array(orders)[:, None] * np.concatenate((np.sin(angle), np.cos(angle))).reshape(2, len(orders), -1)
    result: FloatArray = waves.reshape(2 * len(orders), -1)
    result.flags.writeable = False
    return result
