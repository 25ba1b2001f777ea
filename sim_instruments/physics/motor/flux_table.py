"""A flux map's points as they were given: read, put on their grid, and refused where they are no motor's."""

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

COLUMNS = ("id_A", "iq_A", "psi_d_Vs", "psi_q_Vs")
#: Bytes and points beyond which a file is none of a motor.
_LARGEST_FILE, _MOST_POINTS = 64_000_000, 250_000
#: Currents closer than this share of their span are one value of the grid.
_ONE = 1e-6
#: Angle (°) by which the magnet may lie beside the d axis, as a measured angle's zero may be off.
_TURNED = 5.0
#: Least values of each current, of which a slope can be told.
_LEAST_VALUES = 3


@dataclass(frozen=True, eq=False)
class FluxTable:
    """ψd and ψq (V·s, shape (n, m)) over a grid of rising currents id (n,) and iq (m,) (A); peak, d along the magnet.

    A table of iq ≥ 0 alone is completed by the symmetry of a motor: ψd even in iq, ψq odd.
    Raises ValueError where the points are no such motor's, and says which.
    """

    d_currents: FloatArray
    q_currents: FloatArray
    d_flux: FloatArray
    q_flux: FloatArray

    @classmethod
    def from_points(
        cls, d_currents: ArrayLike, q_currents: ArrayLike, d_flux: ArrayLike, q_flux: ArrayLike
    ) -> "FluxTable":
        """Return the table of points in any order."""
        columns = [np.asarray(each, dtype=np.float64) for each in (d_currents, q_currents, d_flux, q_flux)]
        if len({each.shape for each in columns}) != 1 or columns[0].ndim != 1:
            raise ValueError(
                f"a flux map's four columns must be equally long; they have the shapes {[each.shape for each in columns]}"
            )
        if len(columns[0]) > _MOST_POINTS:
            raise ValueError(f"the flux map has {len(columns[0])} points; at most {_MOST_POINTS} are read")
        for name, column in zip(COLUMNS, columns, strict=True):
            wrong = np.flatnonzero(~np.isfinite(column))
            if len(wrong):
                raise ValueError(f"{name} of the flux map's point {int(wrong[0]) + 1} is {column[wrong[0]]}, no number")
        d_axis, d_index = _axis("id", columns[0])
        q_axis, q_index = _axis("iq", columns[1])
        place = d_index * len(q_axis) + q_index
        counts = np.bincount(place, minlength=len(d_axis) * len(q_axis))
        if counts.max() > 1:
            twice = int(np.argmax(counts))
            raise ValueError(
                f"the flux map has {int(counts.max())} points at {_point(d_axis, q_axis, twice)}; give one for each pair of currents"
            )
        if counts.min() == 0:
            raise ValueError(
                f"the flux map has holes: {int((counts == 0).sum())} of {len(counts)} points of its grid of {len(d_axis)} values of id "
                f"and {len(q_axis)} of iq are missing, the first at {_point(d_axis, q_axis, int(np.argmin(counts)))}; "
                "give every pair, or interpolate onto a rectangular grid"
            )
        order = np.argsort(place)
        shape = len(d_axis), len(q_axis)
        return cls(*_mirrored(d_axis, q_axis, columns[2][order].reshape(shape), columns[3][order].reshape(shape)))

    @classmethod
    def from_csv(cls, file: Path) -> "FluxTable":
        """Return the table of a CSV file with a heading; lines that begin with # are comments. Raises OSError."""
        if file.stat().st_size > _LARGEST_FILE:
            raise ValueError(
                f"{file.name} has {file.stat().st_size} bytes; a flux map of at most {_LARGEST_FILE} is read"
            )
        try:
            content = file.read_text(encoding="utf-8-sig")
        except UnicodeDecodeError as error:
            raise ValueError(f"{file.name} is no text in UTF-8: {error.reason} at byte {error.start}") from None
        lines = [
            (number, row)
            for number, line in enumerate(content.splitlines(), start=1)
            if line.strip() and not line.lstrip().startswith("#")
            for row in csv.reader([line])
        ]
        heading = [name.strip() for name in lines[0][1]] if lines else []
        missing = [name for name in COLUMNS if name not in heading]
        if missing:
            raise ValueError(
                f"{file.name} has no column {', '.join(missing)}: its first line must name {', '.join(COLUMNS)}, and is "
                f"{','.join(heading)[:200]!r}"
            )
        twice = [name for name in COLUMNS if heading.count(name) > 1]
        if twice:
            raise ValueError(f"{file.name} has the column {twice[0]} more than once")
        places = [heading.index(name) for name in COLUMNS]
        points = []
        for number, row in lines[1:]:
            if len(row) != len(heading):
                raise ValueError(f"line {number} of {file.name} has {len(row)} values; its heading has {len(heading)}")
            points.append(
                [_number(row[place], name, number, file.name) for name, place in zip(COLUMNS, places, strict=True)]
            )
        if not points:
            raise ValueError(f"{file.name} has a heading and no points")
        return cls.from_points(*np.array(points).T)

    def __post_init__(self) -> None:
        for name, axis in (("id", self.d_currents), ("iq", self.q_currents)):
            if len(axis) < _LEAST_VALUES:
                raise ValueError(f"the flux map has {len(axis)} values of {name}; it takes at least {_LEAST_VALUES}")
            if not axis[0] <= 0.0 <= axis[-1]:
                raise ValueError(
                    f"the flux map's {name} runs from {axis[0]:.6g} to {axis[-1]:.6g} A; it must hold 0 A, where the magnets are alone"
                )
        for each in (self.d_currents, self.q_currents, self.d_flux, self.q_flux):
            each.flags.writeable = False
        self._refuse_other_frames()

    @property
    def d_limits(self) -> tuple[float, float]:
        """Least and greatest id (A)."""
        return float(self.d_currents[0]), float(self.d_currents[-1])

    @property
    def q_limits(self) -> tuple[float, float]:
        """Least and greatest iq (A)."""
        return float(self.q_currents[0]), float(self.q_currents[-1])

    def scaled(self, current: float, flux: float) -> "FluxTable":
        """Return the table with all currents and all fluxes multiplied by positive numbers."""
        return FluxTable(current * self.d_currents, current * self.q_currents, flux * self.d_flux, flux * self.q_flux)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, FluxTable):
            return NotImplemented
        return all(np.array_equal(a, b) for a, b in zip(self._arrays, other._arrays, strict=True))

    def __hash__(self) -> int:
        return hash(tuple(each.tobytes() for each in self._arrays))

    @property
    def _arrays(self) -> tuple[FloatArray, ...]:
        return self.d_currents, self.q_currents, self.d_flux, self.q_flux

    def _refuse_other_frames(self) -> None:
        """Refuse what another frame, sign or order of columns makes of a motor's map."""
        (dd, dq), (qd, qq) = self._mean_slopes()
        lower, upper = np.linalg.eigvalsh(np.array([[dd, 0.5 * (dq + qd)], [0.5 * (dq + qd), qq]]))
        along, across = self._at_no_current()
        seen = f"∂ψd/∂id = {dd:.4g} H, ∂ψq/∂iq = {qq:.4g} H on the whole"
        if upper < 0.0:
            what = "the currents are counted outwards" if along > 0.0 else "the fluxes have the wrong sign"
            raise ValueError(
                f"the flux map's fluxes fall with the currents ({seen}): {what}; give currents into the motor"
            )
        if lower <= 0.0:
            if dq > 0.0 and qd > 0.0 and dq * qd > abs(dd * qq):
                raise ValueError(
                    f"the flux map's ψd follows iq and its ψq id (∂ψd/∂iq = {dq:.4g} H, ∂ψq/∂id = {qd:.4g} H on the whole): "
                    "two columns are swapped"
                )
            axis, wrong = ("q", qq) if qq < dd else ("d", dd)
            if wrong < 0.0:
                raise ValueError(
                    f"the flux map's ψ{axis} falls with i{axis} ({seen}): the sign of i{axis}, or of ψ{axis}, is the wrong one"
                )
            raise ValueError(f"the flux map is no motor's: {seen}, ∂ψd/∂iq = {dq:.4g} H, ∂ψq/∂id = {qd:.4g} H")
        linkage = math.hypot(along, across)
        if linkage < 1e-4 * max(float(np.abs(self.d_flux).max()), float(np.abs(self.q_flux).max())):
            raise ValueError(
                f"the flux map has no flux at no current (ψd = {along:.4g} V·s, ψq = {across:.4g} V·s): "
                "a motor without magnets is not simulated"
            )
        angle = math.degrees(math.atan2(across, along))
        if abs(angle) > 180.0 - _TURNED:
            raise ValueError(
                f"the flux map's ψd is {along:.4g} V·s at no current: d lies against the magnet; turn currents and fluxes by 180°, "
                "all four columns with the other sign"
            )
        if abs(abs(angle) - 90.0) <= _TURNED:
            way = (
                "ψd = −ψq′, id = −iq′, ψq = ψd′, iq = id′"
                if across < 0.0
                else "ψd = ψq′, id = iq′, ψq = −ψd′, iq = −id′"
            )
            raise ValueError(
                f"the flux map's magnet lies along q (ψq = {across:.4g} V·s at no current), as where d is the axis of the higher "
                f"inductance; give it with d along the magnet: {way}"
            )
        if abs(angle) > _TURNED:
            raise ValueError(
                f"the flux map's magnet lies {angle:.1f}° beside the d axis (ψd = {along:.4g} V·s, ψq = {across:.4g} V·s at no current); "
                f"turn currents and fluxes until it is within {_TURNED:g}°"
            )

    def _mean_slopes(self) -> FloatArray:
        """Return the plane of least squares through the points: ((∂ψd/∂id, ∂ψd/∂iq), (∂ψq/∂id, ∂ψq/∂iq)) in H."""
        d, q = np.meshgrid(self.d_currents, self.q_currents, indexing="ij")
        columns = np.array([d.ravel(), q.ravel(), np.ones(d.size)]).T
        slopes = np.linalg.lstsq(columns, np.array([self.d_flux.ravel(), self.q_flux.ravel()]).T, rcond=None)[0]
        return np.asarray(slopes[:2].T, dtype=np.float64)

    def _at_no_current(self) -> tuple[float, float]:
        """Return ψd and ψq (V·s) at no current, straight between the points round it."""
        along, across = (
            float(np.interp(0.0, self.d_currents, [float(np.interp(0.0, self.q_currents, row)) for row in flux]))
            for flux in (self.d_flux, self.q_flux)
        )
        return along, across


def _axis(name: str, values: FloatArray) -> tuple[FloatArray, NDArray[np.intp]]:
    """Return the grid's rising values of one current, and each point's place among them."""
    span = float(np.ptp(values))
    if span == 0.0:
        raise ValueError(f"the flux map has one value of {name}, {values[0]:.6g} A; it takes at least {_LEAST_VALUES}")
    order = np.argsort(values)
    new = np.diff(values[order], prepend=-math.inf) > _ONE * span
    place = np.empty(len(values), dtype=np.intp)
    place[order] = np.cumsum(new) - 1
    return values[order][new], place


def _mirrored(
    d: FloatArray, q: FloatArray, d_flux: FloatArray, q_flux: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the table, one of iq ≥ 0 with the other half that a symmetric motor has."""
    if q[0] != 0.0:
        return d, q, d_flux, q_flux
    odd = float(np.abs(q_flux[:, 0]).max())
    if odd > 0.01 * float(np.abs(q_flux).max()):
        raise ValueError(
            f"the flux map begins at iq = 0, where ψq is up to {odd:.4g} V·s: it cannot be completed by symmetry; give iq < 0 too"
        )
    still = q_flux.copy()
    still[:, 0] = 0.0
    return (
        d,
        np.concatenate([-q[:0:-1], q]),
        np.concatenate([d_flux[:, :0:-1], d_flux], axis=1),
        np.concatenate([-still[:, :0:-1], still], axis=1),
    )


def _number(cell: str, name: str, line: int, file: str) -> float:
    try:
        return float(cell)
    except ValueError:
        raise ValueError(f"{name} in line {line} of {file} is {cell[:40]!r}, no number") from None


def _point(d_axis: FloatArray, q_axis: FloatArray, place: int) -> str:
    d, q = divmod(place, len(q_axis))
    return f"id = {d_axis[d]:.6g} A, iq = {q_axis[q]:.6g} A"
