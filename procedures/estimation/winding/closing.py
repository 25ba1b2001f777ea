"""Evaluates lines that are read again at the end: a winding that cools, contacts that differ each time."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, stdtrit

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.linear import least_squares
from procedures.estimation.fitting.misfit import NO_MISFIT, Answer, Cause, Finding, Misfit

#: A change is more than chance where chance alone would make it in this share of records.
_CHANCE = 5e-3
#: A fall of less than so many standard uncertainties is none.
_HARDLY = 1.2
#: What chance makes of the square of a change over its uncertainty, and this much more, does not count.
_BY_CHANCE = 2.5
#: What contacts may add over such a change: by more than chance they would be told, and these are few.
_HARDLY_ADDS = 2.5
#: The slowest time constant (s) with which a winding goes back to the temperature around it.
_SLOWEST = 2400.0
#: By one to three differences between contacts made anew (and more), what a contact may add over their rms: of a log-normal resistance
#: whose logarithm scatters by 0.5, in 95 % of cases.
_ADDED = (36.0, 10.0, 6.2)
#: A supply comes back to a current within this (relative standard uncertainty): no data sheet states it; that of a good readback.
_SET_AGAIN = 1e-4
#: Between two series of one line lie so many stretches of current as from one polarity to the other.
_STRETCHES = 8.0
#: Lines compare otherwise by two instruments beyond so many standard uncertainties; where contacts are suspected anyway, sooner.
_CLEARLY, _SUSPECTED = 4.0, 2.0
#: Beyond this share no interval is given.
_MOST = 0.05


@dataclass(frozen=True)
class ReadAgain:
    """A line's resistance once more: `change` (relative, later over earlier less one), its standard uncertainty and degrees of
    freedom, and the `seconds` between.

    `explained` is what the measurement itself may have made of it: a current that warms the winding.
    """

    change: float
    uncertainty: float
    degrees_of_freedom: float
    seconds: float
    explained: float = 0.0

    @property
    def left(self) -> float:
        """The change that is left where the explained share of it, or all, is taken for granted."""
        return self.change - min(max(self.change, min(0.0, self.explained)), max(0.0, self.explained))

    @property
    def changed(self) -> bool:
        """True if the change is more than chance, whatever explains it."""
        return self._beyond(self.change)

    @property
    def unexplained(self) -> bool:
        """True if the remaining change is more than chance."""
        return self._beyond(self.left)

    def _beyond(self, change: float) -> bool:
        return abs(change) > float(stdtrit(self.degrees_of_freedom, 1.0 - 0.5 * _CHANCE)) * self.uncertainty


@dataclass(frozen=True)
class Unsettled:
    """The result of a repeated reading of the lines: the finding, the relative upper bound of the excess of the resistance that
    was read, and the part of it due to warming.
    """

    misfit: Misfit = NO_MISFIT
    excess: float = 0.0
    warm: bool = False

    @property
    def contacts(self) -> float:
        """By what share a line may be too large through its contacts; 0 where none was seen to differ."""
        return self.excess if any(finding.cause is Cause.CONTACT for finding in self.misfit.findings) else 0.0


def read_again(
    first: Sequence[float],
    last: Sequence[float],
    others: Sequence[Sequence[float]],
    *,
    seconds: float,
    coarseness: float = 0.0,
) -> ReadAgain:
    """Return how two groups of readings of one line (Ω; two at least in each) compare, `seconds` apart.

    Their scatter is that of all groups together, with `others`, those of the other lines, and the instrument's `coarseness`: the standard
    uncertainty of a group's mean (relative) by the digits that are read.
    """
    groups = [np.asarray(group, dtype=np.float64) for group in (first, last, *others)]
    freedom = sum(group.size - 1 for group in groups)
    scatter = math.sqrt(sum(float(np.sum((g / g.mean() - 1.0) ** 2)) for g in groups) / freedom)
    spread = math.sqrt(scatter**2 * (1.0 / len(first) + 1.0 / len(last)) + 2.0 * coarseness**2)
    return ReadAgain(float(groups[1].mean() / groups[0].mean()) - 1.0, spread, float(freedom), seconds)


def four_wires_again(
    first: tuple[FloatArray, FloatArray, FloatArray], last: tuple[FloatArray, FloatArray, FloatArray]
) -> ReadAgain:
    """Return how two series of four-wire readings of one line compare: time (s), current (A), voltage (V), each of shape (n,).

    Both go through the same levels, first with plus, then with minus. Their voltages are compared level by level, since a supply comes
    back to a current more closely than it reads it. What the current warms stays from one polarity to the other, and is explained.
    """
    (began, i, v), (again, _, after) = first, last
    changed = least_squares(("change", "offset"), np.column_stack((i, np.ones_like(i))), after - v)
    half = len(i) // 2
    plus = np.column_stack((i[:half], np.ones(half)))
    resistance = least_squares(("resistance", "offset"), np.column_stack((i, np.ones_like(i))), v).value("resistance")
    rise = least_squares(("rise", "offset"), plus, v[:half] + v[half : 2 * half])
    risen = -rise.value("rise") + 2.0 * rise.uncertainty("rise")
    return ReadAgain(
        changed.value("change") / resistance,
        math.hypot(changed.uncertainty("change") / resistance, math.sqrt(2.0) * _SET_AGAIN),
        changed.degrees_of_freedom,
        float(np.mean(again) - np.mean(began)),
        explained=_STRETCHES * max(0.0, risen / resistance),
    )


def unsettled(again: Sequence[ReadAgain], parameter: str) -> Unsettled:
    """Return the findings of lines that were read again, empty if no change is more than chance.

    Changes at one falling rate are those of a winding that cools: it was warmer than its surroundings by that rate times its thermal
    time constant, which is not known. Any others are those of contacts, which only add.
    """
    seen = [each for each in again if each.unexplained]
    if not seen:
        # What is no more than chance may be a fall all the same, or a contact: it is told of nobody, and in the interval.
        falls = [
            -each.left / each.seconds for each in again if each.seconds and each.left < -_HARDLY * each.uncertainty
        ]
        if falls:
            return Unsettled(excess=min(_SLOWEST * max(falls), _MOST), warm=True)
        return Unsettled(excess=max((_hardly_seen(each) for each in again), default=0.0))
    left, seconds = np.array([each.left for each in again]), np.array([each.seconds for each in again])
    weight = 1.0 / np.array([max(each.uncertainty, 1e-9) for each in again]) ** 2
    # Readings that were typed from a list tell no time, in which a winding could have cooled.
    timed = float(np.sum(weight * seconds**2))
    rate = float(np.sum(weight * left * seconds)) / timed if timed else 0.0
    uncertainty = timed**-0.5 if timed else 0.0
    # A winding cools along an exponential, so that its rate is the same within a few percent only.
    spread = 1.0 / weight + (0.1 * rate * seconds) ** 2
    beside = float(np.sum((left - rate * seconds) ** 2 / spread))
    alike = len(again) == 1 or float(chdtrc(len(again) - 1, beside)) > 0.01
    added = _ADDED[min(len(again), len(_ADDED)) - 1] * float(np.sqrt(np.mean(left**2) / 2.0))
    cools = alike and rate < 0.0
    excess = max(added, _SLOWEST * (2.0 * uncertainty - rate)) if cools else added
    cause = Cause.WARM_WINDING if cools else Cause.CONTACT
    clearest = max(seen, key=lambda each: abs(each.left) / max(each.uncertainty, 1e-9))
    finding = Finding(
        cause,
        Answer.WITHHELD if excess > _MOST else Answer.WIDENED,
        (parameter,),
        score=min(abs(clearest.left) / max(clearest.uncertainty, 1e-9), 40.0),
        figures={"change": clearest.left, "seconds": clearest.seconds, "excess": excess},
    )
    return Unsettled(Misfit((finding,)), excess, cools)


def _hardly_seen(line: ReadAgain) -> float:
    """Return what contacts may add (relative) by a change that is no more than chance, as far as it is more than chance makes of most."""
    beyond = 1.0 - _BY_CHANCE * (line.uncertainty / line.change) ** 2 if line.change > 0.0 else 0.0
    return max(beyond, 0.0) * _HARDLY_ADDS * line.change


def contacts_made_anew(
    before: Sequence[float], now: Sequence[float], scatter: float, *, suspected: bool = False
) -> Unsettled:
    """Return what three lines read by two instruments (Ω, of AB, BC and CA each) show of contacts that were made anew in between.

    What an instrument is off by, and a winding that was warmer, are alike in all lines; one that cools changes them in the order of
    reading. `scatter` is the standard uncertainty (relative) of the two's ratio in a line. Contacts that are `suspected`, since a line
    has differed before, need not show as clearly, and may look like cooling.
    """
    ratios = np.asarray(now, dtype=np.float64) / np.asarray(before, dtype=np.float64)
    left = ratios / float(np.mean(ratios)) - 1.0
    # Three lines about their mean are two differences.
    rms = math.sqrt(float(left @ left) / 2.0)
    seen, limit = (rms, _SUSPECTED) if suspected else (abs(float(left @ (1.0, -2.0, 1.0))) / math.sqrt(6.0), _CLEARLY)
    if seen <= limit * scatter:
        return Unsettled()
    excess = _ADDED[1] * rms / math.sqrt(2.0)
    figures: dict[str, float | str] = {"record": "lines", "apart": float(np.ptp(left)), "excess": excess}
    answer = Answer.WITHHELD if excess > _MOST else Answer.WIDENED
    score = min(seen / max(scatter, 1e-9), 40.0)
    return Unsettled(Misfit((Finding(Cause.CONTACT, answer, ("stator_resistance",), score, figures),)), excess)
