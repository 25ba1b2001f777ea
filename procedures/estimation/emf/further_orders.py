"""Finds further harmonics of a waveform in the residuals of a fit, and subtracts them."""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy import special

from procedures.estimation.emf.folding import Folded, flux_waves
from procedures.estimation.emf.harmonics import HarmonicModel, waveforms
from procedures.estimation.fitting.fit import FloatArray

#: The highest order that is looked for: slots and skew leave little above.
_HIGHEST = 41
#: An order counts where chance would show any as large in fewer records than this.
_CHANCE = 1e-3
#: Readings for each column of the least squares.
_READINGS = 8


def further_orders(
    time: FloatArray, residuals: FloatArray, model: HarmonicModel, orders: Sequence[int]
) -> tuple[Mapping[int, FloatArray], FloatArray]:
    """Return amplitudes (V, peak, one a channel) of orders not among `orders` that residuals (C, n), V, hold, and what they leave.

    Over whole periods they are at right angles to those fitted: estimates stay as they are.
    """
    turns = float(model.course[1]) / np.pi
    most = min(_HIGHEST, int(0.45 * time.size / turns), time.size // (2 * _READINGS) - 1)
    looked = [order for order in range(2, most + 1) if order not in orders]
    if not looked or turns < 1.0:
        return {}, residuals
    normal, along = Folded.over(time, residuals, model).products(flux_waves(tuple(looked)))
    found = np.flatnonzero(_significant(normal, along, residuals))
    if not found.size:
        return {}, residuals
    rows = np.concatenate(([0], 1 + found, 1 + len(looked) + found))
    values = _solved(normal[np.ix_(rows, rows)], along[:, rows])
    speed = float(model.speed(np.array([model.middle]))[0])
    flux = np.hypot(values[:, 1 : 1 + found.size], values[:, 1 + found.size :])
    left = residuals - waveforms(model, [looked[k] for k in found], values, time)
    return {looked[order]: looked[order] * speed * flux[:, k] for k, order in enumerate(found)}, left


def _solved(normal: FloatArray, along: FloatArray) -> FloatArray:
    """Return the least squares (C, m) of a normal matrix whose columns may be of very different size, and of products (C, m) with it."""
    size = np.sqrt(np.diag(normal))
    return np.asarray(np.linalg.solve(normal / np.outer(size, size), (along / size).T).T / size, dtype=np.float64)


def _significant(normal: FloatArray, along: FloatArray, residuals: FloatArray) -> FloatArray:
    """Tell of each order whether its part of all channels together is beyond noise."""
    values = _solved(normal, along)
    left = np.einsum("cn,cn->c", residuals, residuals) - np.sum(values * along, axis=1)
    variance = left / (residuals.shape[1] - normal.shape[0])
    # Orders hardly overlap over a period or more: each sine's square over its variance is chi-squared of one degree.
    squares = np.sum(values**2 * np.diag(normal) / np.maximum(variance, 1e-300)[:, None], axis=0)[1:]
    count = squares.size // 2
    together = squares[:count] + squares[count:]
    limit = float(special.chdtri(2 * residuals.shape[0], _CHANCE / count))
    return np.asarray(together > limit)
