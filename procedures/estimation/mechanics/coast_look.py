"""A first look at a coast-down: by Coulomb and viscous friction, and with a term over the square of speed."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from procedures.estimation.fitting.checks import increasing, same_length, series
from procedures.estimation.fitting.fit import EstimationError, FloatArray


class CoastCourse(NamedTuple):
    """Speeds (rad/s, (n,)) as a model has them, and what they leave of the readings (rad/s rms)."""

    fitted: FloatArray
    residual_rms: float


class CoastCourses(NamedTuple):
    """A coast-down by both models."""

    linear: CoastCourse
    quadratic: CoastCourse


def courses_at_sight(time: ArrayLike, speed: ArrayLike) -> CoastCourses:
    """Return a coast-down (s, rad/s, shape (n,)) by ω' = −a − b·ω and by ω' = −a − b·ω − c·ω·|ω|, in milliseconds.

    Least squares of the integral equations, whose integrals of the speed hardly feel the readings' noise. Raises EstimationError on fewer
    than 10 readings.
    """
    t, w = series("time", time, least=10), series("speed", speed, least=10)
    same_length(time=t, speed=w)
    increasing(t)
    top = float(np.max(np.abs(w)))
    if not top:
        raise EstimationError("the shaft stands still")
    x, y = (t - t[0]) / (t[-1] - t[0]), w / top
    columns = (np.ones_like(x), x, _integral(x, y), _integral(x, y * np.abs(y)))
    return CoastCourses(*(_course(np.column_stack(columns[:count]), w) for count in (3, 4)))


def _course(design: FloatArray, speed: FloatArray) -> CoastCourse:
    solution, *_ = np.linalg.lstsq(design, speed, rcond=None)
    fitted = design @ solution
    return CoastCourse(fitted, float(np.sqrt(np.mean((speed - fitted) ** 2))))


def _integral(x: FloatArray, values: FloatArray) -> FloatArray:
    return np.append(0.0, np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(x)))
