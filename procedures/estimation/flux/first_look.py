"""Flux linkages by the readings that there are so far: a smooth surface to be looked at while a map grows, no figures of a result."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay, QhullError

from procedures.estimation.fitting.fit import FloatArray

#: Powers of both currents together that a polynomial has, while there are so many equations for each unknown.
_DEGREES, _EACH = (3, 2, 1), 1.3
#: Least singular value of the equations, of the largest, columns of length 1: below it readings leave unknowns open. While all of them
#: turn one way, what lies across an axis is not told from the resistance: 1e-9 there, 4e-2 and more once both signs were read.
_TOLD = 1e-2
#: Rows and columns of the grid.
_GRID = 41


@dataclass(frozen=True)
class FirstLook:
    """Flux linkages (n, m) in V·s over i_d (n,) and i_q (m,) in A; NaN beyond the currents that were read."""

    i_d: FloatArray
    i_q: FloatArray
    psi_d: FloatArray
    psi_q: FloatArray

    def torque(self, pole_pairs: float) -> FloatArray:
        """Return the air gap's torque (n, m) in N·m."""
        return np.asarray(1.5 * pole_pairs * (self.psi_d * self.i_q - self.psi_q * self.i_d[:, np.newaxis]))


def first_look(
    current: NDArray[np.complex128], voltage: NDArray[np.complex128], electrical_speed: FloatArray, largest: float
) -> FirstLook | None:
    """Return a polynomial of each flux linkage with one resistance, fitted to readings (n,) at constant speed; None where they are too few,
    or leave it open.

    Current and voltage are d + j·q (A and V, peak), the speed in rad/s, signed, `largest` (A) is what the map goes up to.
    """
    # ψ + R·i / (j·ω) = u / (j·ω): a resistance that all share beside what each axis links.
    x, y = current.real / largest, current.imag / largest
    told, drop = voltage / (1j * electrical_speed), current / (1j * electrical_speed)
    try:
        read = Delaunay(np.column_stack((x, y)))
    except QhullError:
        return None
    for degree in _DEGREES:
        if 2 * x.size >= _EACH * (2 * len(_powers(degree)) + 1):
            solved = _solved(_terms(x, y, degree), drop, told)
            if solved is not None:
                break
    else:
        return None
    axis = np.linspace(-1.0, 1.0, _GRID)
    over_d, over_q = (each.ravel() for each in np.meshgrid(axis, axis, indexing="ij"))
    at = _terms(over_d, over_q, degree)
    inside = read.find_simplex(np.column_stack((over_d, over_q))) >= 0
    flux = [np.where(inside, at @ part, np.nan).reshape(_GRID, _GRID) for part in np.split(solved[:-1], 2)]
    return FirstLook(axis * largest, axis * largest, flux[0], flux[1])


def _solved(basis: FloatArray, drop: NDArray[np.complex128], told: NDArray[np.complex128]) -> FloatArray | None:
    """Return the coefficients of both polynomials and the resistance; None where the readings leave some of them open."""
    nothing = np.zeros_like(basis)
    rows = np.vstack((np.column_stack((basis, nothing, drop.real)), np.column_stack((nothing, basis, drop.imag))))
    length = np.linalg.norm(rows, axis=0)
    if not length.all():
        return None
    solved, _, _, sizes = np.linalg.lstsq(rows / length, np.concatenate((told.real, told.imag)), rcond=None)
    return np.asarray(solved / length) if sizes[-1] >= _TOLD * sizes[0] else None


def _powers(degree: int) -> list[tuple[int, int]]:
    return [(j, k) for j in range(degree + 1) for k in range(degree + 1 - j)]


def _terms(x: FloatArray, y: FloatArray, degree: int) -> FloatArray:
    return np.column_stack([x**j * y**k for j, k in _powers(degree)])
