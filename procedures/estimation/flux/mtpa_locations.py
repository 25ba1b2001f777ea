"""Chooses the locations of a half-read map that determine its largest torque per ampere best: on both sides of it."""

import itertools

import numpy as np

from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.flux.flux_map import MeasuredFluxMap
from procedures.estimation.flux.mtpa import maximum_torque_per_ampere
from procedures.estimation.flux.region import measured_region

#: Currents at which the largest torque per ampere is told, shares of the map's largest, those first where the others tell it worst.
MTPA_SHARES = (0.5, 0.25, 1.0, 0.75)
#: A location lies so far (rad) to either side: what the torque's slope between the two is known to, divided by its curvature, is the angle.
#: The second is for those that have no room at the first.
_ASIDE = np.radians((8.0, 16.0))
#: One of so many locations is put there: more would cost the others a row, and bridges that saturate are then not seen. None is nearer to
#: another than this share of its own current: from two that are close to each other their noise alone gives a slope.
_ONE_OF, _APART = 8, 0.09


def held_back(locations: int) -> int:
    """Return how many of a map's locations wait until the others say where its largest torque per ampere is: an even number."""
    return 2 * min(len(MTPA_SHARES), locations // (2 * _ONE_OF))


def about_mtpa(measured: MeasuredFluxMap, count: int) -> FloatArray:
    """Return up to `count` locations (m, 2) in A, i_q > 0, in pairs around the largest torque per ampere at the first of `MTPA_SHARES`
    that have room for them.

    Where the map ends before the torque has its maximum there is nothing to be learned by them, and none beyond the map is given.
    """
    largest, region = measured.largest_current, measured_region(measured)
    made: list[FloatArray] = []
    for aside, share in itertools.product(_ASIDE, MTPA_SHARES):
        if len(made) == count:
            break
        try:
            (point,) = maximum_torque_per_ampere(measured, [share * largest], 1.0)
        except EstimationError:
            continue
        if point.at_edge:
            continue
        middle = np.arctan2(point.i_q, point.i_d)
        for angle in (middle - aside, middle + aside):
            at = point.current * np.array([np.cos(angle), np.sin(angle)])
            near = float(np.min(np.hypot(*(np.vstack((measured.points, *made)) - at).T)))
            has_room = min(near, at[1]) > _APART * point.current and region.holds(at[np.newaxis])[0]
            if has_room and len(made) < count:
                made.append(at)
    return np.array(made).reshape(-1, 2)
