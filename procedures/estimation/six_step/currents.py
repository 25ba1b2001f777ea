"""Winding currents and equivalent resistances of a six-step drive from one line's current (paper on the armature resistance)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from procedures.estimation.fitting.checks import positive, same_length, series, uniform_step
from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.winding.connections import Connection

#: Bins of the folded period: half a degree.
_BINS = 720
_STATE = _BINS // 6
#: A line is without current where it stays below this share of its peak, or this many standard deviations of the mean.
_QUIET_SHARE, _QUIET_SIGMAS = 0.03, 4.0
#: Degrees of the rise that the line's first current is extrapolated from.
_RISE = slice(2, 14)


@dataclass(frozen=True)
class LineCurrent:
    """One electrical period of a line's current, folded from many: `current` (A) in half-degree bins from the line's turn-on.

    `noise` (A) is the standard uncertainty of a bin's mean.
    """

    current: FloatArray
    noise: float

    def shifted(self, degrees: float) -> FloatArray:
        """Return the current of the line that follows by this angle."""
        return np.roll(self.current, round(degrees * _BINS / 360.0))


@dataclass(frozen=True)
class WindingState:
    """A winding's current over the state in which it carries the most: mean and rms (A), at its start and end (A).

    `period_rms` (A) is the rms over a whole period, which makes the copper loss.
    """

    average: float
    rms: float
    start: float
    end: float
    period_rms: float

    def resistive(self, resistance: float) -> float:
        """Return R_11r (Ω): the winding's resistance (Ω) times (I_eff/I_av)²."""
        return resistance * (self.rms / self.average) ** 2

    def inductive(self, inductance: float, state_time: float) -> float:
        """Return R_11L (Ω) = (L11 − L12)/(2τ)·(i_τ² − i_0²)/I_av² (H, s); the ½ is erratum E12."""
        return inductance / (2.0 * state_time) * (self.end**2 - self.start**2) / self.average**2


def fold(time: ArrayLike, current: ArrayLike, frequency: float) -> LineCurrent:
    """Fold a line's current (s, A; several periods) to one period that begins where the line is switched to plus.

    `frequency` (Hz, electrical) must be known to a small part of a turn over the record. Raises EstimationError on fewer
    than three periods, or where the line is never without current, so that its turn-on cannot be seen.
    """
    t, i = series("time", time, least=_BINS), series("current", current, least=_BINS)
    same_length(time=t, current=i)
    uniform_step(t)
    periods = positive("frequency", frequency, "Hz") * (t[-1] - t[0])
    if periods < 3.0:
        raise EstimationError(
            f"the record holds {periods:.1f} periods of the line current, three are needed; record longer"
        )
    phase = np.mod((t - t[0]) * frequency, 1.0)
    bins = np.minimum((phase * _BINS).astype(int), _BINS - 1)
    counts = np.bincount(bins, minlength=_BINS)
    if counts.min() < 1:
        raise EstimationError("the record has too few points to fold to half a degree; sample faster or record longer")
    mean = np.bincount(bins, i, _BINS) / counts
    scatter = float(np.sqrt(np.mean((i - mean[bins]) ** 2)))
    noise = scatter / math.sqrt(float(counts.mean()))
    # The drive is symmetric: half a period on, every line carries the opposite current.
    mean = 0.5 * (mean - np.roll(mean, -_BINS // 2))
    return LineCurrent(np.roll(mean, -_turn_on(mean, noise)), noise / math.sqrt(2.0))


def _turn_on(current: FloatArray, noise: float) -> int:
    """Return the bin in which the line, without current before, is switched to plus."""
    quiet = np.abs(current) < max(_QUIET_SHARE * float(np.max(np.abs(current))), _QUIET_SIGMAS * noise)
    ends = np.flatnonzero(quiet & ~np.roll(quiet, -1) & (np.roll(current, -_STATE // 2) > 0.0))
    runs = [(int(_run_length(quiet, int(end))), int(end)) for end in ends]
    if not runs or max(runs)[0] < 4:
        raise EstimationError(
            "the line is never without current: its freewheeling lasts as long as the state, and the turn-on cannot be seen; "
            "take a higher load or a lower speed"
        )
    end = max(runs)[1]
    rise = np.arange(_RISE.start, _RISE.stop)
    slope, offset = np.polyfit(rise, current[(end + rise) % _BINS], 1)
    begin = end + round(-offset / slope) if slope > 0.0 else end
    return begin % _BINS if abs(begin - end) <= _STATE // 6 else end


def _run_length(quiet: NDArray[np.bool_], end: int) -> int:
    length = 0
    while length < _BINS and quiet[(end - length) % _BINS]:
        length += 1
    return length


def winding_currents(line: LineCurrent, connection: Connection) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the currents of the three windings (A; shape (720,) each) over a period from line 1's turn-on.

    In a wye a winding's current is its line's. In a delta (a from line 1 to 2, b from 2 to 3, c from 3 to 1) only differences
    are seen from outside: the current that circulates in the delta is taken as zero, which holds where the EMF has no third harmonic.
    """
    one, two, three = line.current, line.shifted(120.0), line.shifted(240.0)
    if connection == "wye":
        return one, two, three
    return (one - two) / 3.0, (two - three) / 3.0, (three - one) / 3.0


def conducting_state(line: LineCurrent, connection: Connection) -> WindingState:
    """Return the current of the winding between the two switched lines over state T1T2 (its sign so that it is positive).

    T1T2 is the second sixth of a period after line 1's turn-on: current enters at line 1 and leaves at line 3. A wye's
    is that of line 1, a delta's that of the winding from line 1 to 3.
    """
    a, _, c = winding_currents(line, connection)
    whole = a if connection == "wye" else -c
    state = whole[_STATE : 2 * _STATE]
    # The ends are extrapolated from inside the state: the bins at a switching instant hold both sides of it.
    inner = np.arange(2, 8)
    start = np.polyval(np.polyfit(inner + 0.5, state[inner], 1), 0.0)
    end = np.polyval(np.polyfit(-inner - 0.5, state[::-1][inner], 1), 0.0)
    return WindingState(
        average=float(state.mean()),
        rms=float(np.sqrt(np.mean(state**2))),
        start=float(start),
        end=float(end),
        period_rms=float(np.sqrt(np.mean(whole**2))),
    )


def switched_average(line: LineCurrent) -> float:
    """Return the mean of the currents through both closed switches over state T1T2 (A): their sum times R_t is the switches' drop."""
    state = slice(_STATE, 2 * _STATE)
    return float(line.current[state].mean() - line.shifted(240.0)[state].mean())


def average_drop(
    line: LineCurrent, connection: Connection, resistance: float, inductance: float, state_time: float
) -> float:
    """Return the mean voltage (V) that R_11 (Ω) and L11 − L12 (H) take between the switched lines over state T1T2 (s)."""
    currents = winding_currents(line, connection)
    path = -currents[2] if connection == "delta" else currents[0] - currents[2]
    state = path[_STATE : 2 * _STATE]
    inner = np.arange(2, 8)
    change = np.polyval(np.polyfit(-inner - 0.5, state[::-1][inner], 1), 0.0) - np.polyval(
        np.polyfit(inner + 0.5, state[inner], 1), 0.0
    )
    return resistance * float(state.mean()) + inductance * float(change) / state_time
