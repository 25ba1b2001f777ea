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
    """What is fitted to a turn: `orders` (k,) periods a turn, which of them are `counted` as cogging, and a polynomial of degree `drift`.

    `between` (m,) are periods a turn at which nothing that repeats itself can lie; `step` is what all counted orders are multiples of.
    """

    orders: NDArray[np.int64]
    counted: NDArray[np.bool_]
    drift: int
    between: FloatArray
    step: float
    whole: bool = False

    @property
    def least(self) -> float:
        """What an amplitude must have, in standard deviations of one of its parts, to be more than noise: noise alone is Rayleigh's."""
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
        """Which readings count, shape (n,)."""
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
    turning, design = _design(turn, orders, extra)
    scale, root = _root(design, kept)
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
    _, design = _design(turn, orders, extra)
    scale, root = _root(design, kept)
    along = linalg.solve_triangular(root, design[:, kept] @ turn.torque[kept] / scale, lower=True, check_finite=False)
    return float(turn.torque[kept] @ turn.torque[kept] - along @ along)


def _design(turn: Turn, orders: Orders, extra: FloatArray | None) -> tuple[NDArray[np.complex128], FloatArray]:
    turning = _turning(orders, turn.angle)
    parts = [np.vstack([turn.along**k for k in range(orders.drift + 1)]), turning.real, turning.imag]
    return turning, np.vstack(parts if extra is None else [*parts, extra])


def _turning(orders: Orders, angle: FloatArray) -> NDArray[np.complex128]:
    if not orders.whole or orders.orders.size != orders.orders[-1]:
        return np.asarray(np.exp(1j * np.outer(orders.orders, angle)), dtype=np.complex128)
    # All orders from the first on are powers of one another, which takes a fifth of the time.
    once = np.broadcast_to(np.exp(1j * angle), (orders.orders.size, angle.size))
    return np.asarray(np.multiply.accumulate(once, axis=0), dtype=np.complex128)


def _root(design: FloatArray, kept: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
    """Return each row's length over the readings that count, and the lower root of the normal matrix of rows of length one."""
    used = design[:, kept]
    scale = np.sqrt(np.einsum("mn,mn->m", used, used))
    scale[scale == 0.0] = 1.0
    normal = (used @ used.T) / np.outer(scale, scale)
    # Rows that make each other up, where too many readings were left out, share what they cannot tell.
    normal[np.diag_indices_from(normal)] += 1e-10
    return np.asarray(scale, dtype=np.float64), np.asarray(np.linalg.cholesky(normal), dtype=np.float64)


def standing(phasors: NDArray[np.complex128], axis: FloatArray, orders: Orders) -> NDArray[np.bool_]:
    """Return which counted orders stand out of the noise, shape (k,)."""
    return np.asarray(orders.counted & (np.abs(phasors) > axis * orders.least), dtype=bool)


def powers(turn: Turn, solved: OrderFit, between: FloatArray) -> FloatArray:
    """Return the residuals' power at places between the orders, in that of white noise: of mean 1, falling off exponentially."""
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
