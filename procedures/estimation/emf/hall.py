"""Hall sensors of a turning machine against its EMF: where each switches, and what is wrong with it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike

from procedures.estimation.emf.back_emf import fit_back_emf
from procedures.estimation.fitting.fit import EstimationError, FloatArray

SENSORS = (1, 2, 3)
_TURN = 2.0 * math.pi
_SIXTH = _TURN / 6.0
#: A signal is high above the first and low below the second share of its swing, and what it was in between.
_HIGH, _LOW = 0.6, 0.4
#: The line EMF's harmonics that are fitted beside its fundamental.
_HARMONICS = (1, 5, 7)


@dataclass(frozen=True)
class Switching:
    """The angles at which a sensor's signal rises and falls (rad, electrical, after the line EMF's rising zero), and its duty.

    `uncertainty` (rad) is that of either edge. `lag` (rad) is by how much the EMF was shown later than the sensor, where that is known.
    """

    rise: float
    fall: float
    uncertainty: float
    lag: float = math.nan

    def with_backwards(self, backwards: "Switching") -> "Switching":
        """Return the places that also hold for a machine that turned `backwards` at the same speed, its angles counted in time.

        Seen backwards the sensor rises where it falls forwards, while the EMF rises through zero at the same place. What is late is
        late in time, and so by opposite angles: their mean is free of it.
        """
        late = [_wrapped(back + there) for there, back in ((self.rise, backwards.fall), (self.fall, backwards.rise))]
        rise, fall = (_wrapped(there - 0.5 * both) for there, both in zip((self.rise, self.fall), late, strict=True))
        return Switching(rise, fall, 0.5 * math.hypot(self.uncertainty, backwards.uncertainty), -0.25 * sum(late))

    @property
    def duty(self) -> float:
        """Share of a turn for which it is high."""
        return math.fmod(self.fall - self.rise + 2.0 * _TURN, _TURN) / _TURN

    @property
    def middle(self) -> float:
        """The rising angle of a signal with the same middle that is high for exactly half a turn (rad)."""
        return self.rise + 0.5 * _TURN * self.duty - 0.25 * _TURN


class HallFault(Enum):
    """Fault of one lead."""

    DEAD = "dead"
    SWAPPED = "swapped"
    INVERTED = "inverted"


@dataclass(frozen=True)
class HallFinding:
    """A fault of one lead (1, 2, 3); `carries` is the sensor that a swapped one is connected to."""

    lead: int
    fault: HallFault
    carries: int | None = None


@dataclass(frozen=True)
class HallJudgement:
    """Evaluation of the signals of three leads.

    `faults` a lead and kind each; `offset` (rad, electrical, −π … π) of all sensors together, NaN where none switches;
    `spacing` the largest deviation of two sensors' spacing from 120° (rad), NaN with less than two; `duty` the largest
    deviation from one half, NaN with none. `explained` is false where two leads show one and the same sensor.
    """

    faults: tuple[HallFinding, ...]
    offset: float
    spacing: float
    duty: float
    explained: bool


def switching(
    time: ArrayLike, line_emf: ArrayLike, signals: ArrayLike, least_swing: float
) -> tuple[list[Switching | None], float]:
    """Return where each of the signals (k, n), V, switches against a line EMF (n,), V, of one record, and its frequency (Hz).

    None stands for a signal whose swing is below `least_swing` (V) or that does not switch once a turn. Raises
    EstimationError where the EMF is none, or the record holds less than two electrical turns.
    """
    t = np.asarray(time, dtype=np.float64)
    fit = fit_back_emf(t, np.atleast_2d(np.asarray(line_emf, dtype=np.float64)), harmonics=_HARMONICS)
    # v = Re(V·exp(jφ)) rises through zero a quarter of a turn before its crest.
    turned = fit.model.phase(t) + float(np.angle(fit.model.flux[0, 0])) + math.pi
    turns = float(turned[-1] - turned[0]) / _TURN
    if turns < 2.0:
        raise EstimationError(f"the record holds {turns:.2f} electrical turns, two are needed; record longer")
    own = float(fit.amplitude_uncertainties[0, 0] / np.abs(fit.amplitudes[0, 0]))
    rows = np.atleast_2d(np.asarray(signals, dtype=np.float64))
    return [_switching(turned, row, least_swing, turns, own) for row in rows], fit.frequency


def _switching(
    turned: FloatArray, signal: FloatArray, least_swing: float, turns: float, own: float
) -> Switching | None:
    low, high = (float(level) for level in np.quantile(signal, (0.02, 0.98)))
    if high - low < least_swing:
        return None
    share = (signal - low) / (high - low)
    decided = np.flatnonzero((share > _HIGH) | (share < _LOW))
    levels = share[decided] > _HIGH
    change = np.flatnonzero(levels[1:] != levels[:-1])
    before, after = turned[decided[change]], turned[decided[change + 1]]
    up = levels[change + 1]
    if not all(turns - 1.0 <= count <= turns + 1.0 for count in (np.sum(up), np.sum(~up))):
        return None
    rise, rise_error = _edge(before[up], after[up])
    fall, fall_error = _edge(before[~up], after[~up])
    return Switching(rise, fall, math.hypot(max(rise_error, fall_error), own))


def _edge(before: FloatArray, after: FloatArray) -> tuple[float, float]:
    """Return an edge's angle and standard uncertainty (rad) from the samples on either side of it, a pair each turn.

    It lies between them every time. Sampling in step with the turning leaves it as uncertain as once; only where the edge
    itself wavers does averaging help.
    """
    about = _mean(0.5 * (before + after))
    low = max(_wrapped(float(angle) - about) for angle in before)
    high = min(_wrapped(float(angle) - about) for angle in after)
    if low <= high:
        return about + 0.5 * (low + high), 0.5 * (high - low) / math.sqrt(3.0)
    return about, _scatter(0.5 * (before + after)) / math.sqrt(before.size)


def judge(seen: Mapping[int, Switching | None], nominal: float = 0.0) -> HallJudgement:
    """Tell what is wrong with three sensors that should rise at `nominal` (rad), 120° and 240° later, by their leads 1, 2, 3.

    Order and polarity put a sensor on a place of its own among six, 60° apart, so that every mistake of leads shows as long as
    the sensors as a whole are less than 30° off. All three moved by the same step is an offset and no mistake of leads.
    """
    alive = {lead: switched for lead, switched in seen.items() if switched is not None}
    dead = [HallFinding(lead, HallFault.DEAD) for lead in SENSORS if lead not in alive]
    if not alive:
        return HallJudgement(tuple(dead), math.nan, math.nan, math.nan, explained=True)
    angles = {lead: switched.middle - nominal for lead, switched in alive.items()}
    common = _mean(np.array([6.0 * angle for angle in angles.values()])) / 6.0
    steps = {lead: round((angle - common) / _SIXTH) for lead, angle in angles.items()}
    moved = {(step - 2 * (lead - 1)) % 6 for lead, step in steps.items()}
    shift = moved.pop() if len(moved) == 1 and len(alive) > 1 else 0
    places = {lead: (step - shift) % 6 for lead, step in steps.items()}
    # Even places are the sensors', odd ones those of a sensor seen upside down: half a turn on.
    carried = {lead: ((place + 3 * (place % 2)) % 6) // 2 + 1 for lead, place in places.items()}
    faults = dead
    faults += [HallFinding(k, HallFault.SWAPPED, carried[k]) for k in sorted(carried) if carried[k] != k]
    faults += [HallFinding(k, HallFault.INVERTED) for k in sorted(places) if places[k] % 2]
    own = {carried[lead]: angles[lead] - _SIXTH * steps[lead] for lead in alive}
    between = [_wrapped(own[b] - own[a]) for a in own for b in own if b == a % 3 + 1]
    return HallJudgement(
        tuple(faults),
        _wrapped(common + _SIXTH * shift),
        max((abs(gap) for gap in between), default=math.nan),
        max(abs(switched.duty - 0.5) for switched in alive.values()),
        explained=len(set(carried.values())) == len(carried),
    )


def _mean(angles: FloatArray | Sequence[float]) -> float:
    return float(np.angle(np.mean(np.exp(1j * np.asarray(angles)))))


def _scatter(angles: FloatArray) -> float:
    off = np.angle(np.exp(1j * (angles - _mean(angles))))
    return float(np.std(off, ddof=1)) if angles.size > 1 else 0.0


def _wrapped(angle: float) -> float:
    return math.remainder(angle, _TURN)
