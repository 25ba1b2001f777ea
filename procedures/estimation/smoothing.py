"""A signal freed of its sample noise, as far as it is smooth."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import special

from procedures.estimation.fit import FloatArray

_DEGREE = 3
_SHORTEST = 16


@dataclass(frozen=True)
class Smoothed:
    """`values` (n,), and an orthonormal `basis` (n, m) of the directions in which noise of the samples is left in them."""

    values: FloatArray
    basis: FloatArray


def _unstructured(residual: FloatArray, noise: float) -> bool:
    """Whether what a polynomial leaves is noise: sums over blocks of two lengths are no larger than chance makes them."""
    for blocks in (8, 32):
        length = residual.size // blocks
        if length < 2:
            continue
        sums = residual[: length * blocks].reshape(blocks, length).sum(axis=1)
        if float(np.sum(sums**2)) > special.chdtri(blocks, 0.001) * length * noise**2:
            return False
    return bool(residual @ residual <= special.chdtri(residual.size, 0.001) * noise**2)


@lru_cache(maxsize=64)
def _polynomials(size: int) -> FloatArray:
    """Return orthonormal cubics over so many samples (size, 4), read-only; each sample by itself where there are few."""
    if size <= _SHORTEST:
        return np.eye(size)
    basis, _ = np.linalg.qr(np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, size), _DEGREE))
    basis.flags.writeable = False
    return np.asarray(basis, dtype=np.float64)


def smooth(values: FloatArray, noise: float, *, most: int = 64) -> Smoothed | None:
    """Replace values (n,) by cubics over pieces as long as `noise` (standard deviation) allows; None where that needs
    more than `most` coefficients, as for a signal with ripple all along.
    """
    result = values.copy()
    columns: list[FloatArray] = []
    pending = [(0, values.size)]
    while pending:
        begin, end = pending.pop()
        size = end - begin
        basis = _polynomials(size)
        coefficients = basis.T @ values[begin:end]
        fitted = basis @ coefficients
        if size > _SHORTEST and not _unstructured(values[begin:end] - fitted, noise):
            # A rise is mostly at the beginning of the piece, so the pieces are shorter there.
            middle = begin + max(size // 4, _SHORTEST // 2)
            pending += [(begin, middle), (middle, end)]
            continue
        if size > _SHORTEST:
            # Schwarz's criterion: a coefficient that noise alone may have made costs more than it brings.
            gains = np.cumsum(coefficients**2 / noise**2 - np.log(size))
            basis = basis[:, : max(int(np.argmax(gains)), 0) + 1]
            fitted = basis @ (basis.T @ values[begin:end])
        result[begin:end] = fitted
        for column in basis.T:
            whole = np.zeros_like(values)
            whole[begin:end] = column
            columns.append(whole)
        if len(columns) > most:
            return None
    return Smoothed(result, np.column_stack(columns))
