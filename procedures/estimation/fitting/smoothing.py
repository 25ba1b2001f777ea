"""A signal freed of its sample noise, as far as it is smooth."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import special

from procedures.estimation.fitting.fit import FloatArray

_SHORTEST = 16


class Piece(NamedTuple):
    """Directions (m, size), orthonormal, of the samples from `begin` on."""

    begin: int
    directions: FloatArray


@dataclass(frozen=True)
class Smoothed:
    """`values` (n,) of `count` coefficients, and in `pieces` the directions in which they may be off by the samples' noise."""

    values: FloatArray
    pieces: tuple[Piece, ...]
    count: int


def components(pieces: Sequence[Piece], rows: FloatArray) -> FloatArray:
    """Return the components (…, m) of rows (…, n) along all directions."""
    return np.concatenate(
        [rows[..., begin : begin + directions.shape[1]] @ directions.T for begin, directions in pieces], axis=-1
    )


def _unstructured(residual: FloatArray, noise: float) -> bool:
    """Return whether a polynomial's residuals are noise: sums over blocks of two lengths are no larger than chance makes them."""
    if residual @ residual > special.chdtri(residual.size, 0.001) * noise**2:
        return False
    for blocks in (8, 32):
        length = residual.size // blocks
        if length < 2:
            continue
        sums = residual[: length * blocks].reshape(blocks, length).sum(axis=1)
        if sums @ sums > special.chdtri(blocks, 0.001) * length * noise**2:
            return False
    return True


def cubics(size: int) -> FloatArray:
    """Return orthonormal cubics over so many samples (4, size); each sample by itself where there are few."""
    if size <= _SHORTEST:
        return np.eye(size)
    rows = np.empty((4, size))
    # Over places that lie evenly on both sides of zero, odd powers are orthogonal to even ones.
    rows[0] = 1.0
    x = rows[1] = np.arange(1.0 - size, size, 2.0)
    square = x * x
    second, fourth = x @ x, square @ square
    np.subtract(square, second / size, out=rows[2])
    square -= fourth / second
    np.multiply(x, square, out=rows[3])
    squares = np.array((size, second, rows[2] @ rows[2], rows[3] @ rows[3]))
    rows /= np.sqrt(squares)[:, None]
    return rows


def smooth(
    values: FloatArray, noise: float, *, most: int = 64, polynomials: Callable[[int], FloatArray] = cubics
) -> Smoothed | None:
    """Replace values (n,) by cubics over pieces as long as `noise` (standard deviation) allows; None where that needs
    more than `most` coefficients, as for a signal with ripple all along. `polynomials` gives what `cubics` does.
    """
    result = np.empty_like(values)
    pieces: list[Piece] = []
    count = 0
    pending = [(0, values.size)]
    while pending:
        begin, end = pending.pop()
        size, part = end - begin, values[begin:end]
        directions = polynomials(size)
        coefficients = directions @ part
        fitted = coefficients @ directions
        if size > _SHORTEST and not _unstructured(part - fitted, noise):
            # A rise is mostly at the beginning of the piece, so the pieces are shorter there.
            middle = begin + max(size // 4, _SHORTEST // 2)
            pending += [(begin, middle), (middle, end)]
            continue
        if size > _SHORTEST:
            # Schwarz's criterion: a coefficient that noise alone may have made costs more than it brings.
            gains = np.cumsum(coefficients**2 / noise**2 - np.log(size))
            kept = int(np.argmax(gains)) + 1
            fitted = coefficients[:kept] @ directions[:kept]
        else:
            kept = size
        result[begin:end] = fitted
        # What is left out was not shown to be none: it may be as large as the noise.
        pieces.append(Piece(begin, directions))
        count += kept
        if count > most:
            return None
    return Smoothed(result, tuple(pieces), count)
