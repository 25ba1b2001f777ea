"""The one factor by which a firmware lowers an observer's inductance in proportion to the current, fitted to a flux map."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces.text import Text, text
from reports.exports.exported_map import ExportedMap, FloatArray
from reports.exports.figures import ExportFigure
from reports.exports.map_quantities import FromMap

#: Least points along the q axis, and largest uncertainty of the factor (share of L at the largest current).
_LEAST, _LARGEST_UNCERTAINTY = 4, 0.05


@dataclass(frozen=True)
class SaturationFactor:
    """(L_d + L_q)/2 falls by `factor`·i_q/`largest_current` (A), at i_d = 0.

    `angle_without`, `angle_with` are the largest errors (deg) of the angle of ψ − L·i, which an observer takes for the magnets'.
    """

    factor: float
    standard_uncertainty: float
    largest_current: float
    angle_without: float
    angle_with: float


def saturation_factor(found: ExportedMap) -> SaturationFactor | None:
    """Return the factor by least squares of the angle's error along the q axis; None where the map has too little of that axis.

    What it leaves counts as uncertainty.
    """
    zero = int(np.argmin(np.abs(found.i_d)))
    middle = int(np.argmin(np.abs(found.i_q)))
    on_axis = found.measured[zero] & (found.i_q > 0.0)
    # L of both axes at no current, which is what a bridge reads: slopes of the surface.
    slope_d = _slope_at_zero(found.i_d, found.psi_d[:, middle], found.measured[:, middle])
    slope_q = _slope_at_zero(found.i_q, found.psi_q[zero], found.measured[zero])
    if np.count_nonzero(on_axis) < _LEAST or slope_d is None or slope_q is None:
        return None
    mean = float(slope_d + slope_q) / 2.0
    current, psi_d, psi_q = found.i_q[on_axis], found.psi_d[zero, on_axis], found.psi_q[zero, on_axis]
    largest = float(current[-1])
    # Flux across the magnets that a constant L_q does not know, and what the factor takes off.
    beyond = slope_q * current - psi_q
    taken = mean * current**2 / largest
    weight = 1.0 / psi_d**2
    factor = float(np.sum(weight * taken * beyond) / np.sum(weight * taken**2))
    left = beyond - factor * taken
    u_left = math.sqrt(float(np.sum(weight * left**2) / np.sum(weight * taken**2)) / (current.size - 1))
    u_points = float(np.max(found.points[:, 5])) / (mean * largest)

    def angle(off: np.ndarray) -> float:
        return float(np.degrees(np.max(np.abs(np.arctan2(off, psi_d)))))

    return SaturationFactor(factor, math.hypot(u_left, u_points), largest, angle(beyond), angle(left))


def _slope_at_zero(current: FloatArray, flux: FloatArray, measured: NDArray[np.bool_]) -> float | None:
    """Return the slope (H) at no current of what was measured, which may end there; None where it is not there, or too little."""
    at = current[measured]
    if at.size < _LEAST or float(np.min(np.abs(at))) > 1e-6 * float(np.max(np.abs(current))):
        return None
    return float(np.gradient(flux[measured], at, edge_order=2)[np.argmin(np.abs(at))])


def _figure(found: ExportedMap) -> ExportFigure:
    fit = saturation_factor(found)
    if fit is None:
        return ExportFigure(math.nan)
    half = 2.0 * fit.standard_uncertainty
    return ExportFigure(fit.factor, fit.standard_uncertainty, (fit.factor - half, fit.factor + half))


def _objections(found: ExportedMap, replaced: float | None) -> Iterator[Text]:
    fit = saturation_factor(found)
    if fit is None:
        yield text("the flux map has too few points on the q axis, where the saturation factor is fitted")
    elif not 0.0 < fit.factor <= 1.0:
        yield text(
            "the saturation factor would be {factor:.3g}, allowed is 0 to 1: L does not decrease with the current "
            "as the firmware assumes",
            factor=fit.factor,
        )
    elif fit.standard_uncertainty > (bound := _LARGEST_UNCERTAINTY if replaced is None else replaced):
        yield text(
            "the saturation factor is known to ±{spread:.2g} only (standard uncertainty), but at most {bound:.2g} "
            "is allowed",
            spread=fit.standard_uncertainty,
            bound=bound,
        )


SATURATION_FACTOR = FromMap(
    "",
    "share by which (Ld+Lq)/2 of the observer falls at l_current_max, from the flux map at id = 0",
    _figure,
    against=_objections,
)
SATURATION_MODE = FromMap(
    "",
    "1 = Factor: L and flux linkage of the observer fall in proportion to the current",
    lambda _: ExportFigure(1.0, exact=True),
    whole=True,
    against=_objections,
)
