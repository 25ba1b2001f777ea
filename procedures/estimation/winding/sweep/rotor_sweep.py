"""d- and q-axis inductance from readings over a turn of the rotor (§3.3.2, erratum E3)."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from procedures.estimation.fitting.checks import positive, same_length, series
from procedures.estimation.fitting.fit import EstimationError, Fit, FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit
from procedures.estimation.fitting.noise import white_noise
from procedures.estimation.winding.sweep.cut_readings import cut_off
from procedures.estimation.winding.sweep.terms import added_terms
from procedures.estimation.winding.sweep.wild_readings import named, wild_at_angles

MotorClass = Literal["SPMSM", "IPMSM"]
#: Residuals that resemble their neighbours more than this are no noise.
_ALIKE = 0.35
#: So many readings show a course from angle to angle; residuals of so many times their scatter are one.
_LEAST_SWING, _SWINGS = 12, 3.0
#: Of pole pairs up to so many, one that leaves no more than this share of the squares explains the readings.
_MOST_POLE_PAIRS, _EXPLAINED = 50, 0.2
#: Places of a period that lie less apart tell no amplitude: singular values' ratio.
_TOLD_APART = 0.02
#: Readings that differ by less than this share are one.
_ROUNDING = 1e-9
#: Stands for an amplitude or a column that is nil: its square is still a number.
_NOTHING = 1e-140
NAMES = ("mean", "amplitude", "phase")


@dataclass(frozen=True)
class SweepFit(Fit):
    """L = mean − amplitude·cos(2θ + phase): names `mean`, `amplitude` (H), `phase` (rad).

    `course` (n,) is 2θ + phase at each reading (rad), so that its multiples of 2π are the d axis; `periods` of the inductance
    were seen; `constant_squares` is Σ(L − mean L)², `tried` how many independent courses of
    2θ the data were compared with, `course_parameters` how many parameters 2θ itself took from the data; `turns` where the readings
    swing by more than their scatter. Readings that the others contradict are `left_out`, by their place in what was given: courses and
    residuals are without them.
    """

    course: FloatArray
    periods: float
    constant_squares: float
    tried: float
    course_parameters: int
    turns: bool = False
    left_out: tuple[int, ...] = ()


def _harmonic(course: FloatArray, inductance: FloatArray) -> tuple[FloatArray, float]:
    """Coefficients of 1, cos, sin of the course of 2θ (rad), and what they leave of Σ L²."""
    design = np.column_stack((np.ones_like(course), np.cos(course), np.sin(course)))
    coefficients, *_ = np.linalg.lstsq(design, inductance, rcond=None)
    left = inductance - design @ coefficients
    return coefficients, float(left @ left)


def _without_worst(course: FloatArray, inductance: FloatArray) -> float:
    """Return what mean and cosine of a course leave of Σ L² when the reading that is farthest off is left out."""
    design = np.column_stack((np.ones_like(course), np.cos(course), np.sin(course)))
    q, _ = np.linalg.qr(design)
    left = inductance - q @ (q.T @ inductance)
    free = np.maximum(1.0 - np.sum(q**2, axis=1), 1e-6)
    return float(left @ left) - float(np.max(left**2 / free))


def resemblance(residuals: FloatArray) -> float:
    """Return how much each residual resembles its neighbour: 0 for noise, 1 for a smooth course."""
    squares = float(residuals @ residuals)
    return min(float(residuals[1:] @ residuals[:-1]) / squares, 0.99) if squares else 0.0


def sweep_fit(
    course: FloatArray, inductance: FloatArray, extra: FloatArray | None, tried: float, resolution: float
) -> SweepFit:
    """Return the fit for a known course of 2θ (rad); `extra` (n, k) are its derivatives by fitted course parameters.

    `resolution` is one step of the readings (H).
    """
    coefficients, squares = _harmonic(course, inductance)
    mean, cosine, sine = (float(c) for c in coefficients)
    amplitude, phase = float(np.hypot(cosine, sine)), float(np.arctan2(sine, -cosine))
    design = np.column_stack(
        (np.ones_like(course), -np.cos(course + phase), max(amplitude, _NOTHING) * np.sin(course + phase))
    )
    course_parameters = 0
    if extra is not None and extra.shape[1]:
        design = np.column_stack((design, design[:, 2:] * extra))
        course_parameters = extra.shape[1]
    freedom = inductance.size - design.shape[1]
    if freedom < 1:
        raise EstimationError(
            f"{inductance.size} readings do not suffice for {design.shape[1]} parameters; take more readings"
        )
    scale = np.sqrt(np.sum(design**2, axis=0)) + _NOTHING
    _, s, vt = np.linalg.svd(design / scale, full_matrices=False)
    if s[1] < 1e-6 * s[0]:
        raise EstimationError("the readings do not cover enough angles to tell mean and amplitude apart; turn further")
    keep = s > 1e-10 * s[0]
    variance = max(squares / freedom, resolution**2 / 12.0)
    covariance = variance * (vt[keep].T / s[keep] ** 2) @ vt[keep] / np.outer(scale, scale)
    residuals = inductance - (mean - amplitude * np.cos(course + phase))
    alike = resemblance(residuals) if course_parameters else 0.0
    if alike > _ALIKE:
        # Where the course could not follow the hand, so many readings count as one.
        covariance = covariance * (1.0 + alike) / (1.0 - alike)
        freedom = max(int(freedom * (1.0 - alike) / (1.0 + alike)), 1)
    spread = inductance - np.mean(inductance)
    return SweepFit(
        names=NAMES,
        values=np.array([mean, amplitude, phase]),
        covariance=covariance[:3, :3],
        degrees_of_freedom=float(freedom),
        residuals=residuals,
        residual_rms=float(np.sqrt(squares / inductance.size)),
        course=course + phase,
        periods=float(np.ptp(course)) / (2 * np.pi),
        constant_squares=float(spread @ spread),
        tried=tried,
        course_parameters=course_parameters,
    )


def fit_rotor_sweep(
    angle: ArrayLike,
    inductance: ArrayLike,
    *,
    pole_pairs: int | None = None,
    resolution: float = 0.0,
) -> SweepFit:
    """Fit L(θ) = mean − amplitude·cos(2θ + phase) to inductance readings (H, shape (n,)) at known angles (rad).

    `pole_pairs` are those of a mechanical angle, 1 for an electrical one; without them the angle is mechanical and they are searched.
    `resolution` is one step of the readings (H). A meter's drift and what goes with the mechanical angle are taken out where the readings
    show them, see `misfit`. Raises EstimationError on too few readings or less than half a period. Source: spec limits, var(Ld) = 3σ²/(4M).
    """
    theta, values = series("angle", angle, least=4), series("inductance", inductance, least=4)
    same_length(angle=theta, inductance=values)
    if np.ptp(theta) <= 0:
        raise EstimationError("all readings were taken at one angle; turn the rotor between readings")
    tried = 1.0
    if pole_pairs is not None:
        rate = 2 * positive("pole_pairs", pole_pairs, "")
    else:
        candidates = _rates(theta)
        if not candidates:
            raise EstimationError("the angles cover less than one period of the inductance; turn the rotor further")
        rate = min(candidates, key=lambda r: _without_worst(r * theta, values))
        tried = float(len(candidates))
    if rate * np.ptp(theta) < np.pi:
        raise EstimationError(
            f"the angles cover {rate * np.ptp(theta) / (2 * np.pi):.2f} periods of the inductance; "
            "turn the rotor over at least one (half an electrical turn)"
        )
    _check_phases(rate * theta)
    mechanical = pole_pairs != 1
    wild = wild_at_angles(_expected(theta, rate, mechanical=mechanical), values, resolution)
    if not wild.size or cut_off(values, resolution):
        return _fit_at(theta, values, rate, tried, resolution, mechanical=mechanical)
    kept = np.delete(np.arange(values.size), wild)
    fit = _fit_at(theta[kept], values[kept], rate, tried, resolution, mechanical=mechanical)
    # A course is known up to its phase, which the fit has put on.
    at_wild = rate * theta + float(fit.course[0] - rate * theta[kept[0]])
    others = fit.value("mean") - fit.value("amplitude") * np.cos(at_wild)
    misfit = Misfit((*named(wild, values, others), *fit.misfit.findings))
    return replace(fit, misfit=misfit, left_out=tuple(wild.tolist()))


def _fit_at(
    theta: FloatArray, values: FloatArray, rate: float, tried: float, resolution: float, *, mechanical: bool
) -> SweepFit:
    """Return the fit of readings at angles (rad) whose inductance turns `rate` times as fast as they."""
    plain = sweep_fit(rate * theta, values, None, tried, resolution)
    wrong = (*cut_off(values, resolution), *_wrong_period(theta, values, plain, resolution))
    if wrong or not saliency_significant(plain)[0]:
        return replace(plain, misfit=Misfit(wrong))
    added = added_terms(theta, plain.course, values, mechanical=mechanical)
    if not added.findings and not any(added.doubt):
        return plain
    # What goes with time or with the mechanical angle is taken off, and its own uncertainty put on.
    fit = sweep_fit(rate * theta, values - added.shape, None, tried, resolution)
    grown = fit.covariance * added.growth + np.diag([*np.square(added.doubt), 0.0])
    return replace(fit, covariance=grown, misfit=Misfit(added.findings))


def _check_phases(course: FloatArray) -> None:
    """Raise EstimationError where all angles fall on one or two places of the inductance's period: the amplitude is then any."""
    size = np.linalg.svd(np.column_stack((np.ones_like(course), np.cos(course), np.sin(course))), compute_uv=False)
    if size[2] < _TOLD_APART * size[0]:
        raise EstimationError(
            "all angles fall on the same one or two places of the inductance's period, which tell no amplitude: take readings at steps "
            "that are no half or whole period (180° ÷ pole pairs is one)"
        )


def _expected(theta: FloatArray, rate: float, *, mechanical: bool) -> FloatArray:
    """Return the columns of what readings at angles may follow: mean, second harmonic, and where they are many what goes beside it."""
    course = rate * theta
    columns = [np.ones_like(course), np.cos(course), np.sin(course)]
    if theta.size > 24:
        columns += [np.linspace(-0.5, 0.5, theta.size), np.cos(2.0 * course), np.sin(2.0 * course)]
        columns += [part(k * theta) for k in (1, 2) for part in (np.cos, np.sin)] if mechanical else []
    basis, size, _ = np.linalg.svd(np.column_stack(columns), full_matrices=False)
    return np.asarray(basis[:, size > 1e-9 * size[0]])


def _rates(theta: FloatArray) -> list[float]:
    """Return the periods, per radian, that angles can tell, as far as pole pairs make them."""
    spacing, span = float(np.median(np.diff(np.unique(theta)))), float(np.ptp(theta))
    every = [2.0 * p for p in range(1, _MOST_POLE_PAIRS + 1)]
    return [rate for rate in every if rate * span >= 1.8 * np.pi and rate * spacing <= 0.9 * np.pi]


def _wrong_period(theta: FloatArray, values: FloatArray, fit: SweepFit, resolution: float) -> tuple[Finding, ...]:
    """Return the finding of readings that swing, by their course from angle to angle or by another period, but not at the one given."""
    if values.size < _LEAST_SWING or 2.0 * float(fit.residuals @ fit.residuals) < fit.constant_squares:
        return ()
    if float(np.ptp(values)) <= max(_ROUNDING * float(np.max(np.abs(values))), 1.5 * resolution):
        # One reading everywhere, or two neighbouring ones of the meter's, is no swing.
        return ()
    noise = white_noise(values[np.argsort(theta, kind="stable")], resolution)
    if fit.residual_rms <= _SWINGS * noise:
        rates = _rates(theta)
        if not rates or min(_harmonic(rate * theta, values)[1] for rate in rates) > _EXPLAINED * fit.constant_squares:
            return ()
    swing = float(np.ptp(values)) / float(np.mean(values))
    return (Finding(Cause.WRONG_PERIOD, Answer.WITHHELD, figures={"swing": swing}),)


def saliency_significant(fit: Fit, level: float = 0.05) -> tuple[bool, float]:
    """Return whether the 2θ component is more than chance, and the p-value (F test against a constant).

    Where the course of 2θ was itself searched in the data, the p-value is that of the best of all courses tried.
    """
    if not isinstance(fit, SweepFit):
        raise TypeError("saliency is tested on the fit of a rotor sweep")
    if fit.turns:
        return True, 0.0
    squares = float(fit.residuals @ fit.residuals)
    if squares <= 1e-20 * fit.constant_squares:
        return (fit.constant_squares > 0), 0.0 if fit.constant_squares > 0 else 1.0
    parameters = 2 + fit.course_parameters
    statistic = max(fit.constant_squares - squares, 0.0) / parameters / (squares / fit.degrees_of_freedom)
    single = float(special.fdtrc(parameters, fit.degrees_of_freedom, statistic))
    p = float(-np.expm1(fit.tried * np.log1p(-min(single, 1 - 1e-15))))
    return p < level, p


def axis_inductances(fit: SweepFit, factor: float = 1.0, level: float = 0.05) -> Fit:
    """Return `d_axis_inductance` and `q_axis_inductance` (H): factor·(mean ∓ amplitude), with their covariance.

    `factor` leads from the reading to the phase (see `connections.phase_factor`). Both are factor·mean where the saliency
    is not significant.
    """
    sign = 1.0 if saliency_significant(fit, level)[0] else 0.0
    jacobian = factor * np.array([[1.0, -sign, 0.0], [1.0, sign, 0.0]])
    return fit.derived(("d_axis_inductance", "q_axis_inductance"), list(jacobian @ fit.values), jacobian)


def extremes(inductance: ArrayLike) -> tuple[float, float]:
    """Return the smallest and the largest reading (H), as the note takes them (§3.3.2)."""
    values = series("inductance", inductance, least=2)
    return float(np.min(values)), float(np.max(values))


def motor_class(smallest: float, largest: float, threshold: float = 0.10) -> MotorClass:
    """Return "SPMSM" where the extremes (H) differ by less than `threshold` of the smaller one, else "IPMSM" (§3.3.2)."""
    low = positive("smallest inductance", smallest, "H")
    if largest < smallest:
        raise EstimationError(f"largest inductance {largest:g} H is below the smallest {smallest:g} H; swap them")
    return "SPMSM" if (largest - smallest) / low < threshold else "IPMSM"
