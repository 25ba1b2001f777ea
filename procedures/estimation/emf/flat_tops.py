"""Detects tops that are clipped before the converter: flat below the noise, with a corner that few harmonics cannot describe."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from procedures.estimation.emf.dropouts import BoolArray, fit_the_rest
from procedures.estimation.emf.harmonics import HarmonicModel, waveform_basis
from procedures.estimation.emf.hum import mains_pair
from procedures.estimation.emf.record import DigitizedChannel
from procedures.estimation.fitting.fit import FloatArray

#: Points that suffice to see a corner, and points a period that are kept for it.
_ENOUGH, _A_PERIOD = 2000, 80
#: The highest harmonic that is tried in a cut top's place.
_HIGHEST = 17
#: Shares of a period under the tops from which a search starts, and its most steps.
_SHARES, _STEPS = (0.05, 0.15, 0.35, 0.6), 12
#: A cut top explains the record better than any harmonics by so much of χ², each parameter of either counted with ln n.
_BETTER = 14.0
#: A channel needs further harmonics where they are worth so much of χ².
_NEEDED = 20.0
#: Harmonics alone explain a channel where a cut explains so much less.
_CLEARLY_WORSE = 0.05
#: A waveform is cut where it goes so many converter steps beyond.
_STEPS_BEYOND = 1.0
#: A trapezoid's tops are alike within this share of their height, and its rest has so many harmonics, more where most is flat.
_ALIKE, _DISTORTED, _DISTORTED_DEEP, _DEEP = 0.006, 0.055, 0.11, 0.43


@dataclass(frozen=True)
class _Cut:
    """A waveform cut off at `levels` (2,), V, infinite where it is not; `squares` is what it leaves of one channel."""

    levels: FloatArray
    squares: float
    values: FloatArray
    left: FloatArray
    kept: BoolArray

    @property
    def sides(self) -> int:
        """At how many sides it is cut."""
        return int(np.count_nonzero(np.isfinite(self.levels)))


@dataclass(frozen=True)
class FlatTops:
    """The levels (C, 2), V, at which tops are cut off, infinite where none is; `own` where tops are as flat as the machine makes them."""

    levels: FloatArray
    own: bool


def find_flat_tops(
    t: FloatArray,
    v: FloatArray,
    orders: Sequence[int],
    model: HarmonicModel,
    channels: Sequence[DigitizedChannel],
    shared: FloatArray,
    hum: float | None = None,
) -> FlatTops:
    """Return where tops of channels (C, n) are cut off.

    `hum` (Hz) is the mains' frequency where the record carries it: what is cut is the sum. A cut top is held against as many harmonics
    as explain it best, so many readings as `shared` (C,) says being one: the corner of a rounded trapezoid is drawn by a few of them.
    """
    levels = np.full((len(channels), 2), np.inf) * np.array([-1.0, 1.0])
    none = FlatTops(levels, own=False)
    span = float(t[-1] - t[0])
    periods = float(model.course[1]) / np.pi
    block = max(1, min(t.size // _ENOUGH, int(t.size / (periods * _A_PERIOD))))
    count = t.size // block
    few_t = t[: count * block].reshape(count, block).mean(axis=1)
    few = v[:, : count * block].reshape(len(v), count, block).mean(axis=2)
    highest = min(_HIGHEST, int(0.4 * count / periods))
    more = [k for k in range(2, highest + 1) if k not in orders]
    if len(more) < 2 or span <= 0.0:
        return none
    every = waveform_basis(model, [*orders, *more], few_t)
    first = _rows(len(orders), len(orders) + len(more))
    basis = every[first]
    extra = every[np.setdiff1d(np.arange(every.shape[0]), first)]
    if hum is not None:
        line = mains_pair(few_t, hum)
        basis, every = np.vstack((basis, line)), np.vstack((every, line))
    plain = few - fit_the_rest(few, basis, np.zeros(few.shape, dtype=bool)) @ basis
    gained = _by_harmonics(plain, basis, extra)
    all_of_them = plain - fit_the_rest(plain, every, np.zeros(few.shape, dtype=bool)) @ every
    gained *= (
        (np.sum(plain**2, axis=1) - np.sum(all_of_them**2, axis=1)) / np.maximum(np.sum(gained, axis=1), 1e-300)
    )[:, None]
    # Noise as the record shows it with all harmonics; rounding that harmonics draw is in neither.
    freedom = max(count - every.shape[0], 1)
    squares = np.sum(plain**2, axis=1)
    price = float(np.log(count))
    # A corner is in several harmonics: what one of them explains, or chance, needs no search.
    rest = np.sum(gained, axis=1) - np.max(gained, axis=1)
    spread = rest > (2.0 * len(more) + _BETTER) * (squares - np.sum(gained, axis=1)) * shared / freedom
    if not spread.any():
        return none
    cuts = [
        _best_cut(row, basis, row - left) if several else None
        for row, left, several in zip(few, plain, spread, strict=True)
    ]
    for k, cut in enumerate(cuts):
        # One amplifier's level is often the others': what they end at is tried here, too.
        for each in [other for other in cuts if other is not None and other is not cut]:
            again = _cut(few[k], basis, few[k] - plain[k] < each.levels[0], few[k] - plain[k] > each.levels[1])
            if again is not None and (cut is None or again.squares < cut.squares):
                cuts[k] = cut = again
    # How far beyond harmonics each channel's cut explains it, and by how much the harmonics explain it.
    ahead, needed = np.full(len(channels), -np.inf), np.zeros(len(channels))
    for k, cut in enumerate(cuts):
        best = float(squares[k] - np.sum(gained[k]))
        least = best if cut is None else min(best, cut.squares)
        variance = max(least * float(shared[k]) / freedom, 1e-300)
        needed[k] = _worth(gained[k] / variance, price, gained.shape[1])
        if cut is None:
            continue
        # The waveform below the cut may have one harmonic more, too.
        also = _by_harmonics(cut.left[None], basis, extra * cut.kept)[0]
        explained = (squares[k] - cut.squares) / variance + _worth(also / variance, price, 1)
        ahead[k] = explained - cut.sides * price - needed[k]
        # What rounding leaves of a peak is no cut.
        if np.max(np.abs(_beyond(cut, basis))) < _STEPS_BEYOND * channels[k].resolution:
            ahead[k] = min(ahead[k], 0.0)
    seen = ahead > _BETTER
    shaped = needed > _NEEDED
    # One machine's phases have one shape: where another channel has the same without a cut, it is the machine's own.
    own = bool(
        np.any(shaped & (ahead < -_CLEARLY_WORSE * needed))
        or _trapezoid([c for c, s in zip(cuts, seen | shaped, strict=True) if c and s], orders)
    )
    if seen.any() and not own:
        for k, cut in enumerate(cuts):
            if cut is not None and ahead[k] > 0.0:
                levels[k] = cut.levels
    return FlatTops(levels, own)


def _beyond(cut: _Cut, basis: FloatArray) -> FloatArray:
    """Return by how much a cut waveform (n,) would go beyond its levels."""
    fitted = cut.values @ basis
    return np.asarray(fitted - np.clip(fitted, *cut.levels))


def _trapezoid(cuts: Sequence[_Cut], orders: Sequence[int]) -> bool:
    """Tell whether tops are flat as a machine's own may be: all alike on either side of the offset, and a rest that is far from a sine.

    A machine turns both half waves out alike; an amplifier cuts at its own levels, which the channel's offset shifts.
    """
    for cut in cuts:
        if not np.isfinite(cut.levels).all():
            return False
        sizes = np.asarray(orders) * np.hypot(*cut.values[1 : 1 + 2 * len(orders)].reshape(2, -1))
        size = float(sizes[list(orders).index(1)])
        distortion = float(np.sqrt(np.sum(sizes**2) - size**2)) / size
        most = _DISTORTED_DEEP if float(np.mean(~cut.kept)) > _DEEP else _DISTORTED
        height = 0.5 * float(np.diff(cut.levels)[0])
        noise = 3.0 * np.sqrt(2.0 * cut.squares / max(int(np.count_nonzero(~cut.kept)), 1) / cut.left.size)
        if abs(float(np.mean(cut.levels)) - cut.values[0]) > _ALIKE * height + noise or distortion < most:
            return False
    return bool(cuts)


def _worth(gains: FloatArray, price: float, most: int) -> float:
    """Return by how much of χ² up to so many harmonics, the best first, explain more than they cost."""
    taken = np.cumsum(np.sort(gains)[::-1][:most])
    return float(np.max(taken - 2.0 * price * np.arange(1, taken.size + 1), initial=0.0))


def _rows(first: int, every: int) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Return the rows of a basis of so many orders that belong to the offset and to the first ones."""
    chosen = 1 + np.arange(first)
    return np.concatenate(([0], chosen, every + chosen))


def _by_harmonics(left: FloatArray, basis: FloatArray, extra: FloatArray) -> FloatArray:
    """Return by how much each further harmonic (C, m) lessens the squares of what is left (C, n); over periods they hardly overlap."""
    across = extra - (extra @ basis.T) @ np.linalg.inv(basis @ basis.T) @ basis
    size = (left @ across.T) ** 2 / np.maximum(np.sum(across**2, axis=1), 1e-300)
    half = extra.shape[0] // 2
    return np.asarray(size[:, :half] + size[:, half:])


def _best_cut(row: FloatArray, basis: FloatArray, wave: FloatArray) -> _Cut | None:
    """Return the cut waveform that leaves least of one channel (n,), None where no search ends at one."""
    best: _Cut | None = None
    # Searches that meet go on together: one suffices.
    passed: set[bytes] = set()
    for share in _SHARES:
        low, high = np.quantile(wave, [0.5 * share, 1.0 - 0.5 * share])
        for below, above in ((wave < low, wave > high), (wave < -np.inf, wave > high), (wave < low, wave > np.inf)):
            found = _cut(row, basis, below, above, passed)
            if found is not None and (best is None or found.squares < best.squares):
                best = found
    return best


def _cut(
    row: FloatArray, basis: FloatArray, below: BoolArray, above: BoolArray, passed: set[bytes] | None = None
) -> _Cut | None:
    """Return the least squares of a waveform and its levels, begun with what is taken as cut off; it and the choice alternate.

    None, too, from a choice on that another search has `passed`.
    """
    levels = np.array([-np.inf, np.inf])
    fitted = row
    for _ in range(_STEPS):
        if passed is not None:
            choice = np.packbits((below, above)).tobytes()
            if choice in passed:
                return None
            passed.add(choice)
        kept = ~(below | above)
        if np.count_nonzero(kept) < 4 * basis.shape[0]:
            return None
        inner = basis * kept
        normal = inner @ basis.T
        scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
        values = np.linalg.lstsq(normal / np.outer(scale, scale), (inner @ row) / scale, rcond=1e-9)[0] / scale
        fitted = values @ basis
        levels = np.array(
            [np.mean(row[below]) if below.any() else -np.inf, np.mean(row[above]) if above.any() else np.inf]
        )
        chosen = fitted < levels[0], fitted > levels[1]
        if np.array_equal(chosen[0], below) and np.array_equal(chosen[1], above):
            break
        below, above = chosen
    if not np.isfinite(levels).any():
        return None
    left = row - np.clip(fitted, *levels)
    return _Cut(levels, float(np.sum(left**2)), values, left, (fitted >= levels[0]) & (fitted <= levels[1]))
