"""Evaluates the short circuit of a turned motor: resistance and inductances from its currents, resistance and peak from its torque.

In the rotor's frame, all three terminals joined, 0 = R·i_d − ω·L_q·i_q and 0 = R·i_q + ω·(L_d·i_d + λ), so that
I = λω·√(R² + ω²L_q²) / (R² + ω²·L_d·L_q), and all that the shaft gives is heat: T·ω_mech = 1.5·R·I². Currents are peak, inductances
those of the Y-equivalent, ω electrical.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from procedures.estimation.fitting.checks import positive, same_length, series
from procedures.estimation.fitting.fit import EstimationError, Fit, FloatArray
from procedures.estimation.fitting.nonlinear import solve

RESISTANCE, D_INDUCTANCE, SALIENCY = "resistance", "d_axis_inductance", "saliency"
_NAMES = (RESISTANCE, D_INDUCTANCE, SALIENCY)
#: What is known of L_q / L_d where nobody has measured it, as a standard deviation of its logarithm about this ratio.
_USUAL, _SPREAD = 1.5, 0.8
#: How well the course of a measured warming is known, as a share of it (standard uncertainty).
_COURSE = 0.3
#: Below the bend currents tell R and no L_d: it stays within some powers of ten (standard deviation of its logarithm) of λ/I.
_ANY = 3.0
#: Where warmth would have L_d negative, each step brings little.
_ROUNDS = 5000
_STEP = 1e-5


def current(speed: ArrayLike, resistance: float | FloatArray, ld: float, lq: float, flux: float) -> FloatArray:
    """Return the current's amplitude (A) at electrical speeds (rad/s) of a motor without saturation (Ω, H, V·s/rad)."""
    omega = np.asarray(speed, dtype=np.float64)
    result: FloatArray = flux * omega * np.hypot(resistance, omega * lq) / (resistance**2 + omega**2 * ld * lq)
    return result


def d_axis_current(speed: ArrayLike, resistance: float, ld: float, lq: float, flux: float) -> FloatArray:
    """Return the d-axis current (A, negative) at electrical speeds (rad/s)."""
    omega = np.asarray(speed, dtype=np.float64)
    result: FloatArray = -flux * omega**2 * lq / (resistance**2 + omega**2 * ld * lq)
    return result


def peak_speed(resistance: float, ld: float, lq: float) -> float:
    """Return the electrical speed (rad/s) at which the braking torque is largest: x·R/√(L_d·L_q), x = 1, 1.33 for L_q/L_d = 1, 2."""
    saliency = lq / ld
    root = math.sqrt((3.0 * saliency - 3.0) ** 2 + 4.0 * saliency)
    return math.sqrt((3.0 * saliency - 3.0 + root) / (2.0 * saliency)) * resistance / math.sqrt(ld * lq)


def fit_currents(
    speed: ArrayLike,
    amplitude: ArrayLike,
    uncertainty: ArrayLike,
    flux: float,
    *,
    ranges: ArrayLike = (),
    gain: float = 0.0,
    saliency: tuple[float, float] = (_USUAL, _SPREAD),
    warmings: ArrayLike = (),
) -> Fit:
    """Fit R (Ω), L_d (H) and ξ = L_q/L_d to amplitudes (A) at electrical speeds (rad/s), the flux linkage (V·s/rad) being known.

    `uncertainty` (A) is each amplitude's own. Amplitudes that were read in one of `ranges` (n,) share its error of gain, half-width `gain`,
    relative. `saliency` is what is known of ξ: a value, and the standard deviation of its logarithm. R and L_q are nearly one
    parameter: what ξ is not known by is in R. R is that of the first point; `warmings` (n,) is by how much (relative) it had risen at
    each, whose course is known to 0.3 of it: below the bend a current falls by warmth as by an inductance.

    The residuals are relative. Where points scatter beyond their uncertainties, the covariance grows with them. Raises EstimationError
    for less than four points.
    """
    omega, size, own = (
        series("speeds", speed, least=4),
        series("amplitudes", amplitude),
        series("uncertainties", uncertainty),
    )
    same_length(speeds=omega, amplitudes=size, uncertainties=own)
    positive("flux linkage", flux, "V·s/rad")
    if np.any(omega <= 0.0) or np.any(size <= 0.0):
        raise EstimationError("a speed or an amplitude is not above zero; give sizes only")
    warm = np.zeros(omega.size) if np.size(warmings) == 0 else series("warmings", warmings)
    same_length(speeds=omega, warmings=warm)
    whiten = _whitener(own / size, np.asarray(ranges, dtype=np.float64), gain, _COURSE * warm)
    ratio, spread = saliency
    target = np.log(size)
    slowest, fastest = int(np.argmin(omega)), int(np.argmax(omega))
    start = np.log([flux * omega[slowest] / size[slowest], flux / size[fastest], ratio])
    spreads = np.array([_ANY, spread])

    def model(values: FloatArray) -> FloatArray:
        r, ld, xi = np.exp(values)
        return np.log(current(omega, r * (1.0 + warm), ld, ld * xi, flux))

    def evaluate(values: FloatArray) -> tuple[FloatArray, FloatArray]:
        left = np.append(whiten @ (model(values) - target), (values[1:] - start[1:]) / spreads)
        slopes = []
        for k in range(3):
            step = np.zeros(3)
            step[k] = _STEP
            rise = whiten @ (model(values + step) - model(values - step)) / (2.0 * _STEP)
            slopes.append(np.append(rise, np.eye(3)[k, 1:] / spreads))
        return left, np.array(slopes)

    solution = solve(evaluate, start, np.full(3, 0.1), _NAMES, rounds=_ROUNDS)
    freedom = float(omega.size - 2)
    growth = max(solution.cost / freedom, 1.0)
    values = np.exp(solution.values)
    covariance = growth * solution.covariance * np.outer(values, values)
    residuals = target - model(solution.values)
    return Fit(_NAMES, values, covariance, freedom, residuals, float(np.sqrt(np.mean(residuals**2))))


def _whitener(relative: FloatArray, ranges: FloatArray, gain: float, warmth: FloatArray) -> FloatArray:
    covariance = np.diag(relative**2) + np.outer(warmth, warmth)
    if ranges.size:
        covariance += (gain**2 / 3.0) * (ranges[:, np.newaxis] == ranges)
    result: FloatArray = np.linalg.inv(np.linalg.cholesky(covariance))
    return result


@dataclass(frozen=True)
class BrakingTorque:
    """Resistance (Ω) from the torque, and the torque's peak (N·m, positive) with its electrical speed (rad/s).

    `residuals` (n,) are what the torques (N·m) leave of 1.5·p·R·I²/ω. The peak is None where no point lies beyond it.
    """

    resistance: float
    uncertainty: float
    degrees_of_freedom: float
    residuals: FloatArray
    peak: tuple[float, float] | None = None
    peak_uncertainties: tuple[float, float] = (0.0, 0.0)


def fit_torque(
    speed: ArrayLike, amplitude: ArrayLike, torque: ArrayLike, uncertainty: ArrayLike, pole_pairs: float
) -> BrakingTorque:
    """Return the resistance that takes the power of braking torques (N·m, positive) at electrical speeds (rad/s), amplitudes in A.

    `uncertainty` (N·m) is each torque's own; where they scatter beyond it, the result's grows. Raises EstimationError for less than three.
    """
    omega, size = series("speeds", speed, least=3), series("amplitudes", amplitude)
    pull, own = series("torques", torque), series("uncertainties", uncertainty)
    same_length(speeds=omega, amplitudes=size, torques=pull, uncertainties=own)
    design = 1.5 * pole_pairs * size**2 / omega
    weight = 1.0 / own**2
    normal = float(np.sum(weight * design**2))
    resistance = float(np.sum(weight * design * pull)) / normal
    residuals = pull - resistance * design
    freedom = float(omega.size - 1)
    growth = max(float(np.sum(weight * residuals**2)) / freedom, 1.0)
    return BrakingTorque(resistance, math.sqrt(growth / normal), freedom, residuals)


def with_peak(
    torque_fit: BrakingTorque,
    currents: Fit,
    speed: ArrayLike,
    torque: ArrayLike,
    flux: float,
    pole_pairs: float,
) -> BrakingTorque:
    """Return it with the peak of the torque, where points lie on both sides of it.

    The torque's course is that of the currents' fit, its size that of the torques near the peak.
    """
    omega, pull = series("speeds", speed), series("torques", torque)
    r, ld, xi = (currents.value(name) for name in _NAMES)
    top = peak_speed(r, ld, ld * xi)
    if not float(np.min(omega)) < top < float(np.max(omega)):
        return torque_fit

    def course(at: ArrayLike) -> FloatArray:
        where = np.asarray(at, dtype=np.float64)
        return 1.5 * pole_pairs * r * current(where, r, ld, ld * xi, flux) ** 2 / where

    near = np.argsort(np.abs(np.log(omega / top)))[:4]
    ratios = pull[near] / course(omega[near])
    scale = float(np.mean(ratios))
    spread = float(np.std(ratios, ddof=1)) / math.sqrt(ratios.size)
    by_resistance = currents.uncertainty(RESISTANCE) / r
    by_inductance = currents.uncertainty(D_INDUCTANCE) / ld
    by_saliency = 0.5 * currents.uncertainty(SALIENCY) / xi
    u_speed = top * math.sqrt(by_resistance**2 + by_inductance**2 + by_saliency**2)
    size = scale * float(course(top))
    return replace(
        torque_fit,
        peak=(size, top),
        peak_uncertainties=(math.hypot(size * spread / scale, torque_fit.uncertainty / r * size), u_speed),
    )
