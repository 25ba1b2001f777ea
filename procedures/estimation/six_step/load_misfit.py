"""Contradictions between the readings at the loads of a six-step drive: between loads, and between meters.

Three things are read twice: the speed (tachometer, and the current's frequency), the current (out of the source, and one line's waveform),
and the power (electrical less losses, and at the shaft). The mean voltages of all loads lie on one plane over speed and current.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import special

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.linear import least_squares
from procedures.estimation.fitting.misfit import ALARM, NO_MISFIT, Answer, Cause, Finding, Misfit
from procedures.estimation.fitting.repeats import odd_reading, stands_out

#: A limit that is found from what contradicts reaches beyond it by this factor: nothing says that the other reading is exact.
_REACH = 1.25
#: Relative: a speed that is no reading of this shaft; a current that contradicts the other loads'.
_WILD_SPEED, _WILD_CURRENT = 0.03, 0.02
#: Relative: beyond these no figure is given. Speeds, currents, voltages, powers.
_MOST_SPEED, _MOST_CURRENT, _MOST_VOLTAGE, _MOST_POWER = 0.02, 0.1, 0.03, 0.1
#: A current's ratio that a wrong probe factor makes, not an error of gain.
_FACTOR = 0.25
#: Relative errors that no reading shows: of a frequency and the time base, of a mean current whose state begins half a degree late.
_FREQUENCY, _CURRENT, _POWER = 1e-4, 1.5e-3, 4e-3
#: Chance of a χ² that is one; other explanations within so much of the best are not excluded.
_CHANCE, CLOSE = 1e-3, 12.0
#: What a direction takes off χ² by chance, in more than nine of ten records.
_NOTICED = 3.0
#: Relative to R_c: a bend that matters; and the chance of one that is none.
_BENT, _CHANCE_BENT = 0.05, 2e-3
#: Loads that must be left, and that it takes to tell which of them is wrong.
_LEAST, _ENOUGH = 3, 4
#: What is said of the torque concerns no parameter, but the predictions that are made from the loads.
SHAFT_TORQUE = "shaft_torque"


@dataclass(frozen=True)
class MeterLimits:
    """Limits of relative error that were stated of a quantity's readings, at each load (n,), and its standard deviation by chance (n,)."""

    limit: FloatArray
    chance: FloatArray


@dataclass(frozen=True)
class LoadReadings:
    """Readings at n loads, each of shape (n,): speed (rad/s), the current's frequency (Hz), bus voltage (V), current (A) and torque (N·m).

    `supplied` is the mean current out of the source by the line's waveform (A).
    """

    speed: FloatArray
    frequency: FloatArray
    voltage: FloatArray
    current: FloatArray
    torque: FloatArray
    supplied: FloatArray


@dataclass(frozen=True)
class VoltagePlane:
    """Mean voltages (n,) in V less what is known of them, by `design` (n, k) of what is fitted; `covariance` (n, n) holds what chance and
    what is known of R_11, L11 − L12 and the temperatures let them differ. `further` (m, n) is what may add to them by a cause that has
    a direction.
    """

    design: FloatArray
    voltage: FloatArray
    covariance: FloatArray
    further: FloatArray

    def of(self, kept: Sequence[int]) -> "VoltagePlane":
        """Return it for some of the loads."""
        at = list(kept)
        return VoltagePlane(self.design[at], self.voltage[at], self.covariance[np.ix_(at, at)], self.further[:, at])

    def hidden(self) -> list[FloatArray]:
        """Return by how much each further direction may shift the estimates (k,) though it is not seen: by the part of z² beyond 3."""
        whole, squares = self.solved()
        result = []
        for direction in self.further:
            design = np.column_stack((self.design, direction))
            shifted, left = replace(self, design=design).solved()
            seen = squares - left
            if seen > _NOTICED:
                result.append(math.sqrt(1.0 - _NOTICED / seen) * (shifted[: whole.size] - whole))
        return result

    def solved(self) -> tuple[FloatArray, float]:
        """Return the estimates (k,) of equal weights, as they are fitted, and χ² of the ones that suit the covariance."""
        found, *_ = np.linalg.lstsq(self.design, self.voltage, rcond=None)
        white = np.linalg.inv(np.linalg.cholesky(self.covariance))
        design, voltage = white @ self.design, white @ self.voltage
        suited, *_ = np.linalg.lstsq(design, voltage, rcond=None)
        return np.asarray(found, dtype=np.float64), float(np.sum((voltage - design @ suited) ** 2))


@dataclass(frozen=True)
class LoadVerdict:
    """The loads that count, and the limits of error that cover contradictions (relative; 0 if the stated limits cover them).

    `speed`, `current` and `voltage` are limits of those readings, `torque` one in N·m; `shifts` how far the plane's estimates may be off
    together (each of shape (k,)); `speeds` the speeds (rad/s) that count.
    """

    misfit: Misfit
    kept: tuple[int, ...]
    speeds: FloatArray
    speed: float = 0.0
    current: float = 0.0
    voltage: float = 0.0
    torque: float = 0.0
    shifts: tuple[FloatArray, ...] = ()

    def also(self, misfit: Misfit) -> "LoadVerdict":
        """Return it with more findings."""
        return replace(self, misfit=Misfit.together((self.misfit, misfit)))


def judge_speeds(readings: LoadReadings, meter: MeterLimits, pole_pairs: int | None) -> LoadVerdict:
    """Compare tachometer and current's frequency; a speed that is no reading of this shaft is taken from the frequency."""
    turned = 2.0 * math.pi * readings.frequency
    every = tuple(range(turned.size))
    pairs = pole_pairs or max(1, round(float(np.median(turned / readings.speed))))
    off = readings.speed * pairs / turned - 1.0
    chance = np.hypot(meter.chance, _FREQUENCY)
    wild = np.abs(off) > np.maximum(_WILD_SPEED, 2.0 * meter.limit)
    if 2 * int(wild.sum()) >= off.size:
        figures = {"ratio": float(np.median(off)) + 1.0, "pairs": float(pairs)}
        return LoadVerdict(_found(Cause.SPEED_DIFFERS, Answer.WITHHELD, figures), every, readings.speed)
    speeds = np.where(wild, turned / pairs, readings.speed)
    misfit = NO_MISFIT
    if wild.any():
        figures = {"count": float(wild.sum()), "loads": float(off.size), "worst": _farthest(off)}
        misfit = _found(Cause.DROPOUTS, Answer.MODELLED, figures)
    off, chance, limit = off[~wild], chance[~wild], meter.limit[~wild]
    if np.all(np.abs(off) <= limit + ALARM * chance):
        return LoadVerdict(misfit, every, speeds)
    worst = _farthest(off)
    answer = Answer.WITHHELD if abs(worst) > _MOST_SPEED else Answer.WIDENED
    unsettled = _found(Cause.UNSETTLED, answer, {"worst": worst}, float(np.max(np.abs(off) / chance)))
    return LoadVerdict(Misfit.together((misfit, unsettled)), every, speeds, speed=_REACH * abs(worst))


def judge_currents(readings: LoadReadings, source: MeterLimits, line: MeterLimits, before: LoadVerdict) -> LoadVerdict:
    """Compare the current out of the source with the line's waveform; a load at which they differ otherwise than elsewhere is left out."""
    ratio = readings.supplied / readings.current
    odd = odd_reading(list(ratio), _WILD_CURRENT, float(np.median(source.chance)))
    kept = list(before.kept)
    if odd is not None and ratio.size > _LEAST and stands_out(list(ratio), odd):
        others = float(np.median(np.delete(ratio, odd)))
        kept.remove(odd)
        before = _without(before, kept, readings.torque[odd], ratio[odd] / others - 1.0, "six-step-current")
    off = ratio[kept] - 1.0
    chance = np.hypot(np.hypot(source.chance, line.chance)[kept], _CURRENT)
    worst = _farthest(off)
    if np.all(np.abs(off) <= (source.limit + line.limit)[kept] + ALARM * chance):
        return before
    figures = {"ratio": float(np.median(ratio[kept])), "factor": 1.0 / float(np.median(ratio[kept])), "worst": worst}
    factor = abs(float(np.median(off))) > _FACTOR
    cause = Cause.PROBE_FACTOR if factor else Cause.CHANNELS_DIFFER
    answer = Answer.WITHHELD if abs(worst) > _MOST_CURRENT else Answer.WIDENED
    found = _found(cause, answer, figures, float(np.max(np.abs(off) / chance)))
    return replace(before.also(found), current=_REACH * abs(worst))


def judge_voltages(plane: VoltagePlane, readings: LoadReadings, before: LoadVerdict) -> LoadVerdict:
    """Hold the loads' mean voltages against the plane through them: one that contradicts the others is left out, where it can be told."""
    kept = list(before.kept)
    whole, squares = plane.of(kept).solved()
    freedom = len(kept) - plane.design.shape[1]
    if freedom < 1:
        return before
    hidden = tuple(_REACH * shift for shift in plane.of(kept).hidden())
    if special.chdtrc(freedom, squares) > _CHANCE:
        return replace(before, shifts=hidden)
    without = {k: plane.of([j for j in kept if j != k]).solved() for k in kept}
    off = {k: float(plane.voltage[k] - plane.design[k] @ without[k][0]) for k in kept}
    best = min(kept, key=lambda k: without[k][1])
    told = (
        len(kept) >= _ENOUGH
        and special.chdtrc(freedom - 1, without[best][1]) > _CHANCE
        and not hidden
        and all(chi - without[best][1] > CLOSE for k, (_, chi) in without.items() if k != best)
    )
    if told:
        kept.remove(best)
        return _without(before, kept, readings.torque[best], off[best] / readings.voltage[best], "six-step")
    # Nobody can tell which load is wrong: what leaving each of them out would change is in the interval.
    shifts = (*hidden, *(_REACH * (found - whole) for found, _ in without.values()))
    worst = _REACH * max(abs(each) / readings.voltage[k] for k, each in off.items())
    largest = max(abs(float(shift[0])) for shift in shifts) / abs(float(whole[0]))
    answer = Answer.WITHHELD if max(worst, largest) > _MOST_VOLTAGE else Answer.WIDENED
    figures = {"worst": worst, "loads": float(len(kept))}
    found = _found(Cause.UNEXPLAINED, answer, figures, math.sqrt(squares / freedom))
    return replace(before.also(found), voltage=max(before.voltage, worst), shifts=shifts)


def judge_powers(
    readings: LoadReadings,
    lost: FloatArray,
    electrical: MeterLimits,
    shaft: MeterLimits,
    shaft_offset: float,
    before: LoadVerdict,
) -> LoadVerdict:
    """Hold the torque of the currents against that at the shaft: friction lies between, which does not grow as the speed falls.

    `lost` (n,) is the power (W) that windings and bridge take, `electrical` are the limits of voltage and current together, `shaft_offset`
    that of the torque (N·m). Where the voltages and the
    currents of all loads agree among themselves, a single load's torque or its zero is wrong; else the voltage's place or the gain of one.
    """
    kept = np.array(before.kept)
    made = (readings.voltage * readings.current - lost)[kept] / before.speeds[kept]
    balance = _Balance(
        before.speeds[kept],
        made,
        made - readings.torque[kept],
        (electrical.limit + shaft.limit)[kept],
        np.hypot(np.hypot(electrical.chance, _POWER)[kept] * made, shaft.chance[kept] * readings.torque[kept]),
    )
    negative = -balance.lost - balance.limit * made - shaft_offset - ALARM * balance.chance
    if not balance.grows() and negative.max() <= 0.0:
        return before
    at = int(np.argmax(np.abs(balance.lost - np.median(balance.lost))))
    figures = {"missing": float(balance.lost[at]), "torque": float(readings.torque[kept[at]])}
    wrong = [k for k in range(kept.size) if kept.size >= _ENOUGH and not balance.without(k).grows()]
    if balance.grows() and len(wrong) == 1:
        (at,) = wrong
        off = balance.lost[at] - float(np.median(np.delete(balance.lost, at)))
        figures = {"missing": abs(float(off)), "torque": float(readings.torque[kept[at]])}
        found = _found(Cause.LOAD_POINT, Answer.WIDENED, figures, record="six-step-torque", estimates=(SHAFT_TORQUE,))
        return replace(before.also(found), torque=_REACH * abs(float(off)))
    if not balance.grows():
        zero = -float(balance.lost.min())
        found = _found(Cause.TORQUE_ZERO, Answer.WIDENED, {"zero": zero}, estimates=(SHAFT_TORQUE,))
        return replace(before.also(found), torque=_REACH * zero)
    amount = float(np.max(np.abs(balance.lost - balance.lost[0]) / made))
    answer = Answer.WITHHELD if amount > _MOST_POWER else Answer.WIDENED
    found = _found(Cause.POWER_BALANCE, answer, {**figures, "share": amount})
    voltage = max(before.voltage, _REACH * amount)
    return replace(before.also(found), voltage=voltage, torque=_REACH * amount * float(made.max()))


@dataclass(frozen=True)
class _Balance:
    """Torque (N·m) that the currents make and what of it is lost before the shaft, at speeds (rad/s), all of shape (n,)."""

    speed: FloatArray
    made: FloatArray
    lost: FloatArray
    limit: FloatArray
    chance: FloatArray

    def without(self, load: int) -> "_Balance":
        """Return it without one load."""
        return _Balance(*(np.delete(v, load) for v in (self.speed, self.made, self.lost, self.limit, self.chance)))

    def grows(self) -> bool:
        """Tell whether what is lost changes from load to load as no friction does, beyond limits and chance."""
        grown = self.lost - self.lost[0]
        # A fan's friction falls with the square of the speed; nothing makes friction grow.
        falls = np.maximum(self.lost[0], 0.0) * (1.0 - (self.speed / self.speed[0]) ** 2)
        allowed = self.limit * np.abs(self.made - self.made[0]) + ALARM * np.hypot(self.chance, self.chance[0])
        return bool(np.any(np.maximum(grown, -grown - falls) > allowed))


@dataclass(frozen=True)
class Bend:
    """A line that bends: how far its slope turns from the middle to either end, and the finding."""

    turned: float
    misfit: Misfit


def bend(speed: FloatArray, resistance: FloatArray) -> Bend | None:
    """Return how R_c (Ω) bends over the speed (rad/s), None where it does not beyond chance, or by less than 5 % of itself."""
    freedom = speed.size - 3
    if freedom < 1:
        return None
    scale = 0.5 * float(np.ptp(speed))
    at = (speed - 0.5 * (speed.max() + speed.min())) / scale
    fit = least_squares(("bend", "slope", "height"), np.column_stack((at**2, at, np.ones_like(at))), resistance)
    curved, share = abs(fit.value("bend")), abs(fit.value("bend") / fit.value("height"))
    if share < _BENT or curved < float(special.stdtrit(freedom, 1.0 - 0.5 * _CHANCE_BENT)) * fit.uncertainty("bend"):
        return None
    return Bend(2.0 * curved / scale, _found(Cause.CURVATURE, Answer.WIDENED, {"bend": share}))


def _without(before: LoadVerdict, kept: list[int], torque: float, off: float, record: str) -> LoadVerdict:
    """Return what is left where one load, that at a torque (N·m), is left out for being off the others."""
    figures = {"torque": float(torque), "off": float(off), "left": float(len(kept))}
    found = _found(Cause.LOAD_POINT, Answer.MODELLED, figures, record=record)
    return replace(before.also(found), kept=tuple(kept))


def _found(
    cause: Cause,
    answer: Answer,
    figures: Mapping[str, float],
    score: float = 0.0,
    *,
    record: str = "six-step",
    estimates: tuple[str, ...] = (),
) -> Misfit:
    return Misfit((Finding(cause, answer, estimates, score, {**figures, "record": record}),))


def _farthest(values: FloatArray) -> float:
    """Return the value that is farthest from 0, with its sign."""
    return float(values[int(np.argmax(np.abs(values)))])
