"""Inductance readings while the shaft is turned slowly by hand: the angle is unknown, the speed not quite constant."""

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from procedures.estimation.checks import increasing, same_length, series
from procedures.estimation.fit import EstimationError, FloatArray
from procedures.estimation.rotor_sweep import SweepFit, resemblance, saliency_significant, sweep_fit

_CHIRPS = np.linspace(-0.6, 0.6, 25)
#: Degrees of the course that are tried; a hand that wavers several times during the sweep needs the high ones.
_DEGREES = (1, 2, 3, 4, 5, 6, 8, 10, 13, 17, 22, 27, 32, 38, 45, 53, 63)
#: Up to this degree the phase of the analytic signal, which ends short of the sweep's ends, determines a course.
_FOLLOWED = 32
#: So many degrees in a row without a better score, and no higher one is tried, unless what is left still hangs together:
#: neighbouring residuals correlate beyond chance where the course has yet to follow the hand.
_PATIENCE = 5
_HANGS_TOGETHER = 0.35
#: Weight of a coefficient of the course (rad) against a residual in standard deviations of the readings: too little to move
#: what the readings show, enough to keep a high degree from swinging where they show nothing (an extreme at an end).
_SMOOTH = 2e-3
#: Fewer periods than this determine no saliency; below this share of the mean there is none to determine.
LEAST_PERIODS, _NOTEWORTHY = 1.6, 2.5e-3
#: Over a period or more the amplitude is half the readings' range; much more is a fit that mean and cosine cancel in.
_PLAUSIBLE = 0.6


def _scan(x: FloatArray, values: FloatArray) -> tuple[FloatArray, float]:
    """Best course rate·x + chirp·T₂(x) of 2θ, and how many independent courses were compared; x runs from −1 to 1."""
    centred = values - np.mean(values)
    highest = min(0.45 * (values.size - 1), 60.0)
    periods = np.arange(0.7, max(highest, 2.0), 0.2)
    best, found = -1.0, np.array([0.0, 2 * np.pi])
    for chirp in _CHIRPS:
        # The rate runs from (1 − chirp) to (1 + chirp) of its mean.
        shape = x + 0.5 * chirp * (x**2 - 1)
        courses = np.exp(1j * np.pi * np.outer(periods, shape))
        power = np.abs(courses @ centred)
        index = int(np.argmax(power))
        if power[index] > best:
            best = float(power[index])
            found = np.pi * periods[index] * np.array([0.0, 1.0, 0.25 * chirp])
    return found, float(periods.size * 0.2 * _CHIRPS.size)


def _analytic_phase(x: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return places and phase (rad) of the analytic signal away from its ends; it follows a strongly varying speed."""
    even = np.linspace(-1.0, 1.0, x.size)
    centred = np.interp(even, x, values - np.mean(values))
    # Only what turns one way is left of the spectrum (as scipy.signal's hilbert does, which takes half a second to load).
    spectrum = np.fft.fft(centred)
    half = (x.size + 1) // 2
    spectrum[1:half] *= 2.0
    spectrum[x.size // 2 + 1 :] = 0.0
    phase = np.unwrap(np.angle(np.fft.ifft(spectrum)))
    inner = slice(x.size // 12, x.size - x.size // 12)
    return even[inner], np.asarray(phase[inner], dtype=np.float64)


def _refine(x: FloatArray, values: FloatArray, start: FloatArray, degree: int) -> tuple[FloatArray, float]:
    """Refine the course's coefficients (Chebyshev, constant left out), mean and amplitude solved for each."""
    basis = chebyshev.chebvander(x, degree)[:, 1:]
    begin = np.zeros(degree)
    known = min(degree, start.size - 1)
    begin[:known] = start[1 : known + 1]
    scale = float(np.std(values))
    smooth = _SMOOTH * np.eye(degree)[2:]

    def solved(c: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        course = basis @ c
        q, r = np.linalg.qr(np.column_stack((np.ones_like(course), np.cos(course), np.sin(course))))
        return course, q, np.linalg.lstsq(r, q.T @ values, rcond=None)[0]

    def residuals(c: FloatArray) -> FloatArray:
        _, q, _ = solved(c)
        return np.append((values - q @ (q.T @ values)) / scale, _SMOOTH * c[2:])

    def jacobian(c: FloatArray) -> FloatArray:
        course, q, k = solved(c)
        slope = (k[2] * np.cos(course) - k[1] * np.sin(course))[:, None] * basis
        return np.vstack(((q @ (q.T @ slope) - slope) / scale, smooth))

    found = least_squares(residuals, begin, jac=jacobian, max_nfev=40, method="lm", xtol=1e-9, ftol=1e-9)
    return np.append(0.0, found.x), float(2 * found.cost) * scale**2


def _hangs_together(x: FloatArray, values: FloatArray, coefficients: FloatArray) -> bool:
    """Whether each residual resembles its neighbour."""
    return resemblance(_residuals(x, values, coefficients)) > _HANGS_TOGETHER


def _left(x: FloatArray, values: FloatArray, coefficients: FloatArray) -> float:
    """Return what a course leaves of the readings' squares."""
    left = _residuals(x, values, coefficients)
    return float(left @ left)


def _residuals(x: FloatArray, values: FloatArray, coefficients: FloatArray) -> FloatArray:
    course = chebyshev.chebval(x, coefficients)
    design = np.column_stack((np.ones_like(course), np.cos(course), np.sin(course)))
    return np.asarray(values - design @ np.linalg.lstsq(design, values, rcond=None)[0], dtype=np.float64)


def _acceptable(x: FloatArray, values: FloatArray, coefficients: FloatArray) -> bool:
    """Whether the course never turns back, every period of it was sampled, and the amplitude is one the readings show."""
    course = chebyshev.chebval(x, coefficients)
    # From reading to reading, the first and the last left out: beside an extreme at an end, both sides fit as well.
    steps = np.diff(course)
    inner = steps[1:-1] * np.sign(course[-1] - course[0])
    if np.min(inner) <= 0.0 or np.max(np.abs(steps)) >= 0.97 * np.pi:
        return False
    design = np.column_stack((np.ones_like(course), np.cos(course), np.sin(course)))
    _, cosine, sine = np.linalg.lstsq(design, values, rcond=None)[0]
    return bool(np.hypot(cosine, sine) <= _PLAUSIBLE * np.ptp(values))


def fit_timed_sweep(
    time: ArrayLike, inductance: ArrayLike, *, largest_degree: int = 63, resolution: float = 0.0
) -> SweepFit:
    """Fit L = mean − amplitude·cos(2θ(t) + phase) to readings (H, shape (n,)) of a shaft turned slowly one way.

    θ(t) is a polynomial whose degree the data choose (corrected Akaike criterion), rising all along. At least one
    electrical turn (two periods of L) must be covered. `resolution` is one step of the readings (H). Raises
    EstimationError on fewer than 12 readings; a motor without saliency gives an amplitude that is not significant, or a small one
    of fewer periods: the induced voltage goes round once where the inductance goes round twice.
    """
    t, values = series("time", time, least=12), series("inductance", inductance, least=12)
    same_length(time=t, inductance=values)
    increasing(t)
    if np.ptp(values) == 0:
        raise EstimationError("all inductance readings are alike; check that the meter triggers anew for each reading")
    x = 2 * (t - t[0]) / (t[-1] - t[0]) - 1
    scanned, tried = _scan(x, values)
    n = t.size
    places, phase = _analytic_phase(x, values)
    best_score, best = np.inf, scanned[:2]
    course, worse = scanned, 0
    for degree in (d for d in _DEGREES if d <= min(largest_degree, n // 3)):
        starts = [scanned if degree <= 2 else course]
        if degree <= _FOLLOWED:
            starts.append(np.asarray(chebyshev.chebfit(places, phase, degree), dtype=np.float64))
        begin = min(starts, key=lambda start: _left(x, values, start[: degree + 1]))
        course, squares = _refine(x, values, begin, degree)
        parameters = degree + 4
        floor = n * resolution**2 / 12.0 + 1e-24 * float(values @ values)
        score = n * np.log((squares + floor) / n) + 2 * parameters * n / (n - parameters - 1)
        if score < best_score - 1e-9 and _acceptable(x, values, course):
            best_score, best, worse = float(score), course, 0
        elif not _hangs_together(x, values, course):
            worse += 1
        if worse >= _PATIENCE and degree > 6:
            break
    degree = best.size - 1
    fit = sweep_fit(chebyshev.chebval(x, best), values, chebyshev.chebvander(x, degree)[:, 1:], tried, resolution)
    noteworthy = fit.value("amplitude") > _NOTEWORTHY * fit.value("mean")
    if fit.periods < LEAST_PERIODS and noteworthy and saliency_significant(fit)[0]:
        raise EstimationError(
            f"the readings show only {fit.periods:.1f} periods of the inductance; turn the shaft over at least one electrical "
            "turn (two periods) during the sweep"
        )
    return fit
