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
#: Bins either side of where a line should be switched off, among which its corner is sought, and the reach of what finds it.
_SOUGHT, _REACH = 30, 4


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
    mean, noise = _binned(t, i, frequency, 0.0)
    # Once more with the switching instants between two bins.
    begin = _turn_on(mean, noise)
    mean, noise = _binned(t, i, frequency, begin / _BINS)
    return LineCurrent(mean, noise)


def _binned(time: FloatArray, current: FloatArray, frequency: float, begin: float) -> tuple[FloatArray, float]:
    """Return the mean current in each bin from `begin` (periods) on and its standard uncertainty, both halves of the period as one."""
    phase = np.mod((time - time[0]) * frequency - begin, 1.0)
    bins = np.minimum((phase * _BINS).astype(int), _BINS - 1)
    counts = np.bincount(bins, minlength=_BINS)
    if counts.min() < 1:
        raise EstimationError("the record has too few points to fold to half a degree; sample faster or record longer")
    mean = np.bincount(bins, current, _BINS) / counts
    scatter = float(np.sqrt(np.mean((current - mean[bins]) ** 2)))
    # The drive is symmetric: half a period on, every line carries the opposite current.
    return 0.5 * (mean - np.roll(mean, -_BINS // 2)), scatter / math.sqrt(2.0 * float(counts.mean()))


def _turn_on(current: FloatArray, noise: float) -> float:
    """Return the place, in bins, at which the line, without current before, is switched to plus: 120° before it is switched off.

    The current begins slowly and ends sharply: from its rise the instant is known to some degrees, from its fall to a tenth of one.
    """
    quiet = np.abs(current) < max(_QUIET_SHARE * float(np.max(np.abs(current))), _QUIET_SIGMAS * noise)
    ends = np.flatnonzero(quiet & ~np.roll(quiet, -1) & (np.roll(current, -_STATE // 2) > 0.0))
    runs = [(int(_run_length(quiet, int(end))), int(end)) for end in ends]
    if not runs or max(runs)[0] < 4:
        raise EstimationError(
            "the line is never without current: its freewheeling lasts as long as the state, and the turn-on cannot be seen; "
            "take a higher load or a lower speed"
        )
    begin = max(runs)[1]
    near = np.arange(begin + 2 * _STATE - _SOUGHT, begin + 2 * _STATE + _SOUGHT)
    values = current[near % _BINS]
    corner = int(np.argmin(values[2 * _REACH :] - 2.0 * values[_REACH:-_REACH] + values[: -2 * _REACH])) + _REACH
    rise, fall = corner - np.arange(2, 8), corner + np.arange(1, 4)
    if fall[-1] >= values.size or rise[-1] < 0:
        return float(begin)
    up, top = np.polyfit(rise, values[rise], 1)
    down, high = np.polyfit(fall, values[fall], 1)
    met = (high - top) / (up - down) if up > down else float(corner)
    met = float(np.clip(met, corner - 2.0, corner + 2.0))
    # A bin's value is that of its middle.
    return float(near[0] + met + 0.5 - 2 * _STATE)


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
    start, peak = _before_switching(line, 1), _before_switching(line, 2)
    # Line 3 begins without current, and ends as line 1 began, reversed.
    start, end = (start, peak) if connection == "wye" else (start / 3.0, (start + peak) / 3.0)
    return WindingState(
        average=float(state.mean()),
        rms=float(np.sqrt(np.mean(state**2))),
        start=start,
        end=end,
        period_rms=float(np.sqrt(np.mean(whole**2))),
    )


def _before_switching(line: LineCurrent, states: int) -> float:
    """Return line 1's current (A) so many states after its turn-on.

    From the bins before: freewheeling that begins there is soon over, and the bin at a switching instant holds both sides of it.
    """
    before = np.arange(2, 8)
    values = line.current[states * _STATE - 1 - before]
    return float(np.polyval(np.polyfit(-before - 0.5, values, 1), 0.0))


def switched_average(line: LineCurrent) -> float:
    """Return the mean of the currents through both closed switches over state T1T2 (A): their sum times R_t is the switches' drop."""
    state = slice(_STATE, 2 * _STATE)
    return float(line.current[state].mean() - line.shifted(240.0)[state].mean())


def supplied_average(line: LineCurrent) -> float:
    """Return the mean current (A) out of the source: that of line 3 over T1T2, for what freewheels in line 2 stays within the bridge."""
    return float(-line.shifted(240.0)[_STATE : 2 * _STATE].mean())


def bridge_currents(line: LineCurrent) -> tuple[float, float]:
    """Return the mean of the squares (A²) of the currents through both closed switches, and the mean freewheeling current (A)."""
    state = slice(_STATE, 2 * _STATE)
    one, three = line.current[state], line.shifted(240.0)[state]
    return float(np.mean(one**2 + three**2)), float(np.mean(np.abs(one + three)))


def average_drop(
    line: LineCurrent, connection: Connection, resistance: float, inductance: float, state_time: float
) -> float:
    """Return the mean voltage (V) that R_11 (Ω) and L11 − L12 (H) take between the switched lines over state T1T2 (s)."""
    currents = winding_currents(line, connection)
    path = -currents[2] if connection == "delta" else currents[0] - currents[2]
    state = path[_STATE : 2 * _STATE]
    # What line 3 takes over in the state is what line 1 began it with: only the current that is switched off at its end is left.
    change = _before_switching(line, 2) / (3.0 if connection == "delta" else 1.0)
    return resistance * float(state.mean()) + inductance * change / state_time
