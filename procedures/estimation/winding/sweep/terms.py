"""Disturbances of inductance readings at known angles beside their second harmonic: run-out, a meter that drifts or jumps."""

from dataclasses import dataclass

import numpy as np
from scipy import special

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import ALARM, Answer, Cause, Finding
from procedures.estimation.winding.sweep.jump import clearest_jump

#: A term stands where chance alone would bring as much in this share of sweeps, and where so many readings more are left over.
_CHANCE, _SPARE = 1e-3, 6
#: Waves a turn that are less apart are one.
_SAME = 1e-6
#: Of a wave of the fourth or sixth order that three or four places a period do not tell from the second, up to this share of the amplitude
#: is expected; waves are told apart where this share of their squares is left.
_UNSEEN, _TOLD = 0.05, 0.05
#: A jump is as likely as what was found where χ² is no more than this higher.
_AS_LIKELY = 12.0
#: From this share of a mechanical turn on, what goes with it once is told from the mean.
_WHOLE = 0.9
#: What a drift does to the swing, share of what it does to the mean.
_SWING = 0.25
#: A closing reading that is off beyond so many standard deviations counts where anything else was found.
_CLOSING = 2.0


@dataclass(frozen=True)
class AddedTerm:
    """Correction of readings (n,): their `shape` (H), how variances of mean and amplitude grow, and what may be left in each (H)."""

    findings: tuple[Finding, ...]
    shape: FloatArray
    growth: float
    doubt: tuple[float, float]


def added_terms(angle: FloatArray, course: FloatArray, values: FloatArray, *, mechanical: bool) -> AddedTerm:
    """Return what readings (H) at angles (rad) hold beside mean and cosine of a course of 2θ (rad).

    Readings are taken one after the other; `mechanical` says that the angle is the shaft's.
    """
    wave = np.column_stack((np.ones_like(course), np.cos(course), np.sin(course)))
    order = np.linspace(-0.5, 0.5, values.size)
    groups = {Cause.SLOPE: np.column_stack((order, order * wave[:, 1], order * wave[:, 2]))}
    turns = float(np.ptp(angle)) / (2.0 * np.pi) * values.size / (values.size - 1)
    if mechanical:
        # Of one pole pair the inductance itself goes round twice a turn.
        rate = float(np.ptp(course) / np.ptp(angle))
        turning = [part(k * angle) for k in (1, 2) if abs(rate - k) > _SAME for part in (np.cos, np.sin)]
        groups[Cause.ECCENTRICITY] = np.column_stack(turning)
    design, found, slope = wave, [], 0
    coefficients, squares = _solve(design, values)
    plain = coefficients[:3]
    while groups:
        probable = {cause: _probability(design, group, values, squares) for cause, group in groups.items()}
        cause = min(probable, key=lambda each: probable[each])
        if probable[cause] > _CHANCE:
            break
        design = np.column_stack((design, groups.pop(cause)))
        coefficients, squares = _solve(design, values)
        partial = cause is Cause.ECCENTRICITY and turns < _WHOLE
        figures: dict[str, float | str] = {"order": 1.0} if cause is Cause.ECCENTRICITY else {}
        score = float(-special.ndtri(max(0.5 * probable[cause], 1e-300)))
        found.append(Finding(cause, Answer.WIDENED if partial else Answer.MODELLED, score=score, figures=figures))
        if cause is Cause.SLOPE:
            slope = len(design[0]) - 3
    jump = clearest_jump(wave, values) if values.size > wave.shape[1] + _SPARE else None
    if jump and not found and jump.probability < _CHANCE:
        score = float(-special.ndtri(max(0.5 * jump.probability, 1e-300)))
        found.append(Finding(Cause.SLOPE, Answer.WIDENED, score=score))
        design = np.column_stack((wave, jump.column))
        coefficients, squares = _solve(design, values)
    noise = float(np.sqrt(squares / max(values.size - len(coefficients), 1)))
    # A jump may pass for run-out or for a drift.
    as_likely = bool(found) and jump is not None and jump.squares <= squares + _AS_LIKELY * noise**2
    jumped = abs(jump.height) if jump and as_likely else 0.0
    shape = design[:, 3:] @ coefficients[3:]
    before = np.diag(np.linalg.pinv(wave.T @ wave))
    after = np.diag(np.linalg.pinv(design.T @ design))[:3]
    widened = any(f.cause is Cause.ECCENTRICITY and f.answer is Answer.WIDENED for f in found)
    doubt = float(np.max(np.abs(coefficients[:3] - plain))) if widened else 0.0
    # When on its way a meter that drifts, or jumps, was right is not known.
    straight = float(coefficients[slope]) if slope else 0.0
    # A jump may pass for run-out: where anything was found, the closing reading says so sooner.
    least = (_CLOSING if found else ALARM) * float(np.sqrt(2.0)) * noise
    drifted = 0.5 * max(_drifted(angle, values, straight, least), jumped)
    mean, amplitude = _of_waves(wave, course, design, values)
    return AddedTerm(
        tuple(found),
        np.asarray(shape),
        float(np.max(after / before)),
        (float(np.linalg.norm((doubt, drifted, mean))), float(np.linalg.norm((doubt, _SWING * drifted, amplitude)))),
    )


def _of_waves(wave: FloatArray, course: FloatArray, design: FloatArray, values: FloatArray) -> tuple[float, float]:
    """Return what waves of the fourth and of the sixth order leave open in mean and amplitude (standard uncertainties, H).

    They may be the winding's own, or made by angles that the magnets' detent moves: twice as often a period as the inductance, that
    moves mean and amplitude by as much as it makes of the fourth order, four times as often the amplitude by as much as of the sixth.
    """
    doubts = []
    coefficients, _ = _solve(design, values)
    for order in (2.0, 3.0):
        group = np.column_stack((np.cos(order * course), np.sin(order * course)))
        told, size = _told(wave, group), 0.0
        # What was found beside the wave may be this, where the places do not tell them apart.
        beside = design if _told(design, group) > _TOLD else wave
        if told <= _TOLD:
            size = _UNSEEN * float(np.hypot(*coefficients[1:3]))
        elif _probability(beside, group, values, _solve(beside, values)[1]) < _CHANCE:
            # Where places show one of its phases only, the other may be as large.
            size = float(np.hypot(*_solve(np.column_stack((beside, group)), values)[0][-2:])) / np.sqrt(min(told, 1.0))
        doubts.append(size / np.sqrt(3.0))
    return doubts[0], float(np.hypot(*doubts))


def _drifted(angle: FloatArray, values: FloatArray, straight: float, least: float) -> float:
    """Return how far readings drifted: as a straight line says, or, where that is more than `least`, the first angle read again."""
    again = angle[-1] != angle[0] and np.isclose(np.cos(angle[-1] - angle[0]), 1.0, atol=1e-9)
    closing = abs(float(values[-1] - values[0])) if again else 0.0
    return max(abs(straight), closing if straight or closing > least else 0.0)


def _told(design: FloatArray, group: FloatArray) -> float:
    """Return which share of a group of terms readings at these places tell from the design's."""
    left = group - design @ np.linalg.lstsq(design, group, rcond=None)[0]
    return float(np.sum(left**2) / np.sum(group**2))


def _solve(design: FloatArray, values: FloatArray) -> tuple[FloatArray, float]:
    coefficients, *_ = np.linalg.lstsq(design, values, rcond=None)
    left = values - design @ coefficients
    return np.asarray(coefficients, dtype=np.float64), float(left @ left)


def _probability(design: FloatArray, group: FloatArray, values: FloatArray, squares: float) -> float:
    """Return how probable it is by chance that a group of terms takes so much off the squares (F test)."""
    whole = np.column_stack((design, group))
    freedom = values.size - whole.shape[1]
    if freedom < _SPARE or squares <= 1e-20 * float(values @ values):
        return 1.0
    _, left = _solve(whole, values)
    count = int(np.linalg.matrix_rank(whole)) - design.shape[1]
    if count < 1:
        return 1.0
    return float(special.fdtrc(count, freedom, (squares - left) / count / max(left / freedom, 1e-300)))
