"""A slow turn's torque as orders of the turn, and what noise does to them."""

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from procedures.estimation.fitting.fit import FloatArray

#: Points of the curve that the peaks are sought on, for each period of its highest order.
_FINE = 128
#: An order counts where noise alone would reach its size at this probability, all orders looked at taken together.
_CHANCE = 0.01
#: So many places beside an order tell the noise about it.
_ABOUT = 24


@dataclass(frozen=True)
class Orders:
    """Model fitted to a turn: `orders` (k,) periods a turn, which of them are `counted` as cogging, and a polynomial of degree `drift`.

    `between` (m,) are periods a turn at which nothing that repeats itself can lie; `step` is what all counted orders are multiples of.
    """

    orders: NDArray[np.int64]
    counted: NDArray[np.bool_]
    drift: int
    between: FloatArray
    step: float
    whole: bool = False

    @property
    def all_from_one(self) -> bool:
        """True if the orders are complete from the first on."""
        return self.whole and self.orders.size == int(self.orders[-1])

    @property
    def least(self) -> float:
        """The least amplitude that is more than noise, in standard deviations of one of its parts; noise alone is Rayleigh
        distributed.
        """
        return math.sqrt(2.0 * math.log(self.orders.size / _CHANCE))


@dataclass(frozen=True)
class Turn:
    """Readings `torque` (N·m, (n,)) at `angle` (rad) and `time` (s), in steps of `resolution` (N·m); `kept` those that count."""

    angle: FloatArray
    torque: FloatArray
    time: FloatArray | None
    resolution: float
    kept: NDArray[np.bool_] | None = None

    @property
    def counting(self) -> NDArray[np.bool_]:
        """True for each reading that counts, shape (n,)."""
        return np.ones(self.angle.size, dtype=bool) if self.kept is None else self.kept

    @property
    def along(self) -> FloatArray:
        """The way through the turn from −1 to 1, shape (n,)."""
        return np.asarray(2.0 * (self.angle - self.angle[0]) / (self.angle[-1] - self.angle[0]) - 1.0)

    def without(self, lost: NDArray[np.bool_]) -> Self:
        """Return it with fewer readings that count."""
        return replace(self, kept=self.counting & ~lost)

    def turned(self, further: FloatArray) -> Self:
        """Return it with the shaft further on (rad) at each reading."""
        return replace(self, angle=self.angle + further)


@dataclass(frozen=True)
class OrderFit:
    """A fit: `phasors` (k,) N·m of the orders with the standard deviation `axis` (k,) of each of their two parts; `model` and `left` (n,)
    are fit and residuals of all readings, `noise` (N·m) one reading's scatter, `slope` (n,) the counted orders' rise, N·m/rad.

    `basis` (m, n) spans what was fitted, orthonormal over the readings that count; `square` is the sum of squared residuals.
    """

    phasors: NDArray[np.complex128]
    axis: FloatArray
    model: FloatArray
    left: FloatArray
    noise: float
    slope: FloatArray
    basis: FloatArray
    square: float


def solve(turn: Turn, orders: Orders, extra: FloatArray | None = None) -> OrderFit:
    """Fit the orders, the drift and further rows (m, n) to the readings that count."""
    kept = turn.counting
    turning, beside = _turning(orders, turn.angle), _beside(turn, orders, extra)
    design = _design(turning, beside, orders)
    scale, root = _root(turning, beside, kept, orders)
    basis = np.zeros(design.shape)
    basis[:, kept] = linalg.solve_triangular(root, design[:, kept] / scale[:, None], lower=True, check_finite=False)
    along = basis @ turn.torque
    inverse = linalg.solve_triangular(root, np.eye(root.shape[0]), lower=True, check_finite=False)
    solved = inverse.T @ along / scale
    spread = np.sqrt(np.sum(inverse**2, axis=0)) / scale
    model = solved @ design
    left = turn.torque - model
    square = float(left[kept] @ left[kept])
    freedom = max(int(np.sum(kept)) - design.shape[0], 1)
    noise = max(math.sqrt(square / freedom), turn.resolution / math.sqrt(12.0))
    first, count = orders.drift + 1, orders.orders.size
    real, imaginary = solved[first : first + count], solved[first + count : first + 2 * count]
    phasors = real - 1j * imaginary
    axis = noise * np.sqrt(0.5 * (spread[first : first + count] ** 2 + spread[first + count : first + 2 * count] ** 2))
    rising = np.where(orders.counted, 1j * orders.orders * phasors, 0.0)
    return OrderFit(phasors, axis, model, left, noise, np.real(rising @ turning), basis, square)


def square_left(turn: Turn, orders: Orders, extra: FloatArray | None = None) -> float:
    """Return the sum of squared residuals alone, (N·m)²."""
    kept = turn.counting
    turning, beside = _turning(orders, turn.angle), _beside(turn, orders, extra)
    torque = np.where(kept, turn.torque, 0.0)
    # Complex by real would not go through the fast product.
    waves, others = turning @ torque.astype(np.complex128), beside @ torque
    first = orders.drift + 1
    scale, root = _root(turning, beside, kept, orders)
    projected = np.concatenate((others[:first], waves.real, waves.imag, others[first:])) / scale
    along = linalg.solve_triangular(root, projected, lower=True, check_finite=False)
    return float(torque @ torque - along @ along)


def _beside(turn: Turn, orders: Orders, extra: FloatArray | None) -> FloatArray:
    """Return the rows of a design that are no waves: the drift's powers, and further ones."""
    drift = np.vander(turn.along, orders.drift + 1, increasing=True).T
    return drift if extra is None else np.vstack((drift, extra))


def _design(turning: NDArray[np.complex128], beside: FloatArray, orders: Orders) -> FloatArray:
    """Return all rows: the drift's powers, the waves' real and imaginary parts, further rows."""
    first = orders.drift + 1
    return np.vstack((beside[:first], turning.real, turning.imag, beside[first:]))


def _turning(orders: Orders, angle: FloatArray) -> NDArray[np.complex128]:
    if not orders.all_from_one:
        return np.asarray(np.exp(1j * np.outer(orders.orders, angle)), dtype=np.complex128)
    # All orders from the first on are powers of one another, which takes a fifth of the time.
    once = np.broadcast_to(np.exp(1j * angle), (orders.orders.size, angle.size))
    return np.asarray(np.multiply.accumulate(once, axis=0), dtype=np.complex128)


def _root(
    turning: NDArray[np.complex128], beside: FloatArray, kept: NDArray[np.bool_], orders: Orders
) -> tuple[FloatArray, FloatArray]:
    """Return each row's length over the readings that count, and the lower root of the normal matrix of rows of length one."""
    normal = _normal(turning, beside, kept.astype(np.float64), orders)
    scale = np.sqrt(np.maximum(np.diag(normal), 0.0))
    scale[scale == 0.0] = 1.0
    normal /= np.outer(scale, scale)
    # Rows that make each other up, where too many readings were left out, share what they cannot tell.
    normal[np.diag_indices_from(normal)] += 1e-10
    return np.asarray(scale, dtype=np.float64), np.asarray(np.linalg.cholesky(normal), dtype=np.float64)


def _normal(turning: NDArray[np.complex128], beside: FloatArray, kept: FloatArray, orders: Orders) -> FloatArray:
    """Return the normal matrix of a design. Where its waves are all orders from the first on, two waves' product is made of the waves of
    their sum and difference, so that the sums of twice as many waves over the readings hold it all.
    """
    if not orders.all_from_one:
        design = _design(turning, beside, orders) * kept
        return np.asarray(design @ design.T)
    count, first = turning.shape[0], orders.drift + 1
    # Complex by real would not go through the fast product.
    sums = np.concatenate(([np.sum(kept) + 0j], turning @ kept.astype(np.complex128), turning @ (turning[-1] * kept)))
    order = np.arange(1, count + 1)
    added, apart = 0.5 * sums[order[:, None] + order], order[:, None] - order
    less = 0.5 * sums[np.abs(apart)]
    whole = np.empty((beside.shape[0] + 2 * count,) * 2)
    real, imaginary = slice(first, first + count), slice(first + count, first + 2 * count)
    whole[real, real], whole[imaginary, imaginary] = less.real + added.real, less.real - added.real
    whole[real, imaginary] = added.imag - np.sign(apart) * less.imag
    whole[imaginary, real] = whole[real, imaginary].T
    others = np.r_[0:first, first + 2 * count : whole.shape[0]]
    crossed = (beside * kept).astype(np.complex128) @ turning.T
    whole[others, real], whole[others, imaginary] = crossed.real, crossed.imag
    whole[real, others], whole[imaginary, others] = crossed.real.T, crossed.imag.T
    whole[np.ix_(others, others)] = (beside * kept) @ beside.T
    return whole


def standing(phasors: NDArray[np.complex128], axis: FloatArray, orders: Orders) -> NDArray[np.bool_]:
    """Return which counted orders stand out of the noise, shape (k,)."""
    return np.asarray(orders.counted & (np.abs(phasors) > axis * orders.least), dtype=bool)


def powers(turn: Turn, solved: OrderFit, between: FloatArray) -> FloatArray:
    """Return the residuals' power at places between the orders, in that of white noise: of mean 1, falling off exponentially."""
    if solved.noise == 0.0:
        return np.zeros(between.size)
    kept = turn.counting
    waves = np.exp(-1j * np.outer(between, turn.angle[kept]))
    found = np.abs(waves @ solved.left[kept]) ** 2
    # What the fit has taken away of a wave cannot show.
    taken = np.sum(np.abs(waves @ solved.basis[:, kept].T) ** 2, axis=1)
    return np.asarray(found / (solved.noise**2 * np.maximum(int(np.sum(kept)) - taken, 1.0)))


def coloured(solved: OrderFit, orders: Orders, power: FloatArray) -> OrderFit:
    """Return the fit with the noise about each order as the places beside it show it, where that is more than white noise."""
    if power.size < _ABOUT // 2:
        return solved
    nearest = np.argsort(np.abs(orders.between[None, :] - orders.orders[:, None]), axis=1)[:, :_ABOUT]
    about = np.mean(power[nearest], axis=1)
    return replace(solved, axis=solved.axis * np.sqrt(np.maximum(1.0, about)))


def peak_to_peak(kept: NDArray[np.int64], phasors: NDArray[np.complex128], order: int | None) -> float:
    """Return from trough to crest what orders of these phasors make together over a turn; of multiples of one, over its period."""
    fine = np.linspace(0.0, 2.0 * math.pi, int(_FINE * kept[-1]) + 1)
    fine = fine[: _FINE * int(kept[-1] // order) + 1] if order else fine
    return float(np.ptp(np.real(phasors @ np.exp(1j * np.outer(kept, fine)))))
