"""Rows of a file that repeat a reading: the file was written faster than the converter samples, under an even time column."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit

#: So many changes at least, that a rounded straight line does not make (back, or of more than one step), and so many different ones, as
#: a computed square wave does not.
_LEAST_IRREGULAR, _LEAST_DIFFERENT = 30, 20
#: Chance puts all changes where they are once in exp(25) records.
_CHANCE = 25.0
#: Rows per reading that are looked for: from the least that leaves such a trace to the most that still shows a course.
_LEAST, _MOST = 1.15, 1000.0
#: Rates that are tried within a line's width in the spectrum of the changes, by what share of the rows for a reading a change may then be
#: out of its row, how often the rate is made finer, and what share of a row the changes leave then at least.
_RATES, _OUT, _HALVINGS, _SPARE = 65, 0.1, 60, 1e-7
#: Of a rate that was found these parts are tried.
_MULTIPLES = (6, 5, 4, 3, 2)
#: Of rows that are new at these rates, the line in the spectrum has at least so much of the height that the rate gives it.
_LINE = 0.7


@dataclass(frozen=True)
class RepeatedRows:
    """A record of so many `rows` has new readings in every `every`-th only, the first at the place `first` (a row, or between two)."""

    every: float
    first: float
    rows: int

    @property
    def places(self) -> FloatArray:
        """The places (m,) from which on the readings are new, in rows."""
        return np.asarray(np.arange(self.first, self.rows - 1e-6, self.every))

    @property
    def new(self) -> NDArray[np.intp]:
        """The rows (m,) with new readings."""
        return np.asarray(np.minimum(np.ceil(self.places - 1e-6), self.rows - 1).astype(np.intp))

    def times(self, time: FloatArray) -> FloatArray:
        """Return the instants (m,) of the new readings: as even as the `time` (n,) of the rows is."""
        return np.asarray(np.interp(self.places, np.arange(self.rows), time))

    def over_all(self, values: FloatArray) -> FloatArray:
        """Return values of the new readings (…, m) over the rows (…, n), as far as they reach."""
        at = np.searchsorted(self.new, np.arange(self.rows), side="right") - 1
        return np.asarray(values[..., np.maximum(at[at < values.shape[-1]], 0)])

    @property
    def finding(self) -> Finding:
        """The finding: the other rows are left out."""
        figures: dict[str, float | str] = {
            "every": self.every,
            "used": float(self.places.size),
            "rows": float(self.rows),
        }
        return Finding(Cause.REPEATED_ROWS, Answer.MODELLED, figures=figures)

    def beside(self, misfit: Misfit) -> Misfit:
        """Return the misfit of the new readings with that of the file."""
        return Misfit.together((misfit, Misfit((self.finding,))))


def repeated_rows(channels: Iterable[FloatArray]) -> RepeatedRows | None:
    """Return which rows of a record hold new readings where one of its channels (n,) is read less often than the rows are written; None
    where every row may be a reading.

    Of channels that are read at different rates the slowest counts, of those at one rate the one beside which the others are least late.
    """
    rows = list(channels)
    found = [one for one in map(_of_channel, rows) if one is not None]
    if not found:
        return None
    every = max(each for each, _ in found)
    firsts = np.array([first for each, first in found if abs(each - every) < 1e-9 * every])
    late = np.max(np.mod(firsts[:, None] - firsts, every), axis=1)
    return RepeatedRows(every, float(firsts[int(np.argmin(late))]), rows[0].size)


def _of_channel(values: FloatArray) -> tuple[float, float] | None:
    """Return how many rows a channel (n,) has for each reading, and the place of its first new one."""
    changed = values[1:] != values[:-1]
    at = np.flatnonzero(changed) + 1
    if not _LEAST_IRREGULAR <= at.size <= (values.size - 1) / _LEAST or not _irregular(values, at):
        return None
    whole = int(np.gcd.reduce(np.diff(at)))
    if whole > 1:
        likely = (at.size - 1) * np.log(whole)
        return (float(whole), float(at[0] % whole)) if likely > _CHANCE and whole <= _MOST else None
    return _between_rows(changed, at)


def _between_rows(changed: NDArray[np.bool_], at: NDArray[np.intp]) -> tuple[float, float] | None:
    """Return the same of a rate that is no whole number of rows: by the line that it makes in the spectrum of the changes (n − 1,)."""
    spectrum = np.abs(np.fft.rfft(changed.astype(np.float64) - np.mean(changed)))
    frequencies = np.arange(spectrum.size) / changed.size
    with np.errstate(divide="ignore"):
        rows = 1.0 / frequencies
    spectrum[(rows < _LEAST) | (rows > _MOST)] = 0.0
    # Above a half the line of a rate is that of its mirror image.
    line = int(np.argmax(spectrum))
    for frequency in (frequencies[line], 1.0 - frequencies[line]):
        if not 1.0 / _MOST <= frequency <= 1.0 / _LEAST:
            continue
        height = at.size * np.sinc(frequency)
        if spectrum[line] < _LINE * height * np.sinc(0.5):
            continue
        found = _in_their_rows(at, frequency, 1.0 / changed.size)
        if found is None or (at.size - 1) * np.log(found[0]) - np.log(_RATES * changed.size) < _CHANCE:
            continue
        # Readings at a rate are in the rows of all its multiples, too: the lowest counts.
        slower = (_in_their_rows(at, 1.0 / (k * found[0]), 1.0 / changed.size) for k in _MULTIPLES)
        return next((one for one in slower if one is not None), found)
    return None


def _in_their_rows(at: NDArray[np.intp], frequency: float, width: float) -> tuple[float, float] | None:
    """Return rows per reading and the first place that put each change (at rows `at`) in the row after its reading; None where no rate
    within a `width` of the `frequency` does.
    """
    rates = frequency + np.linspace(-width, width, _RATES)
    every, begin, occupied = 0.0, 0.0, np.inf
    for each in 1.0 / rates[(rates >= 1.0 / _MOST) & (rates <= 1.0 / _LEAST)]:
        places = np.sort(np.mod(at, each))
        gaps = np.diff(np.append(places, places[0] + each))
        widest = int(np.argmax(gaps))
        if each - gaps[widest] < occupied:
            every, occupied = float(each), float(each - gaps[widest])
            begin = float(places[(widest + 1) % places.size] - 0.5 * gaps[widest])
    if occupied > 1.0 + _OUT * every:
        return None
    # Each change belongs to one reading from here on, and how much of a row they take is convex over the rate.
    number = np.floor((at - begin) / every)

    def taken(rows: float) -> tuple[float, float]:
        late = at - rows * number
        return float(np.max(late) - np.min(late)), float(np.min(late))

    reach = every * every * width / _RATES * 4.0
    low, high = every - reach, every + reach
    for _ in range(_HALVINGS):
        third = (high - low) / 3.0
        if taken(low + third)[0] < taken(high - third)[0]:
            high -= third
        else:
            low += third
    every = 0.5 * (low + high)
    occupied, least = taken(every)
    # Of rows that are new in turns of a whole number, the changes take a row exactly at twice the rows for each reading.
    if occupied > 1.0 - _SPARE:
        return None
    return every, float(np.mod(least - 0.5 * (1.0 - occupied), every))


def _irregular(values: FloatArray, at: NDArray[np.intp]) -> bool:
    """Return whether the changes (at rows `at`) are those of readings: not of a straight line that was rounded, nor of a square wave."""
    steps = values[at] - values[at - 1]
    sizes = np.abs(steps)
    more = sizes[1:] > 1.5 * np.min(sizes)
    back = np.sign(steps[1:]) != np.sign(steps[:-1])
    if np.count_nonzero(more | back) < _LEAST_IRREGULAR:
        return False
    before, after = values[at - 1], values[at]
    pairs = zip(np.minimum(before, after).tolist(), np.maximum(before, after).tolist(), strict=True)
    different: set[tuple[float, float]] = set()
    for low, high in pairs:
        # What is no number is no reading.
        if low <= high:
            different.add((low, high))
        if len(different) >= _LEAST_DIFFERENT:
            # Of readings that is so within the first few; sorting them all takes longer than all else here.
            return True
    return False
