"""Detects a channel with hysteresis of a core or dielectric, by its reversals in the voltage of a turning machine."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from procedures.estimation.emf.harmonics import HarmonicModel
from procedures.estimation.emf.record import DigitizedChannel
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding
from procedures.estimation.fitting.noise import undithered

#: Parts of a period that readings are gathered in, and points of a period that a reversal is drawn with.
_PARTS, _POINTS = 256, 512
#: Widths by which a reading may lag, share of the amplitude.
_WIDTHS = np.geomspace(3e-3, 0.25, 12)
#: Times that the voltage before the channel is sought: what was fitted is what lags.
_ROUNDS = 3
#: Odd harmonics that any machine is taken to have, and the highest of those that are tried in a reversal's place, each counted with so
#: much of χ²: chance alone gives 2.
_OWN, _HIGHEST, _EACH = 17, 41, 8.0
#: Of what is lost the share 1 − _CHANCE/z² counts, z² being what the width explains beyond those; it is told from _TOLD and this share of
#: the fundamental on.
_CHANCE, _TOLD, _LEAST = 2.5, 14.0, 1e-3
#: A width of a tenth of the amplitude is found with half of its loss: so many times what is found is the standard uncertainty.
_SHORT = 1.4
#: So many parts of a period with readings for each unknown.
_READINGS = 2


def find_memory(
    t: FloatArray,
    kept: Sequence[int],
    model: HarmonicModel,
    channels: Sequence[DigitizedChannel],
    whole: NDArray[np.bool_],
) -> tuple[FloatArray, tuple[Finding, ...]]:
    """Return the uncertainty of each channel's fundamental (C,), V, because its reading lags by a width, and the findings.

    Such a reading stands still after each turning point until the voltage has come back by twice the width, and follows from there with a
    corner that few harmonics draw. The width, counted with ln n, is held against those that explain the record best.
    `whole` (C,) are channels all of whose readings are the record's own.
    """
    lost, scores = np.zeros(len(channels)), np.zeros(len(channels))
    part = (np.mod(model.phase(t), 2.0 * np.pi) * (_PARTS / (2.0 * np.pi))).astype(np.intp) % _PARTS
    counts = np.bincount(part, minlength=_PARTS)
    filled = counts > 0
    at = (np.flatnonzero(filled) + 0.5) * (2.0 * np.pi / _PARTS)
    root = np.sqrt(counts[filled])
    most = min(_HIGHEST, at.size // (2 * _READINGS))
    ours = (*kept, *(order for order in range(3, min(_OWN, most) + 1, 2) if order not in kept))
    more = [order for order in range(3, most + 1, 2) if order not in ours]
    if len(more) < 2:
        return lost, ()
    speed = float(model.speed(np.array([model.middle]))[0])
    own = np.exp(1j * np.outer(at, ours))
    smooth, _ = np.linalg.qr(np.hstack((np.ones((at.size, 1)), own.real, own.imag)) * root[:, None])
    further = np.exp(1j * np.outer(at, more)).view(np.float64) * root[:, None]
    # At right angles to each other, or what they explain would not add up; an order's cosine and sine stand side by side.
    extra, _ = np.linalg.qr(further - smooth @ (smooth.T @ further))
    even = np.linspace(0.0, 2.0 * np.pi, _POINTS, endpoint=False)
    price = float(np.log(t.size))
    first = list(kept).index(1)
    for c in map(int, np.flatnonzero(whole)):
        waves = 1j * speed * np.array(kept) * model.flux[c]
        amplitude = float(abs(waves[first]))
        row = model.residuals[c]
        left = np.bincount(part, row, minlength=_PARTS)[filled] / root
        left -= smooth @ (smooth.T @ left)
        wave = (waves @ np.exp(1j * np.outer(kept, even))).real
        lags = _lags(wave, _WIDTHS * amplitude, kept)
        seen = np.array([np.interp(at, even, lag, period=2.0 * np.pi) for lag in lags]).T * root[:, None]
        seen -= smooth @ (smooth.T @ seen)
        without = np.hstack((left[:, None], left[:, None] - seen))
        gains = (extra.T @ without) ** 2
        gains = gains[::2] + gains[1::2]
        variance = max(float(row @ row - np.sum(gains[:, 0])) / (row.size - 2 * len(more)), 1e-300)
        # What rounding leaves is the same in all readings of a part.
        variance += undithered(float(np.sqrt(variance)), channels[c].resolution) ** 2 * t.size / at.size
        worth = np.sum(np.maximum(gains / variance - _EACH, 0.0), axis=0)
        ahead = (left @ left - np.sum(without**2, axis=0)) / variance + worth - worth[0]
        best = int(np.argmax(ahead[1:]))
        z2 = float(ahead[1 + best]) - price
        if z2 <= _CHANCE:
            continue
        share = 2.0 * np.mean(lags[best] * np.exp(-1j * even))
        taken = max(float(abs(waves[first] - share)) - amplitude, 0.0)
        lost[c] = _SHORT * taken * (1.0 - _CHANCE / z2)
        if z2 > _TOLD and taken > _LEAST * amplitude:
            scores[c] = np.sqrt(z2)
    if not scores.any():
        return lost, ()
    worst = int(np.argmax(np.where(scores > 0.0, lost, 0.0)))
    figures: dict[str, float | str] = {
        "channel": channels[worst].name,
        "share": float(lost[worst] / (speed * abs(model.flux[worst, first]))),
        "record": "emf-memory",
    }
    return lost, (Finding(Cause.DISTORTION, Answer.WIDENED, ("flux_linkage",), float(scores[worst]), figures),)


def _lags(fitted: FloatArray, widths: FloatArray, orders: Sequence[int]) -> FloatArray:
    """Return what a lag by each width (m,), V, adds to the voltage (m, n), V, over a period of which it leaves the harmonics `fitted`."""
    size, width, lags = fitted.size, widths[:, None], np.zeros((widths.size, fitted.size))
    # What a lag's own harmonics of these orders are: a few sums, and no transform of all.
    waves = np.exp(2j * np.pi / size * np.outer(orders, np.arange(size)))
    each = np.arange(size)
    for round_ in range(_ROUNDS):
        wave = np.broadcast_to(fitted, lags.shape)
        if round_:
            wave = wave - np.mean(lags, axis=1, keepdims=True) - (2.0 / size * (lags @ waves.conj().T) @ waves).real
        top = np.argmax(wave, axis=1)[:, None]
        turned = np.take_along_axis(wave, (each + top) % size, 1)
        bottom = np.argmin(turned, axis=1)[:, None]
        falling = each < bottom
        down = np.minimum(np.minimum.accumulate(turned, axis=1) + width, turned[:, :1] - width)
        up = np.maximum.accumulate(np.where(falling, -np.inf, turned), axis=1) - width
        up = np.maximum(up, np.take_along_axis(turned, bottom, 1) + width)
        lags = np.take_along_axis(np.where(falling, down, up) - turned, (each - top) % size, 1)
    return np.asarray(lags, dtype=np.float64)
