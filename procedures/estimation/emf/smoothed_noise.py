"""Detects that a record of a turning machine's voltages was smoothed before it was written: by its noise, which the smoothing shaped."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from procedures.estimation.emf.further_orders import further_orders
from procedures.estimation.emf.harmonics import HarmonicModel, waveform_basis
from procedures.estimation.emf.record import DigitizedChannel
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding

#: The spectrum is looked at in bands that grow by this factor from this bin on, by so many places of each.
_GROWS, _FIRST, _PLACES = 1.15, 3, 16
#: So many bands at least tell a shape.
_LEAST_BANDS = 12
#: Variance of the logarithm of a spectrum's bin, π²/6, and what neighbours under the window have in common.
_BIN_VARIANCE, _IN_COMMON = np.pi**2 / 6.0, 1.6
#: What no smoothing's shape is known better than to, in logarithms of power.
_SHAPE = 0.25
#: Lengths of the smoothing that are tried, up to this share of a period; noise that was added after it, share of that before.
_LENGTHS, _LONGEST = 64, 0.5
_AFTER = (5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 0.03, 0.1, 0.3, 1.0, 3.0)
#: Down to this share of the densest bands, which lie at this share of all, the spectrum is looked at.
_DEEPEST, _DENSE = 1e-3, 0.8
#: With more noise of its own after it, noise that is strong at low frequencies looks the same.
_MOST_AFTER = 0.1
#: Noise counts as smoothed where that explains so much (half of it of the logarithms' χ²) and leaves so many times what chance leaves.
_EXPLAINS, _LEAVES = 25.0, 5.0
#: It is not looked for in noise that white noise explains but for so much.
_WORTH = 15.0
#: Shapes that are within this of χ², in units of what the best one leaves, may be the true one.
_RIVALS = 4.0
#: Degree up to which waves change along a record that is modulated.
_COURSES = 8
#: Below so many periods a speed that swings may leave what looks like smoothed noise.
_FEW_PERIODS = 8.0
#: Below so many of a converter's steps the residual is the steps' own.
_COARSE = 0.4
#: Told from this share of the fundamental on; the truth is at one of the ends, this many standard uncertainties from the figure.
_TOLD, _WITHIN = 1e-3, 1.6


def _box(length: FloatArray, frequency: FloatArray) -> FloatArray:
    """Gain of a mean over a length (samples) at a frequency (per sample)."""
    return np.asarray(np.abs(np.sinc(length * frequency)))


def _twice(length: FloatArray, frequency: FloatArray) -> FloatArray:
    return _box(length / np.sqrt(2.0), frequency) ** 2


def _exponential(length: FloatArray, frequency: FloatArray) -> FloatArray:
    """Gain of a first-order filter of samples that takes as much of slow waves as the mean does."""
    left = np.exp(-np.sqrt(12.0) / length)
    return np.asarray((1.0 - left) / np.sqrt(1.0 - 2.0 * left * np.cos(2.0 * np.pi * frequency) + left**2))


def _gaussian(length: FloatArray, frequency: FloatArray) -> FloatArray:
    return np.asarray(np.exp(-((np.pi * length * frequency) ** 2) / 6.0))


_KERNELS: tuple[Callable[[FloatArray, FloatArray], FloatArray], ...] = (_box, _twice, _exponential, _gaussian)


def find_smoothing(
    t: FloatArray,
    orders: Sequence[int],
    model: HarmonicModel,
    channels: Sequence[DigitizedChannel],
    whole: NDArray[np.bool_],
    *,
    modulated: bool,
) -> tuple[FloatArray, tuple[Finding, ...]]:
    """Return the standard uncertainty, as a share (C,), of fundamentals that a smoothing of the record took away, and the finding.

    A moving average, or a filter, shapes a channel's white noise as it does the fundamental: where the noise ends far below half the
    sampling rate, the fundamental is smaller by what that shape has lost at its frequency. Waves that change along a record, as of a
    `modulated` one, are no noise.
    """
    interval = float(t[1] - t[0])
    period = 2.0 * model.half * np.pi / float(model.course[1]) / interval
    lengths = np.exp(np.linspace(np.log(1.5), np.log(max(_LONGEST * period, 3.0)), _LENGTHS))

    def lost_by(residuals: FloatArray) -> FloatArray:
        lost = np.zeros(len(channels))
        _, left = further_orders(t, residuals, model, orders)
        noisy = [np.std(row) > _COARSE * each.resolution for row, each in zip(left, channels, strict=True)]
        seen = {c: _compared(left[c], lengths) for c in np.flatnonzero(whole & np.array(noisy))}
        shapes = {c: one for c, one in seen.items() if one is not None}
        if shapes:
            # What writes a file smooths all of its channels alike.
            together = _Compared(*(np.sum(each, axis=0) for each in zip(*shapes.values(), strict=True)))
            lost[list(shapes)] = [
                max(each.lost(lengths, period), together.lost(lengths, period)) for each in shapes.values()
            ]
        return lost

    lost = lost_by(_steady(t, orders, model) if modulated else model.residuals)
    if not modulated and np.max(lost) >= _TOLD and t.size < _FEW_PERIODS * period:
        # What the speed does beside its model is strong at low frequencies, too; of more periods it is told by their phases.
        lost = np.minimum(lost, lost_by(_steady(t, orders, model)))
    worst = int(np.argmax(lost))
    if lost[worst] < _TOLD:
        return lost / _WITHIN, ()
    figures: dict[str, float | str] = {
        "record": "emf-smoothed",
        "share": float(lost[worst]),
        "time": float(np.sqrt(6.0 * lost[worst]) / np.pi * period * interval),
    }
    return lost / _WITHIN, (Finding(Cause.BANDWIDTH, Answer.WIDENED, ("flux_linkage",), 0.0, figures),)


def _steady(t: FloatArray, orders: Sequence[int], model: HarmonicModel) -> FloatArray:
    """Return the residuals (C, n) without a slow change of the waves, which is no noise."""
    place = model.place(t)
    wave = waveform_basis(model, orders, t)
    courses = np.polynomial.legendre.legvander(place, _COURSES).T
    columns = (courses[:, None, :] * wave[None]).reshape(-1, t.size)
    columns /= np.sqrt(np.mean(columns**2, axis=1, keepdims=True))
    values = model.residuals @ columns.T @ np.linalg.pinv(columns @ columns.T, hermitian=True)
    return np.asarray(model.residuals - values @ columns)


class _Compared(NamedTuple):
    """How well shapes explain a noise's spectrum, χ²: none (`white`), the best with much noise after the smoothing, and each kernel of
    each length with little (K, L); `freedom` of these.
    """

    white: FloatArray
    noisy: FloatArray
    smoothed: FloatArray
    freedom: FloatArray

    def lost(self, lengths: FloatArray, period: float) -> float:
        """Return the largest share of a fundamental of so many samples a `period` that a smoothing takes which the noise shows."""
        best = float(np.min(self.smoothed))
        leaves = best / float(self.freedom)
        if min(self.white, self.noisy) - best < _EXPLAINS * max(leaves, 1.0) or leaves > _LEAVES:
            return 0.0
        taken = np.array([1.0 / kernel(lengths, np.array(1.0 / period)) - 1.0 for kernel in _KERNELS])
        return float(np.max(taken[self.smoothed <= best + _RIVALS * max(leaves, 1.0)]))


def _compared(left: FloatArray, lengths: FloatArray) -> _Compared | None:
    """Return how well shapes explain the spectrum of a noise (n,); None where white noise does, or the record is too
    short to show any.
    """
    power = np.abs(np.fft.rfft(np.hanning(left.size) * (left - np.mean(left)))) ** 2
    edges = [_FIRST]
    while edges[-1] < power.size - 1:
        edges.append(min(max(int(edges[-1] * _GROWS), edges[-1] + 3), power.size - 1))
    if len(edges) < _LEAST_BANDS:
        return None
    begins, counts = np.array(edges[:-1]), np.diff(edges)
    # Lines of what is no noise weigh little in a mean of logarithms.
    logs = np.log(np.maximum(power[: edges[-1]], 1e-300))
    dense = np.exp(np.quantile(np.add.reduceat(logs, begins) / counts, _DENSE))
    # Nulls are as deep as single bins are fine: no shape is compared there.
    seen = np.add.reduceat(np.log(power[: edges[-1]] + _DEEPEST * dense), begins) / counts
    weight = 1.0 / (_BIN_VARIANCE * _IN_COMMON / counts + _SHAPE**2)
    places = (begins[:, None] + (np.arange(_PLACES) + 0.5) / _PLACES * counts[:, None]) / left.size

    def chi(shape: FloatArray) -> FloatArray:
        off = seen - shape
        off = off - np.sum(weight * off, axis=-1, keepdims=True) / np.sum(weight)
        return np.asarray(np.sum(weight * off**2, axis=-1))

    white, freedom = chi(np.zeros_like(seen)), float(counts.size - 3)
    if white < freedom + _WORTH:
        return None
    costs = []
    for kernel in _KERNELS:
        passed = kernel(lengths[:, None, None], places) ** 2
        costs.append([chi(np.mean(np.log(passed + after), axis=-1)) for after in _AFTER])
    cost, little = np.array(costs), np.array(_AFTER) <= _MOST_AFTER
    return _Compared(white, np.min(cost[:, ~little]), np.min(cost[:, little], axis=1), np.asarray(freedom))
