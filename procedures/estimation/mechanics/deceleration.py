"""The deceleration of a shaft that coasts, at named speeds and without any law of friction."""

from typing import NamedTuple

import numpy as np
from numpy.polynomial import Legendre, Polynomial
from scipy import signal

from procedures.estimation.fitting.fit import FloatArray, coverage_interval
from procedures.estimation.fitting.noise import undithered
from procedures.estimation.mechanics.turning import Run

#: Fewer readings on one side of a speed tell no slope there.
_LEAST = 12
#: The degrees of a window's polynomial and of the one that it is held against, and how often one is fitted until the shaft's angle is its
#: own.
_CUBIC, _QUINTIC, _ROUNDS = 3, 5, 4
#: Windows are narrower by this factor each, and agree where their slopes differ by less than so many standard deviations.
_NARROWER, _AGREE = 2.0**0.5, 1.3
#: By so many times what two windows differ beyond chance a slope may be off.
_WINDOWS_GROW = 2.0
#: Friction does not bend within this share of the top speed.
_NO_BEND = 0.1
#: What comes once a turn is told from the course in no window in which the shaft turns by less (rad).
_TURNED = 4.0 * np.pi
#: Residuals that go together over up to this part of a window are counted as they do.
_TOGETHER = 12
#: They are looked for in so many times the window too, beside a polynomial of this degree.
_BESIDE, _COURSE = 4.0, 7


class Deceleration(NamedTuple):
    """What a coast-down shows at a `speed` (rad/s): deceleration and standard uncertainty (rad/s²)."""

    speed: float
    value: float
    uncertainty: float
    degrees_of_freedom: float

    @property
    def told(self) -> bool:
        """Whether the readings tell that the shaft slows down there."""
        return coverage_interval(self.value, self.uncertainty, self.degrees_of_freedom)[0] > 0.0


class _Slope(NamedTuple):
    value: float
    uncertainty: float
    freedom: float


class _Window(NamedTuple):
    """Readings about an instant (s), as far as `reaches` (s) before and after it."""

    part: slice
    middle: float
    reaches: tuple[float, float]


def deceleration(run: Run, speed: float) -> Deceleration | None:
    """Return the deceleration of a coast-down at a speed (rad/s), None where the record does not carry it.

    It is the slope of a cubic, beside a ripple once a turn, in a window about the instant at which the speed is passed. The window is one
    step narrower than the widest with which all narrower ones agree (Lepski, Theory Probab. Appl. 35 (1991) 454). What the two and a
    quintic differ by is in the uncertainty, and so is scatter that goes together over many readings. Where friction changes along the
    record, it is that as the speed is passed. A filter of the speed that is stated is undone.
    """
    # A reading more or less above the speed moves the place by one, however the readings scatter.
    place = int(np.count_nonzero(run.speed > speed))
    if not _LEAST <= place <= run.speed.size - _LEAST:
        return None
    fitted = [
        (window, slope) for window in _windows(run, place) if (slope := _slope(run, window, speed, _CUBIC)) is not None
    ]
    if not fitted:
        return None
    slopes = [slope for _, slope in fitted]
    widest = next(k for k in range(len(slopes)) if all(_agree(slopes[k], each) for each in slopes[k + 1 :]))
    window, taken = fitted[min(widest + 1, len(fitted) - 1)]
    freer = _slope(run, window, speed, _QUINTIC)
    if freer is None:
        return None
    others = [slopes[widest], freer]
    if widest + 1 == len(fitted):
        # No narrower window says that a cubic is free enough.
        others, taken = [taken], freer
    off = max(_apart(taken, each) for each in others)
    uncertainty = float(np.sqrt(taken.uncertainty**2 + _WINDOWS_GROW**2 * off))
    return Deceleration(speed, taken.value, uncertainty, taken.freedom)


def _apart(one: _Slope, other: _Slope) -> float:
    """Return the square of what two slopes differ by beyond chance."""
    return max((one.value - other.value) ** 2 - abs(one.uncertainty**2 - other.uncertainty**2), 0.0)


def top_of(run: Run) -> float:
    """Return the speed (rad/s) with which a coast-down begins."""
    return float(np.median(run.speed[:_LEAST]))


def _windows(run: Run, place: int) -> list[_Window]:
    middle = 0.5 * float(run.time[place - 1] + run.time[place])
    before, after = middle - float(run.time[0]), float(run.time[-1]) - middle
    windows: list[_Window] = []
    width, least = max(before, after), _NO_BEND * top_of(run)
    while True:
        first = int(np.searchsorted(run.time, middle - width))
        last = int(np.searchsorted(run.time, middle + width, side="right"))
        third = max((last - first) // 3, 1)
        falls = 1.5 * float(np.mean(run.speed[first : first + third]) - np.mean(run.speed[last - third : last]))
        turned = float(np.trapezoid(run.speed[first:last], run.time[first:last]))
        if min(place - first, last - place) < _LEAST or (windows and falls < least) or turned < _TURNED:
            return windows
        windows.append(_Window(slice(first, last), middle, (min(width, before), min(width, after))))
        width /= _NARROWER


def _agree(wide: _Slope, narrow: _Slope) -> bool:
    # The readings of the one are among those of the other.
    apart = max(narrow.uncertainty**2 - wide.uncertainty**2, 0.1 * narrow.uncertainty**2)
    return bool(abs(wide.value - narrow.value) <= _AGREE * np.sqrt(apart))


def _slope(run: Run, window: _Window, speed: float, degree: int) -> _Slope | None:
    """Return the deceleration where a polynomial through a window passes the speed; None where it does not fall there."""
    time, readings = run.time[window.part] - window.middle, run.speed[window.part]
    scale = max(window.reaches)
    x = time / scale
    # Weights that end softly let next to nothing of a ripple through.
    weights = np.square(np.maximum(1.0 - np.square(time / np.where(time < 0.0, *window.reaches)), 0.0))
    orders = np.arange(degree + 1)
    powers = x[:, None] ** orders
    design = powers
    for _ in range(_ROUNDS):
        weighted = design * weights[:, None]
        try:
            gain = np.linalg.solve(weighted.T @ design, weighted.T)
        except np.linalg.LinAlgError:
            return None
        coefficients = gain @ readings
        left = readings - design @ coefficients
        course = Polynomial(coefficients[: degree + 1])
        # A sensor out of centre ripples once a turn; sampled more slowly than that, its ripple looks like another course.
        angle, size = scale * course.integ()(x), course(x) / speed
        design = np.column_stack((powers, size * np.cos(angle), size * np.sin(angle)))
    found = _passing(course, run.speed_filter / scale, speed)
    if found is None:
        return None
    falling, row = found
    row = row @ gain[: degree + 1] / scale
    variance, freedom = _scatter(row, left, max(row.size - degree - 3, 1))
    beside = _beside(run, window)
    if beside.size >= 2 * row.size:
        elsewhere = signal.fftconvolve(beside, row[::-1], mode="valid")
        seen = float(elsewhere @ elsewhere) / elsewhere.size
        if seen > variance:
            variance, freedom = seen, min(freedom, 2.0 * beside.size / row.size)
    # Readings that lie on few steps are off for as long as a step takes.
    steps = max(float(np.ptp(readings)) / run.resolution, 1.0) if run.resolution > 0.0 else 1.0
    coarse = undithered(run.noise, run.resolution) * float(np.sum(np.abs(row))) / np.sqrt(steps)
    return _Slope(-falling / scale, float(np.sqrt(variance + coarse**2)), freedom)


def _passing(course: Polynomial, behind: float, speed: float) -> tuple[float, FloatArray] | None:
    """Return the slope of a course, freed of a filter that is `behind`, where it passes a speed, and by how much the deceleration there
    grows with each coefficient (n,); None where it does not fall, or passes the speed elsewhere.
    """
    rising, bending, twisting = (course.deriv(k) for k in (1, 2, 3))
    at = 0.0
    for _ in range(4):
        falling = float(rising(at) + behind * bending(at))
        if not falling < 0.0:
            return None
        at -= float(course(at) + behind * rising(at) - speed) / falling
        if abs(at) > 0.5:
            return None
    falling = float(rising(at) + behind * bending(at))
    orders = np.arange(course.coef.size)
    level = at**orders
    steep = orders * at ** np.maximum(orders - 1, 0)
    bent = orders * (orders - 1) * at ** np.maximum(orders - 2, 0)
    # The instant moves with the level.
    turning = float(bending(at) + behind * twisting(at)) / falling
    return falling, -(steep + behind * bent - turning * (level + behind * steep))


def _beside(run: Run, window: _Window) -> FloatArray:
    """Return what a smooth course leaves of the readings in and beside a window."""
    width = _BESIDE * max(window.reaches)
    first = int(np.searchsorted(run.time, window.middle - width))
    last = int(np.searchsorted(run.time, window.middle + width, side="right"))
    time, readings = run.time[first:last], run.speed[first:last]
    if time.size <= 4 * _COURSE:
        return readings[:0]
    return np.asarray(readings - Legendre.fit(time, readings, _COURSE)(time))


def _scatter(row: FloatArray, left: FloatArray, freedom: int) -> tuple[float, float]:
    """Return the variance of row·readings by what a fit left of them, and its degrees of freedom: as if they were independent, or with
    what neighbours have in common, whichever is larger.
    """
    count = row.size
    alone = float(row @ row) * float(left @ left) / freedom
    # Products of neighbours over up to each length, weighted as Bartlett does.
    products = np.concatenate(([0.0], np.cumsum(row * left)))
    together, length = alone, 2
    while length <= count // _TOGETHER:
        padded = np.concatenate((np.zeros(length), products, np.full(length, products[-1])))
        sums = padded[length:] - padded[:-length]
        together = max(together, count / freedom * float(sums @ sums) / length)
        length *= 2
    return together, float(freedom if together == alone else min(freedom, _TOGETHER))
