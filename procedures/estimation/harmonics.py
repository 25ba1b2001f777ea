"""Least squares of a periodic waveform on several channels at once, its phase a polynomial in time."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import chebyshev

from procedures.estimation.fit import EstimationError, FloatArray


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
class _Wave:
    """The waveform's building blocks along one course: φ' (n,), sine and cosine of k·φ (n, H)."""

    rate: FloatArray
    sine: FloatArray
    cosine: FloatArray
    orders: FloatArray

    @classmethod
    def along(cls, x: FloatArray, half: float, course: FloatArray, orders: FloatArray) -> "_Wave":
        phase = chebyshev.chebval(x, course)
        rate = chebyshev.chebval(x, chebyshev.chebder(course)) / half + 0 * x
        turning = np.exp(1j * phase)
        powers = np.column_stack([turning ** int(k) for k in orders])
        return cls(np.asarray(rate, dtype=np.float64), powers.imag, powers.real, orders)

    def design(self) -> FloatArray:
        """Return the columns for the offset, the real and the imaginary flux linkages."""
        weight = self.rate[:, None] * self.orders
        return np.column_stack((np.ones_like(self.rate), -weight * self.sine, -weight * self.cosine))

    def by_course(self, values: FloatArray, basis: FloatArray, slopes: FloatArray) -> FloatArray:
        """Return the derivatives of one channel's voltage by the course's coefficients; `values` are its offset and fluxes."""
        count = self.orders.size
        real, imaginary = values[1 : 1 + count], values[1 + count :]
        by_phase = self.rate * (self.sine @ (self.orders**2 * imaginary) - self.cosine @ (self.orders**2 * real))
        by_rate = -self.sine @ (self.orders * real) - self.cosine @ (self.orders * imaginary)
        return np.asarray(by_phase[:, None] * basis + by_rate[:, None] * slopes, dtype=np.float64)


def thin(time: FloatArray, channels: FloatArray, highest_frequency: float) -> tuple[FloatArray, FloatArray, int]:
    """Average blocks of samples where there are many more than the highest frequency (Hz) needs; also the block's length."""
    step = float(time[-1] - time[0]) / (time.size - 1)
    block = int(min(1.0 / (40 * highest_frequency * step), time.size // 4096))
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
    x = model.place(time)
    values = np.column_stack((model.offsets, flux.real, flux.imag))
    residuals = channels - values @ _Wave.along(x, model.half, model.course, numbers).design().T
    both = np.concatenate((left, left))
    return replace(model, flux=flux, flux_covariance=model.flux_covariance / np.outer(both, both), residuals=residuals)


def _inverse(normal: FloatArray) -> FloatArray:
    """Return the inverse of a normal matrix whose columns may be of very different size."""
    size = np.sqrt(np.diag(normal))
    return np.asarray(np.linalg.inv(normal / np.outer(size, size)) / np.outer(size, size), dtype=np.float64)


def fit_harmonics(
    time: FloatArray, channels: FloatArray, orders: Sequence[int], course: FloatArray, *, iterations: int = 30
) -> HarmonicModel:
    """Fit channels (C, n) from a start `course`; amplitudes are linear, the course is refined by Gauss–Newton.

    Channels are weighted by their own residuals. Raises EstimationError where the refinement does not converge.
    """
    middle, half = float(time[0] + time[-1]) / 2, float(time[-1] - time[0]) / 2
    x = (time - middle) / half
    numbers = np.asarray(orders, dtype=np.float64)
    degree, n = course.size - 1, time.size
    course = course.astype(np.float64).copy()
    course[0] = 0.0
    weights = 1.0 / np.maximum(np.var(channels, axis=1), 1e-300)
    basis = np.asarray(chebyshev.chebvander(x, degree)[:, 1:], dtype=np.float64)
    units = np.eye(degree + 1)[1:]
    columns = [chebyshev.chebval(x, chebyshev.chebder(unit)) / half + 0 * x for unit in units]
    slopes = np.asarray(np.column_stack(columns), dtype=np.float64)
    previous, settled = np.inf, False
    for _ in range(iterations):
        wave = _Wave.along(x, half, course, numbers)
        design = wave.design()
        # Harmonics over a period or more hardly overlap: the normal equations lose nothing, and take a fifth of the time.
        linear = _inverse(design.T @ design)
        values = channels @ design @ linear
        residuals = channels - values @ design.T
        normal, gradient = np.zeros((degree, degree)), np.zeros(degree)
        for k in range(channels.shape[0]):
            slope = wave.by_course(values[k], basis, slopes)
            slope = slope - design @ (linear @ (design.T @ slope))
            normal += weights[k] * slope.T @ slope
            gradient += weights[k] * slope.T @ residuals[k]
        # A step of phase beyond a fifth of a turn would leave the region where the derivatives hold.
        change = np.linalg.lstsq(normal, gradient, rcond=1e-14)[0]
        longest = float(np.sum(np.abs(change)))
        if settled or longest < 1e-10:
            break
        course[1:] += change * min(1.0, 1.2 / max(longest, 1e-300))
        weights = 1.0 / np.maximum(np.mean(residuals**2, axis=1), 1e-24 * np.var(channels, axis=1) + 1e-300)
        total = float(np.sum(np.log(np.mean(residuals**2, axis=1) + 1e-24 * np.var(channels, axis=1) + 1e-300)))
        settled = abs(previous - total) < 1e-10 and longest < 1e-5
        previous = total
    else:
        raise EstimationError("the fit of the waveform does not converge; check that it is a back-EMF at steady speed")
    freedom = n - design.shape[1] - degree / channels.shape[0]
    noise = np.sqrt(np.sum(residuals**2, axis=1) / freedom)
    variance = np.maximum(noise**2, 1e-24 * np.var(channels, axis=1))
    spread = np.zeros((degree, degree))
    crossing = []
    for k in range(channels.shape[0]):
        slope = wave.by_course(values[k], basis, slopes)
        crossing.append(linear @ (design.T @ slope))
        left = slope - design @ crossing[-1]
        spread += left.T @ left / variance[k]
    course_covariance = np.asarray(np.linalg.pinv(spread, rcond=1e-14, hermitian=True), dtype=np.float64)
    covariances = [v * linear + c @ course_covariance @ c.T for v, c in zip(variance, crossing, strict=True)]
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
