"""Linear equations of the few unknowns that a motor's circuit has."""

import numpy as np

from sim_instruments.physics.circuits.windings import FloatArray


def solve_small(matrix: FloatArray, right: FloatArray) -> FloatArray:
    """Solve up to two equations by hand: at this size the library's checks cost more than the arithmetic."""
    if len(right) == 1:
        return np.array([float(right[0]) / float(matrix[0, 0])])
    if len(right) == 2:
        a, b, d = float(matrix[0, 0]), float(matrix[0, 1]), float(matrix[1, 1])
        c, e, f = float(matrix[1, 0]), float(right[0]), float(right[1])
        determinant = a * d - b * c
        return np.array([(e * d - b * f) / determinant, (a * f - e * c) / determinant])
    return np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)


def solve_each(matrices: FloatArray, rights: FloatArray) -> FloatArray:
    """Solve n such equations at once: matrices (n, k, k), right sides and results (k, n)."""
    if len(rights) == 2:
        a, b, c, d = matrices.reshape(-1, 4).T
        e, f = rights
        return np.array([e * d - b * f, a * f - e * c]) / (a * d - b * c)
    return np.asarray(np.linalg.solve(matrices, rights.T[:, :, np.newaxis])[:, :, 0].T, dtype=np.float64)
