"""A map's surface between the points of its grid, and currents over flux linkages."""

import numpy as np
from numpy.typing import ArrayLike

from reports.exports.exported_map import ExportedMap, FloatArray
from reports.exports.target import Sheet

_ROUNDS = 6


def map_of(sheet: Sheet) -> ExportedMap:
    """Return the map that a sheet's figures come from. Raises ValueError where it has none: `sheet_for` refuses that before."""
    if sheet.subject.flux_map is None:
        raise ValueError("the sheet has no flux map")
    return sheet.subject.flux_map


def said_of(found: ExportedMap) -> tuple[str, ...]:
    """Return what every file says of its map: frame, signs, uncertainty, and what of the grid was measured."""
    return (
        "rotor dq frame, amplitude-invariant, peak; d along the magnet, currents into the motor; currents in A, flux linkages in V*s",
        "torque = 1.5 p (psi_d iq - psi_q id); u_d = R id + dpsi_d/dt - w psi_q; u_q = R iq + dpsi_q/dt + w psi_d",
        f"u: up to {np.max(found.points[:, 4]):.2g} V*s of psi_d, {np.max(found.points[:, 5]):.2g} V*s of psi_q at the measured currents",
        "magnets and winding as warm as while the map was read",
        f"{found.beyond} of {found.measured.size} points of the grid lie beyond what was measured (measured = 0), carried on",
    )


def bilinear_error(found: ExportedMap) -> float:
    """Return the largest difference (V*s) of bilinear interpolation from a cubic surface, within what was measured."""
    # Whoever only lists the exports, as the panel does at a run's end, has no need of a sixth of its memory for these.
    from scipy.interpolate import RectBivariateSpline

    d, q = (0.5 * (axis[1:] + axis[:-1]) for axis in (found.i_d, found.i_q))
    mask = found.measured
    inside = mask[1:, 1:] & mask[:-1, 1:] & mask[1:, :-1] & mask[:-1, :-1]
    largest = 0.0
    for table in (found.psi_d, found.psi_q):
        mean = 0.25 * (table[1:, 1:] + table[:-1, 1:] + table[1:, :-1] + table[:-1, :-1])
        left = np.abs(RectBivariateSpline(found.i_d, found.i_q, table)(d, q) - mean)[inside]
        largest = max(largest, float(np.max(left, initial=0.0)))
    return largest


def currents_over_flux(found: ExportedMap, psi_d: ArrayLike, psi_q: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return i_d, i_q (n, m) in A at flux linkages (n,), (m,) in V*s within the grid: Newton's iteration on a cubic surface."""
    from scipy.interpolate import LinearNDInterpolator, RectBivariateSpline

    d, q = (each.ravel() for each in np.meshgrid(psi_d, psi_q, indexing="ij"))
    grid_d, grid_q = np.meshgrid(found.i_d, found.i_q, indexing="ij")
    near = LinearNDInterpolator(
        np.column_stack((found.psi_d.ravel(), found.psi_q.ravel())), np.column_stack((grid_d.ravel(), grid_q.ravel()))
    )
    i_d, i_q = near(d, q).T
    surfaces = [RectBivariateSpline(found.i_d, found.i_q, table) for table in (found.psi_d, found.psi_q)]
    for _ in range(_ROUNDS):
        left_d, left_q = (wanted - s.ev(i_d, i_q) for s, wanted in zip(surfaces, (d, q), strict=True))
        dd, dq, qd, qq = (s.ev(i_d, i_q, dx=dx, dy=1 - dx) for s in surfaces for dx in (1, 0))
        size = dd * qq - dq * qd
        i_d = np.clip(i_d + (qq * left_d - dq * left_q) / size, found.i_d[0], found.i_d[-1])
        i_q = np.clip(i_q + (dd * left_q - qd * left_d) / size, found.i_q[0], found.i_q[-1])
    shape = (np.size(psi_d), np.size(psi_q))
    return i_d.reshape(shape), i_q.reshape(shape)


def flux_axes(found: ExportedMap, size: int) -> tuple[FloatArray, FloatArray]:
    """Return flux linkages (size,) along both axes: the rectangle that lies within the grid's own."""
    low_d, high_d = float(np.max(found.psi_d[0])), float(np.min(found.psi_d[-1]))
    low_q, high_q = float(np.max(found.psi_q[:, 0])), float(np.min(found.psi_q[:, -1]))
    return np.linspace(low_d, high_d, size), np.linspace(low_q, high_q, size)
