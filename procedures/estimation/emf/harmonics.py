"""Least squares of a periodic waveform on several channels at once, its phase a polynomial in time."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import chebyshev

from procedures.estimation.fitting.fit import EstimationError, FloatArray

#: A step of the course below this share of its standard uncertainty is the last one.
_LAST_STEP = 3e-3
#: A refinement that takes more steps does not converge.
_ROUNDS = 30
#: Samples whose waveform is built at once.
_AT_ONCE = 50_000


@dataclass(frozen=True)
class HarmonicModel:
    """channels[c] = offset + Re Σ_k flux[c, k]·j·k·φ'(t)·exp(j·k·φ(t)): the voltage of a flux turning with phase φ(t).

    `course` are φ's Chebyshev coefficients over the record (constant 0, rad); `flux` (C, H) complex flux linkages (V·s/rad)
    at φ = 0 (the record's middle), `offsets` (C,), `noise` (C,) standard deviation of the residuals, `residuals` (C, n);
    `course_covariance`, `flux_covariance` (C, 2H, 2H: real parts, then imaginary).
    """

    middle: float
    half: float
    course: FloatArray
    course_covariance: FloatArray
    flux: np.ndarray[tuple[int, int], np.dtype[np.complex128]]
    flux_covariance: FloatArray
    offsets: FloatArray
    noise: FloatArray
    residuals: FloatArray
    squares: float

    def place(self, time: FloatArray) -> FloatArray:
        """Return time as −1 … 1 over the record."""
        return (time - self.middle) / self.half

    def phase(self, time: FloatArray) -> FloatArray:
        """Return φ (rad) at times (s)."""
        return np.asarray(chebyshev.chebval(self.place(time), self.course), dtype=np.float64)

    def speed(self, time: FloatArray) -> FloatArray:
        """Return φ' (rad/s, electrical) at times (s)."""
        rate = chebyshev.chebval(self.place(time), chebyshev.chebder(self.course))
        return np.asarray(rate / self.half, dtype=np.float64)


@dataclass(frozen=True)
class _Shapes:
    """The shapes that a course is made of: Chebyshev polynomials of degree 1 … d over the record, and their slopes (1/s), (d, n)."""

    values: FloatArray
    slopes: FloatArray

    @classmethod
    def over(cls, x: FloatArray, half: float, degree: int) -> "_Shapes":
        values = chebyshev.chebvander(x, degree).T
        # T'ₖ = k·Uₖ₋₁, and Uₖ = x·Uₖ₋₁ + Tₖ.
        slopes, second = np.empty((degree, x.size)), np.ones_like(x)
        for k in range(1, degree + 1):
            slopes[k - 1] = k / half * second
            second = x * second + values[k]
        return cls(np.ascontiguousarray(values[1:]), slopes)


@dataclass(frozen=True)
class _Wave:
    """The waveform's building blocks along one course: φ' (n,), and the `design` (1 + 2H, n), whose rows belong to the offset,
    the real and the imaginary flux linkages.
    """

    rate: FloatArray
    design: FloatArray
    orders: FloatArray

    @classmethod
    def along(cls, shapes: _Shapes, course: FloatArray, orders: FloatArray) -> "_Wave":
        phase, rate = course[1:] @ shapes.values, course[1:] @ shapes.slopes
        turning = np.empty(phase.size, dtype=np.complex128)
        turning.real, turning.imag = np.cos(phase), np.sin(phase)
        count = orders.size
        design = np.empty((1 + 2 * count, phase.size))
        design[0] = 1.0
        # Orders mostly lie equally far apart.
        onward: dict[int, np.ndarray[tuple[int], np.dtype[np.complex128]]] = {}
        power, reached = np.ones_like(turning), 0
        for row, order in enumerate(map(int, orders), 1):
            apart = order - reached
            if apart not in onward:
                onward[apart] = turning**apart
            power, reached = power * onward[apart], order
            weight = -order * rate
            np.multiply(weight, power.imag, out=design[row])
            np.multiply(weight, power.real, out=design[row + count])
        return cls(rate, design, orders)

    def by_course(self, values: FloatArray, fitted: FloatArray, shapes: _Shapes) -> FloatArray:
        """Return the derivatives (C, d, n) of the voltages by the course's coefficients; `values` are offsets and fluxes."""
        count = self.orders.size
        real, imaginary = values[:, 1 : 1 + count], values[:, 1 + count :]
        # By its angle a wave turns into the one a quarter of a period ahead; by its speed it grows.
        by_phase = np.hstack((-self.orders * imaginary, self.orders * real)) @ self.design[1:]
        by_rate = (fitted - values[:, :1]) / self.rate
        result: FloatArray = by_phase[:, None] * shapes.values
        result += by_rate[:, None] * shapes.slopes
        return result


def thin(time: FloatArray, channels: FloatArray, highest_frequency: float) -> tuple[FloatArray, FloatArray, int]:
    """Average blocks of samples where there are many more than the highest frequency (Hz) needs; also the block's length."""
    step = float(time[-1] - time[0]) / (time.size - 1)
    block = int(min(1.0 / (16 * highest_frequency * step), time.size // 4096))
    if block < 2:
        return time, channels, 1
    count = time.size // block
    kept = channels[:, : count * block].reshape(channels.shape[0], count, block).mean(axis=2)
    return time[0] + step * (block * np.arange(count) + (block - 1) / 2), kept, block


def at_full_rate(
    model: HarmonicModel, orders: Sequence[int], time: FloatArray, channels: FloatArray, block: int
) -> HarmonicModel:
    """Undo what averaging over blocks took off the amplitudes, and give the residuals of all samples."""
    if block == 1:
        return model
    numbers = np.asarray(orders, dtype=np.float64)
    step = float(time[-1] - time[0]) / (time.size - 1)
    turn = numbers * float(model.course[1]) / model.half * step / 2
    left = np.sin(block * turn) / (block * np.sin(turn))
    flux = model.flux / left
    values = np.column_stack((model.offsets, flux.real, flux.imag))
    residuals = channels - waveforms(model, orders, values, time)
    both = np.concatenate((left, left))
    return replace(model, flux=flux, flux_covariance=model.flux_covariance / np.outer(both, both), residuals=residuals)


def waveform_basis(model: HarmonicModel, orders: Sequence[int], time: FloatArray) -> FloatArray:
    """Return what multiplies offset, real and imaginary fluxes along the model's course, (1 + 2H, n)."""
    shapes = _Shapes.over(model.place(time), model.half, model.course.size - 1)
    return _Wave.along(shapes, model.course, np.asarray(orders, dtype=np.float64)).design


def waveforms(model: HarmonicModel, orders: Sequence[int], values: FloatArray, time: FloatArray) -> FloatArray:
    """Return the voltages (C, n) of offsets, real and imaginary fluxes (C, 1 + 2H) along the model's course."""
    result = np.empty((values.shape[0], time.size))
    # The blocks of a deep record would need many times its own memory.
    for begin in range(0, time.size, _AT_ONCE):
        part = slice(begin, begin + _AT_ONCE)
        result[:, part] = values @ waveform_basis(model, orders, time[part])
    return result


def by_phase(model: HarmonicModel, orders: Sequence[int], time: FloatArray) -> FloatArray:
    """Return the derivatives of the voltages (C, n), V/rad, by the phase."""
    turned = model.flux * 1j * np.asarray(orders)
    values = np.hstack((np.zeros((turned.shape[0], 1)), turned.real, turned.imag))
    return waveforms(model, orders, values, time)


def _inverse(normal: FloatArray) -> FloatArray:
    """Return the inverse of a normal matrix whose columns may be of very different size."""
    size = np.sqrt(np.diag(normal))
    return np.asarray(np.linalg.inv(normal / np.outer(size, size)) / np.outer(size, size), dtype=np.float64)


def fit_harmonics(time: FloatArray, channels: FloatArray, orders: Sequence[int], course: FloatArray) -> HarmonicModel:
    """Fit channels (C, n) from a start `course`; amplitudes are linear, the course is refined by Gauss–Newton.

    Channels are weighted by their own residuals. Raises EstimationError where the refinement does not converge.
    """
    middle, half = float(time[0] + time[-1]) / 2, float(time[-1] - time[0]) / 2
    numbers = np.asarray(orders, dtype=np.float64)
    degree, n = course.size - 1, time.size
    shapes = _Shapes.over((time - middle) / half, half, degree)
    course = course.astype(np.float64).copy()
    course[0] = 0.0
    least = 1e-24 * np.var(channels, axis=1) + 1e-300
    for _ in range(_ROUNDS):
        wave = _Wave.along(shapes, course, numbers)
        design = wave.design
        # Harmonics over a period or more hardly overlap: the normal equations lose nothing, and take a fifth of the time.
        linear = _inverse(design @ design.T)
        values = channels @ design.T @ linear
        fitted = values @ design
        residuals = channels - fitted
        weights = 1.0 / np.maximum(np.mean(residuals**2, axis=1), least)
        # What the amplitudes take up of a change of course does not count.
        slopes = wave.by_course(values, fitted, shapes)
        crossing = slopes @ design.T @ linear
        slopes -= crossing @ design
        squares = slopes @ slopes.transpose(0, 2, 1)
        gradient = weights @ (slopes @ residuals[:, :, None])[:, :, 0]
        change = np.linalg.lstsq(np.tensordot(weights, squares, 1), gradient, rcond=1e-14)[0]
        longest = float(np.sum(np.abs(change)))
        # A step of phase beyond a fifth of a turn would leave the region where the derivatives hold.
        change *= min(1.0, 1.2 / max(longest, 1e-300))
        course[1:] += change
        # The step's square in units of its variance: the last one is so small that the derivatives tell what it does.
        if gradient @ change < _LAST_STEP**2 or longest < 1e-10:
            values -= change @ crossing
            residuals -= change @ slopes
            break
    else:
        raise EstimationError(
            "the fit of the waveform does not converge; check that it is a back-EMF, and take a part of the record in which the speed "
            "changes by less than a fifth"
        )
    freedom = n - design.shape[0] - degree / channels.shape[0]
    noise = np.sqrt(np.sum(residuals**2, axis=1) / freedom)
    variance = np.maximum(noise**2, least)
    spread = np.tensordot(1.0 / variance, squares, 1)
    course_covariance = np.asarray(np.linalg.pinv(spread, rcond=1e-14, hermitian=True), dtype=np.float64)
    covariances = [v * linear + c.T @ course_covariance @ c for v, c in zip(variance, crossing, strict=True)]
    count = numbers.size
    return HarmonicModel(
        middle=middle,
        half=half,
        course=course,
        course_covariance=course_covariance,
        flux=values[:, 1 : 1 + count] + 1j * values[:, 1 + count :],
        flux_covariance=np.array([c[1:, 1:] for c in covariances]),
        offsets=values[:, 0],
        noise=noise,
        residuals=residuals,
        squares=float(np.sum(residuals**2 / variance[:, None])),
    )
