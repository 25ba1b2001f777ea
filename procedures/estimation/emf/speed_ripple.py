"""The course of a phase along which the speed ripples, as a drill, a gear or a hand turns a shaft."""

from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from scipy import special

from procedures.estimation.emf.harmonics import HarmonicModel, by_phase, fit_harmonics
from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.noise import white_noise

#: A ripple is told where chance does as much once in so many records, from this angle on (rad, rms): less takes 10⁻⁴ of an amplitude away.
_BY_CHANCE, _LEAST = 1e-6, 0.015
#: Another line beside the fundamental moves amplitudes as much as phases; of what a ripple of the speed moves, phases have this share.
_OF_PHASE = 0.67
#: So many periods at least show a ripple; a course has so many of them for each of its degrees, and no more degrees than this.
_LEAST_PERIODS, _PERIODS, _MOST_DEGREE = 8, 2, 60
#: Of fewer periods no more degrees than this; they are looked at where a model leaves so many times the variance of noise.
_MOST_OF_FEW, _BEYOND_NOISE = 14, 1.1


class _Periods(NamedTuple):
    """What the model of a record leaves of each period, or nearly (P,): places −1 … 1 of their middles, angles (rad) with their standard
    uncertainties, and changes of the amplitude (relative).
    """

    places: FloatArray
    angles: FloatArray
    uncertainties: FloatArray
    amplitudes: FloatArray

    @property
    def swing(self) -> bool:
        """True if the angles swing as a speed's ripple makes them."""
        angle, size = float(np.mean(self.angles**2)), float(np.mean(self.amplitudes**2))
        chi = float(np.sum((self.angles / self.uncertainties) ** 2))
        by_chance = float(special.chdtri(self.angles.size, _BY_CHANCE))
        return angle > _LEAST**2 and chi > by_chance and angle > _OF_PHASE * (angle + size)


def _periods(t: FloatArray, orders: tuple[int, ...], model: HarmonicModel, fitted: FloatArray) -> _Periods | None:
    phase = model.phase(t)
    turned = float(phase[-1] - phase[0])
    count = round(turned / (2.0 * np.pi))
    if count < _LEAST_PERIODS or np.any(np.diff(phase) <= 0.0):
        return None
    # Up to both ends, so that no course is extended beyond what tells it.
    edges = np.searchsorted((phase - phase[0]) / turned * count, np.arange(count + 1))
    edges[-1] = t.size
    if np.any(np.diff(edges) < 2):
        return None
    weights = 1.0 / np.maximum(np.mean(model.residuals**2, axis=1), 1e-300)

    def summed(left: FloatArray, right: FloatArray) -> FloatArray:
        along = np.einsum("c,cn,cn->n", weights, left, right)
        return np.asarray(np.add.reduceat(along, edges[:-1]))

    slopes, wave = by_phase(model, orders, t), fitted - model.offsets[:, None]
    told = np.maximum(summed(slopes, slopes), 1e-300)
    angles = summed(slopes, model.residuals) / told
    amplitudes = summed(wave, model.residuals) / np.maximum(summed(wave, wave), 1e-300)
    middles = np.add.reduceat(model.place(t), edges[:-1]) / np.diff(edges)
    return _Periods(middles, angles, told**-0.5, amplitudes)


def speed_ripples(t: FloatArray, v: FloatArray, orders: tuple[int, ...], model: HarmonicModel) -> bool:
    """Return whether the phase of a record (C, n) swings about its model's by more than noise explains, so that an amplitude suffers."""
    left = _periods(t, orders, model, v - model.residuals)
    return left is not None and left.swing


def most_degree(periods: float) -> int:
    """Return the highest degree of a course that so many periods tell: a swing takes two, and is no shorter than a period."""
    return int(np.clip(_PERIODS * periods, 2, _MOST_OF_FEW))


def swings_in_few(t: FloatArray, v: FloatArray, orders: tuple[int, ...], model: HarmonicModel) -> bool:
    """Return whether the speed swings along a record (C, n) of few periods, in which no period shows it: a bent course of the phase leaves
    less than the model's, by more than chance, and most of what is no noise is gone with it.
    """
    periods = float(model.course[1]) / np.pi
    degree = most_degree(periods)
    if periods >= _LEAST_PERIODS or degree < model.course.size:
        return False
    noise = np.array([white_noise(row) for row in v]) ** 2
    left = np.mean(model.residuals**2, axis=1)
    if float(np.max(left / np.maximum(noise, 1e-300))) < _BEYOND_NOISE:
        return False
    try:
        bent = fit_harmonics(t, v, orders, np.append(model.course, np.zeros(degree + 1 - model.course.size)))
    except EstimationError:
        return False
    fallen = left - np.mean(bent.residuals**2, axis=1)
    weights = 1.0 / np.maximum(left, 1e-300)
    apart = bent.course.copy()
    apart[: model.course.size] -= model.course
    angle = chebyshev.chebval(np.linspace(-1.0, 1.0, 101), apart)
    chi = t.size * float(np.sum(np.log(left / (left - fallen))))
    return (
        float(np.std(angle)) > _LEAST
        and chi > float(special.chdtri(degree + 1 - model.course.size, _BY_CHANCE))
        and float(weights @ fallen) > _OF_PHASE * float(weights @ np.maximum(left - noise, 0.0))
    )


def rippling_courses(
    t: FloatArray, v: FloatArray, orders: tuple[int, ...], model: HarmonicModel
) -> tuple[FloatArray, ...]:
    """Return courses (rad, by Chebyshev polynomials) of higher degrees than the model's that the phases of its periods tell, the likeliest
    first; none where they tell none.
    """
    left = _periods(t, orders, model, v - model.residuals)
    if left is None or not left.swing:
        return ()
    degree, count = model.course.size - 1, left.angles.size
    most = min(_MOST_DEGREE, count // _PERIODS)
    if most <= degree:
        return ()
    # Of an orthogonal basis each degree takes its own part of χ².
    q, r = np.linalg.qr(chebyshev.chebvander(left.places, most) / left.uncertainties[:, None])
    parts = q.T @ (left.angles / left.uncertainties)
    best = int(np.argmax(np.cumsum(parts**2) - np.log(count) * np.arange(most + 1)))

    def of_degree(size: int) -> FloatArray:
        course = np.zeros(size + 1)
        course[: degree + 1] = model.course
        course[1:] += np.linalg.solve(r[: size + 1, : size + 1], parts[: size + 1])[1:]
        return course

    # From a course that swings too far between periods a fit does not converge; a lower degree is nearer.
    return tuple(of_degree(size) for size in (best, 3 * best // 4) if size > degree)
