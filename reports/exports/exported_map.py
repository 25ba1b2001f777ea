"""A flux map as exports take it: its points with their uncertainty, and its smooth surface on a grid."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Largest relative standard uncertainty of ψ, of the largest |ψ|, with which a map goes into a controller: that of λ.
LARGEST_UNCERTAINTY = 0.05
_COLUMNS = ("id_A", "iq_A", "psi_d_Vs", "psi_q_Vs", "u_psi_d_Vs", "u_psi_q_Vs")


@dataclass(frozen=True)
class SaturationLine:
    """ψ_d = ψ_d(0) + L·i_d + scale·i_d² on the negative d axis, down to `lowest` (A): L in H, scale in H/A."""

    inductance: float
    scale: float
    standard_uncertainty: float
    coverage_interval: tuple[float, float]
    lowest: float


@dataclass(frozen=True)
class ExportedMap:
    """Flux linkages in V·s, peak, d along the magnet, currents in A, peak, into the motor; both signs of i_q.

    `points` (k, 6) are the measured currents, flux linkages and their standard uncertainties. `psi_d`, `psi_q` (n, m) are the smooth
    surface over `i_d` (n,) and `i_q` (m,); where `measured` (n, m) is false it is carried on beyond the points. `resistance` (Ω) is
    the winding's, inverter and leads with it, as warm as it was.
    """

    procedure: str
    pole_pairs: float
    points: FloatArray
    i_d: FloatArray
    i_q: FloatArray
    psi_d: FloatArray
    psi_q: FloatArray
    measured: NDArray[np.bool_]
    resistance: float
    saturation: SaturationLine | None = None

    @property
    def full_scale(self) -> float:
        """The largest measured |ψ| (V·s)."""
        return float(np.max(np.hypot(self.points[:, 2], self.points[:, 3])))

    @property
    def relative_uncertainty(self) -> float:
        """The largest standard uncertainty of a flux linkage, in shares of the full scale."""
        return float(np.max(self.points[:, 4:])) / self.full_scale

    @property
    def beyond(self) -> int:
        """The number of the grid's points that lie beyond the measured ones."""
        return int(np.count_nonzero(~self.measured))


def exported_map(procedure: str, findings: Mapping[str, Any]) -> ExportedMap | None:
    """Return the map among a procedure's findings; None where it has none."""
    grid, table = findings.get("grid"), findings.get("tables", {}).get("flux_map.csv")
    pole_pairs = findings.get("pole_pairs")
    if grid is None or table is None or pole_pairs is None or any(name not in table for name in _COLUMNS):
        return None
    points = np.column_stack([np.asarray(table[name], dtype=np.float64) for name in _COLUMNS])
    if findings.get("symmetric", False):
        mirrored = points[points[:, 1] > 0.0] * [1.0, -1.0, 1.0, -1.0, 1.0, 1.0]
        points = np.vstack((points, mirrored))
    points = points[np.lexsort((points[:, 1], points[:, 0]))]
    warm = findings.get("resistance", {}).get("resistance", ())
    return ExportedMap(
        procedure,
        float(pole_pairs),
        points,
        i_d=np.asarray(grid["i_d"], dtype=np.float64),
        i_q=np.asarray(grid["i_q"], dtype=np.float64),
        psi_d=np.asarray(grid["psi_d"], dtype=np.float64),
        psi_q=np.asarray(grid["psi_q"], dtype=np.float64),
        measured=np.asarray(grid["measured"], dtype=np.bool_),
        resistance=float(np.mean(warm)) if len(warm) else math.nan,
        saturation=_saturation(findings.get("d_axis_saturation")),
    )


def _saturation(found: Mapping[str, Any] | None) -> SaturationLine | None:
    if found is None:
        return None
    scale = found["scale"]
    low, high = scale["coverage_interval"]
    return SaturationLine(
        float(found["inductance"]["value"]), float(scale["value"]), float(scale["standard_uncertainty"]),
        (float(low), float(high)), float(found["lowest_current"]),
    )  # fmt: skip
