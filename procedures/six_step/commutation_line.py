"""The commutation resistance as a straight line over speed, with the band that its uncertainties make."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from GTC.lib import UncertainReal

from drivers.interfaces.text import text
from procedures.core.budget import Uncertainties
from procedures.estimation.fitting.linear import least_squares
from procedures.estimation.fitting.misfit import NO_MISFIT, Misfit
from procedures.estimation.six_step.load_misfit import bend

_RPM = 30.0 / math.pi
#: Speeds at which the band is given.
_BAND_POINTS = 9


def commutation_line(
    speeds: Sequence[float], resistances: Sequence[UncertainReal], uncertainties: Uncertainties
) -> tuple[UncertainReal, UncertainReal, dict[str, Any], Misfit]:
    """Return slope (Ω·s/rad) and value at standstill (Ω) of a line through R_c (Ω) over speed (rad/s), its band as a finding, and the
    misfit of both.

    The errors that all points share stay shared; the scatter round the line is one input besides. Where R_c bends, both ends' slopes are
    in the interval. Raises EstimationError on fewer than three speeds.
    """
    speed = np.asarray(speeds, dtype=float)
    # Round the middle speed slope and height have independent scatter.
    centre = float(speed.mean())
    design = np.column_stack((speed - centre, np.ones_like(speed)))
    values = np.array([float(r.x) for r in resistances])
    fit = least_squares(("slope", "height"), design, values)
    bent = bend(speed, values)
    solve = np.linalg.pinv(design)
    slope, height = (
        uncertainties.statistical(
            text("commutation resistance over speed, {name}", name=name),
            0.0,
            fit.uncertainty(name),
            fit.degrees_of_freedom,
        )
        + sum(float(w) * r for w, r in zip(row, resistances, strict=True))
        for name, row in zip(("slope", "height"), solve, strict=True)
    )
    if bent is not None:
        slope = slope + uncertainties.limit("commutation resistance bends over speed", 0.0, bent.turned)
    band = []
    for at in np.linspace(float(speed.min()), float(speed.max()), _BAND_POINTS):
        told = height + slope * float(at - centre)
        low, high = uncertainties.interval(told)
        band.append({"speed_rpm": float(at) * _RPM, "value": float(told.x), "low": low, "high": high})
    offset = height - slope * centre
    finding = {
        "slope": float(slope.x),
        "offset": float(offset.x),
        "slope_standard_uncertainty": float(slope.u),
        "offset_standard_uncertainty": float(offset.u),
        "residual": fit.residual_rms,
        "band": band,
    }
    return slope, offset, finding, NO_MISFIT if bent is None else bent.misfit
