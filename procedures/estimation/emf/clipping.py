"""Readings that stand at an end of a range: the converter's, found by counting, or an amplifier's before it, found by its corner. They are
left out by what the model says of them.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from procedures.estimation.emf.dropouts import BoolArray, fit_the_rest
from procedures.estimation.emf.flat_tops import find_flat_tops
from procedures.estimation.emf.harmonics import HarmonicModel, waveform_basis
from procedures.estimation.emf.record import DigitizedChannel
from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding
from procedures.estimation.fitting.noise import white_noise

#: Fewer readings at an extreme, or at fewer places of a turn, are a peak's own; so many places are told apart.
_LEAST, _PLACES = 4, 128
#: So many times the next cell's readings are at the extreme of no wave's peak, however flat: they are there for certain.
_CERTAIN = 6.0
#: Beyond this share of readings lost, or of the fundamental moved by harmonics that may be, the rest no longer tells the waveform.
_MOST_LOST, _MOST_MOVED = 0.45, 0.05
_ROUNDS, _STEPS = 4, 12
#: Noise of so much of a step, rounding included, spreads a flat top over several cells.
_SPREAD = 0.55
#: No machine's tops are so flat over so much of the turn that this share of its readings lies in the two extreme cells.
_MOST_FLAT = 0.74
#: The model's peak lies beyond the flat top by so many of its uncertainties, or it is no flat top.
_CLEARLY = 4.0
#: What is left of a waveform that the model holds is noise, and this much more at most.
_AS_NOISE = 1.3


@dataclass(frozen=True)
class ConverterEnds:
    """The level of each channel's lower and upper end (C, 2), V, infinite where nothing stands at it; `certain` (C,) where the
    instrument itself says that it clipped, no wave has so many readings at its peak, or only a cut makes such a corner; `margins` (C,),
    V, is how far within an end a reading may be lost.
    """

    levels: FloatArray
    certain: BoolArray
    margins: FloatArray

    def __bool__(self) -> bool:
        """Tell whether any channel may be clipped."""
        return bool(np.any(np.isfinite(self.levels)))


@dataclass(frozen=True)
class Restored:
    """A record whose lost readings are the model's own: `values` (C, n), which were `lost` (C, n), by what the amplitudes'
    uncertainties grow for that (C, 1 + 2H), by how much the fundamental flux (C,) moves with harmonics that the model has not, and what is
    to be told.
    """

    values: FloatArray
    lost: BoolArray
    growth: FloatArray
    moved: FloatArray
    findings: tuple[Finding, ...]


def find_ends(
    t: FloatArray,
    v: FloatArray,
    orders: Sequence[int],
    model: HarmonicModel,
    channels: Sequence[DigitizedChannel],
    shared: FloatArray,
    hum: float | None = None,
) -> ConverterEnds:
    """Return where readings pile up, more of them in the extreme cell than in the next one, or tops are flat beneath the noise. A
    converter that the instrument says is whole is taken as whole; so many readings as `shared` (C,) says are one;
    `hum` (Hz) is the mains' frequency where the record carries it.
    """
    levels = np.full((len(channels), 2), np.inf) * np.array([-1.0, 1.0])
    certain: BoolArray = np.array([channel.clipped is True for channel in channels])
    # Noise between the ends, and the share of the readings at them.
    inner, flattened = np.zeros(len(channels)), np.zeros(len(channels))
    place = np.floor(np.mod(model.phase(t) / (2.0 * np.pi), 1.0) * _PLACES)
    for k, (row, channel) in enumerate(zip(v, channels, strict=True)):
        if channel.clipped is False:
            continue
        ended = np.zeros(row.size, dtype=bool)
        for side, sign in enumerate((-1.0, 1.0)):
            level = float(np.max(sign * row))
            below = level - sign * row
            cell = channel.resolution or float(np.min(below[below > 0.0], initial=np.inf))
            ended |= below < 0.5 * cell
            at = np.count_nonzero(below < 0.5 * cell) / shared[k]
            following = np.count_nonzero((below >= 0.5 * cell) & (below < 1.5 * cell)) / shared[k]
            if at >= _LEAST and at > following and np.unique(place[below < 0.5 * cell]).size >= _LEAST:
                levels[k, side] = sign * level
                certain[k] = certain[k] or at > _CERTAIN * max(following, _LEAST)
        flattened[k] = np.mean(ended)
        inner[k] = white_noise(row, among=~(ended[:-2] | ended[1:-1] | ended[2:]))
    tops = find_flat_tops(t, v, orders, model, channels, shared, hum)
    flat = tops.levels
    steps = np.array([channel.resolution for channel in channels])
    if not np.isfinite(levels).any() and not np.isfinite(flat).any():
        return ConverterEnds(levels, certain, steps)
    noise = np.array([white_noise(row, step) for row, step in zip(v, steps, strict=True)])
    margins = np.maximum(steps, 3.0 * noise)
    if tops.own:
        # Flat tops of the machine's own fill a cell as well, unless noise spreads them; then only the instrument knows.
        told = np.array([channel.clipped is True for channel in channels])
        open_ = np.flatnonzero(~told & (np.maximum(noise, inner) < _SPREAD * steps) & (flattened < _MOST_FLAT))
        levels[open_], certain[open_] = flat[0], False
    found = np.asarray(np.any(np.isfinite(flat), axis=1))
    # A level that was fitted is no single reading's: no noise is on it.
    return ConverterEnds(
        np.where(found[:, None], flat, levels), certain | found, np.where(found, 0.5 * steps + 0.1 * noise, margins)
    )


def restore(
    t: FloatArray,
    v: FloatArray,
    orders: Sequence[int],
    model: HarmonicModel,
    ends: ConverterEnds,
    channels: Sequence[DigitizedChannel],
    shared: FloatArray,
    refit: Callable[[FloatArray], HarmonicModel],
) -> Restored:
    """Fit what was not lost, chosen by the model's value (by the reading's, noise would choose), until model and choice agree.

    `refit` fits a whole record; so many readings as `shared` (C,) says share one rounding error. Raises
    EstimationError where what is left carries no fit.
    """
    steps = np.array([channel.resolution for channel in channels])
    noise = np.array([white_noise(row, step) for row, step in zip(v, steps, strict=True)])
    margin = ends.margins[:, None]
    low, high = ends.levels[:, :1] + margin, ends.levels[:, 1:] - margin
    lost = (v < low) | (v > high)
    for _ in range(_ROUNDS):
        basis = waveform_basis(model, orders, t)
        values = fit_the_rest(v, basis, lost)
        before = lost
        for _ in range(_STEPS):
            fitted = values @ basis
            chosen = (fitted < low) | (fitted > high)
            if np.array_equal(chosen, lost):
                break
            lost = chosen
            values = fit_the_rest(v, basis, lost)
        filled = np.where(lost, values @ basis, v)
        if np.mean(lost, axis=1).max() > 0.8 or np.array_equal(lost, before):
            break
        model = refit(filled)
    fitted = values @ basis
    whole = np.linalg.inv(basis @ basis.T)
    growth, found = np.ones_like(values), []
    moved = _moved(t, v, orders, model, lost)
    sizes = np.abs(model.flux[:, list(orders).index(1)])
    result = v.copy()
    for k, channel in enumerate(channels):
        if not lost[k].any():
            continue
        kept = ~lost[k]
        if not kept.any():
            raise EstimationError("too few readings are left within the channel's range; take a wider range")
        inverse = np.linalg.pinv((basis * kept) @ basis.T, hermitian=True)
        left = float(np.sqrt(np.mean((v[k] - fitted[k])[kept] ** 2)))
        growth[k] = np.sqrt(np.maximum(np.diag(inverse) / np.diag(whole), 1.0) / np.mean(kept))
        result[k] = filled[k]
        sides = np.isfinite(ends.levels[k])
        # How far the model reaches beyond each flat top, and how well it tells that.
        peaks = np.array([np.argmin(fitted[k]), np.argmax(fitted[k])])
        beyond = (fitted[k, peaks] - ends.levels[k]) * np.array([-1.0, 1.0])
        told = left * np.sqrt(shared[k]) * np.sqrt(np.einsum("ip,ij,jp->p", basis[:, peaks], inverse, basis[:, peaks]))
        seen = bool(np.any(sides & (beyond > 0.5 * channel.resolution + _CLEARLY * told)))
        if not (seen or ends.certain[k]):
            continue
        share = float(np.mean(lost[k]))
        explained = left < _AS_NOISE * max(float(noise[k]), 1e-9 * float(np.max(np.abs(v[k]))))
        answer = Answer.MODELLED if explained else Answer.WIDENED
        if share > _MOST_LOST or moved[k] > _MOST_MOVED * sizes[k]:
            answer = Answer.WITHHELD
        if not explained:
            # The rest does not look like the model either: what it was extrapolated by is not known better than by all of it.
            growth[k] *= left / max(float(noise[k]), 1e-300)
        score = float(np.max(np.where(sides, beyond / np.maximum(told, 1e-300), 0.0)))
        figures: dict[str, float | str] = {
            "channel": channel.name,
            "level": float(np.max(np.abs(ends.levels[k][sides]))),
            "lost": share,
        }
        found.append(Finding(Cause.CLIPPED, answer, ("flux_linkage",), score, figures))
    return Restored(result, lost, growth, moved, tuple(found))


def _moved(t: FloatArray, v: FloatArray, orders: Sequence[int], model: HarmonicModel, lost: BoolArray) -> FloatArray:
    """Return how far each channel's fundamental flux (C,) moves with two more harmonics: a waveform is extrapolated by its model, and
    none holds all of it.
    """
    first, moved = list(orders).index(1), np.zeros(v.shape[0])
    more = [*orders, max(orders) + 2, max(orders) + 4]
    if not lost.any() or 1.2 * max(more) * float(model.course[1]) / model.half > np.pi * (t.size - 1) / float(
        t[-1] - t[0]
    ):
        return moved
    clipped = lost.any(axis=1)
    sizes = []
    for chosen in (orders, more):
        values = fit_the_rest(v[clipped], waveform_basis(model, chosen, t), lost[clipped])
        sizes.append(np.hypot(values[:, 1 + first], values[:, 1 + len(chosen) + first]))
    # One record's channels have much the same waveform: what moves one by chance little moves it as the others.
    moved[clipped] = np.sqrt(np.mean((sizes[1] - sizes[0]) ** 2))
    return moved
