"""A motor's flux linkages at every current: a measured table, smooth between its points and sensible beyond them."""

from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim_instruments.physics.motor.flux_surface import SoftEdge, Surfaces, mean_slopes, monotone_slopes, spline_slopes
from sim_instruments.physics.motor.flux_table import FluxTable

FloatArray = NDArray[np.float64]

#: Shares of a table's span over which the iron beyond its edge comes to the edge's own inductance: the widest that holds.
_MARGINS = (0.5, 0.25, 0.1, 0.03, 0.01)
#: Newton's steps, and the share of the flux at which it ends.
_STEPS, _TOLERANCE = 60, 1e-13


class FluxMap:
    """Flux linkages ψd, ψq (V·s) over currents id, iq (A) in the rotor's frame.

    Peak values, amplitude-invariant, of the Y-equivalent whatever the winding's connection; d along the magnet, currents into the
    motor. Between the points of the table stands a bicubic spline, or where that would swing back a quieter bicubic. Beyond the
    table the fluxes go on with the slope of the edge: nowhere does the matrix of differential inductances lose its positive
    definite symmetric part, so that every flux has one current. The matrix is symmetric only as far as the table conserves energy.
    Raises ValueError, in a sentence, for a table that is no such motor's.
    """

    def __init__(self, table: FluxTable) -> None:
        self.table = table
        self._surfaces = _definite_surfaces(table)
        self._beyond_table()

    @classmethod
    def from_points(
        cls, d_currents: ArrayLike, q_currents: ArrayLike, d_flux: ArrayLike, q_flux: ArrayLike
    ) -> "FluxMap":
        """Return the map of points in any order, four arrays of one length that fill a rectangular grid."""
        return cls(FluxTable.from_points(d_currents, q_currents, d_flux, q_flux))

    @classmethod
    def from_csv(cls, file: Path) -> "FluxMap":
        """Return the map of a CSV file with the columns id_A, iq_A, psi_d_Vs and psi_q_Vs; others are passed over.

        Raises OSError where it cannot be read.
        """
        return cls(FluxTable.from_csv(file))

    def flux(self, d_current: ArrayLike, q_current: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return ψd and ψq (V·s) at currents (A) of any shape."""
        found = self._at_each(d_current, q_current, slopes=False)
        return found[0], found[1]

    def differential_inductances(
        self, d_current: ArrayLike, q_current: ArrayLike
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return ∂ψd/∂id, ∂ψd/∂iq, ∂ψq/∂id and ∂ψq/∂iq (H) at currents (A) of any shape."""
        found = self._at_each(d_current, q_current, slopes=True)
        return found[2], found[3], found[4], found[5]

    def at(self, d_current: float, q_current: float) -> tuple[float, float, float, float, float, float]:
        """Return ψd, ψq (V·s) and the four differential inductances (H) at one pair of currents (A), in plain numbers."""
        d, d_slope = self._d_edge.at(d_current)
        q, q_slope = self._q_edge.at(q_current)
        d_flux, q_flux, dd, dq, qd, qq = self._surfaces.at(d, q)
        if d_slope != 1.0:
            straight = self._d_low if d_current < d else self._d_high
            d_flux += straight * (d_current - d)
            dd, qd = dd * d_slope + straight * (1.0 - d_slope), qd * d_slope
        if q_slope != 1.0:
            straight = self._q_low if q_current < q else self._q_high
            q_flux += straight * (q_current - q)
            dq, qq = dq * q_slope, qq * q_slope + straight * (1.0 - q_slope)
        return d_flux, q_flux, dd, dq, qd, qq

    def at_each(self, d_currents: FloatArray, q_currents: FloatArray) -> FloatArray:
        """Return ψd, ψq (V·s) and the four differential inductances (H), shape (6, n), at n pairs of currents (A)."""
        return self._at_each(d_currents, q_currents, slopes=True)

    def currents(self, d_flux: ArrayLike, q_flux: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return id and iq (A) that make fluxes (V·s) of any shape, those beyond the table too."""
        wanted_d, wanted_q = np.broadcast_arrays(np.asarray(d_flux, float), np.asarray(q_flux, float))
        shape, wanted = wanted_d.shape, np.array([wanted_d.ravel(), wanted_q.ravel()])
        found = np.array([(wanted[0] - self.flux_linkage) / self.d_axis_inductance, wanted[1] / self.q_axis_inductance])
        allowed = _TOLERANCE * max(self._full_scale, float(np.abs(wanted).max(initial=0.0)))
        at = self._at_each(found[0], found[1], slopes=True)
        error = wanted - at[:2]
        size = np.hypot(error[0], error[1])
        for _ in range(_STEPS):
            open_ones = size > allowed
            if not open_ones.any():
                break
            _, _, dd, dq, qd, qq = at
            step = np.array([error[0] * qq - error[1] * dq, error[1] * dd - error[0] * qd]) / (dd * qq - dq * qd)
            share = np.where(open_ones, 1.0, 0.0)
            # Where a whole step makes it worse a part of it does not: the matrix is nowhere singular.
            for _ in range(_STEPS):
                tried = found + share * step
                at = self._at_each(tried[0], tried[1], slopes=True)
                error = wanted - at[:2]
                new = np.hypot(error[0], error[1])
                worse = open_ones & ~(new < size) & (share > 1e-9)
                if not worse.any():
                    break
                share = np.where(worse, 0.5 * share, share)
            if not (new < size).any():
                break
            found, size = tried, new
        if (size > 1e3 * allowed).any():
            raise ArithmeticError(f"the flux map has no current for ψ = {wanted[:, int(np.argmax(size))].tolist()} V·s")
        return found[0].reshape(shape), found[1].reshape(shape)

    @cached_property
    def flux_linkage(self) -> float:
        """ψd (V·s) at no current."""
        return self.at(0.0, 0.0)[0]

    @cached_property
    def d_axis_inductance(self) -> float:
        """∂ψd/∂id (H) at no current."""
        return self.at(0.0, 0.0)[2]

    @cached_property
    def q_axis_inductance(self) -> float:
        """∂ψq/∂iq (H) at no current."""
        return self.at(0.0, 0.0)[5]

    @cached_property
    def largest_inductances(self) -> tuple[float, float]:
        """Largest ∂ψd/∂id and ∂ψq/∂iq (H) in the table."""
        d, q = np.meshgrid(self.table.d_currents, self.table.q_currents, indexing="ij")
        dd, _, _, qq = self.differential_inductances(d, q)
        return float(dd.max()), float(qq.max())

    def scaled(self, current: float, flux: float) -> "FluxMap":
        """Return the map with all currents and all fluxes multiplied by positive numbers, as a delta's windings have them."""
        return FluxMap(self.table.scaled(current, flux))

    def __eq__(self, other: object) -> bool:
        return self.table == other.table if isinstance(other, FluxMap) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.table)

    @property
    def _full_scale(self) -> float:
        return float(np.hypot(self.table.d_flux, self.table.q_flux).max())

    def _at_each(self, d_current: ArrayLike, q_current: ArrayLike, *, slopes: bool) -> FloatArray:
        wide_d, wide_q = np.broadcast_arrays(np.asarray(d_current, float), np.asarray(q_current, float))
        shape, d_currents, q_currents = wide_d.shape, wide_d.ravel(), wide_q.ravel()
        d, d_slope = self._d_edge.at_each(d_currents)
        q, q_slope = self._q_edge.at_each(q_currents)
        found = self._surfaces.at_each(d, q, slopes=slopes)
        straight_d = np.where(d_currents < d, self._d_low, self._d_high)
        straight_q = np.where(q_currents < q, self._q_low, self._q_high)
        found[0] += straight_d * (d_currents - d)
        found[1] += straight_q * (q_currents - q)
        if slopes:
            found[2] = found[2] * d_slope + straight_d * (1.0 - d_slope)
            found[3] *= q_slope
            found[4] *= d_slope
            found[5] = found[5] * q_slope + straight_q * (1.0 - q_slope)
        return found.reshape(len(found), *shape)

    def _beyond_table(self) -> None:
        """Choose how the fluxes go on beyond the table: as straight as the edge is, and positive definite."""
        (d_low, d_high), (q_low, q_high) = self.table.d_limits, self.table.q_limits
        at = self._surfaces.at
        self._d_low, self._d_high = at(d_low, 0.0)[2], at(d_high, 0.0)[2]
        self._q_low, self._q_high = at(0.0, q_low)[5], at(0.0, q_high)[5]
        d_span, q_span = d_high - d_low, q_high - q_low
        outside_d = _with_outside(self.table.d_currents, d_span)
        outside_q = _with_outside(self.table.q_currents, q_span)
        for margin in _MARGINS:
            self._d_edge = SoftEdge(d_low, d_high, margin * d_span)
            self._q_edge = SoftEdge(q_low, q_high, margin * q_span)
            if _weakest(self, outside_d, outside_q) is None:
                return
        # Between steep edges the cross term alone may be too much for so little inductance: more of it always holds.
        while _weakest(self, outside_d, outside_q) is not None:
            self._d_low, self._d_high, self._q_low, self._q_high = (
                1.5 * each for each in (self._d_low, self._d_high, self._q_low, self._q_high)
            )


def _definite_surfaces(table: FluxTable) -> Surfaces:
    """Return the smoothest surfaces through the points whose differential inductances are positive definite everywhere."""
    d, q = table.d_currents, table.q_currents
    along = across = 0.0
    for slopes in (spline_slopes, mean_slopes, monotone_slopes):
        surfaces = Surfaces(d, q, table.d_flux, table.q_flux, slopes)
        weakest = _weakest(surfaces, _between(d), _between(q))
        if weakest is None:
            return surfaces
        along, across = weakest
    raise ValueError(
        f"the flux map's differential inductances are not positive definite near id = {along:.4g} A, iq = {across:.4g} A: "
        "there more current would give less flux; look for a wrong value beside it, or give more points there"
    )


def _between(knots: FloatArray) -> FloatArray:
    """Return the knots and three places in each gap."""
    shares = np.arange(4) / 4.0
    inner = knots[:-1, np.newaxis] + np.diff(knots)[:, np.newaxis] * shares
    return np.append(inner.ravel(), knots[-1])


def _with_outside(knots: FloatArray, span: float) -> FloatArray:
    """Return the knots and places beyond both ends, up to where nothing changes any more."""
    beyond = span * np.array([0.001, 0.004, 0.008, 0.016, 0.05, 0.08, 0.12, 0.2, 0.3, 0.4, 0.5, 0.6])
    return np.concatenate([knots[0] - beyond[::-1], _between(knots), knots[-1] + beyond])


def _weakest(where: "FluxMap | Surfaces", d: FloatArray, q: FloatArray) -> tuple[float, float] | None:
    """Return where on a grid the differential inductances are least definite, None where they are positive definite."""
    along, across = (each.ravel() for each in np.meshgrid(d, q, indexing="ij"))
    found = (
        where._at_each(along, across, slopes=True)
        if isinstance(where, FluxMap)
        else where.at_each(along, across, slopes=True)
    )
    _, _, dd, dq, qd, qq = found
    lower = 0.5 * (dd + qq) - np.hypot(0.5 * (dd - qq), 0.5 * (dq + qd))
    least = int(np.argmin(lower))
    # Rounding aside: a millionth of the largest inductance is iron that is full.
    if lower[least] > 1e-6 * max(float(dd.max()), float(qq.max())):
        return None
    return float(along[least]), float(across[least])
