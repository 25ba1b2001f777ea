"""An encoder out of centre, read as a mean: what comes once a turn lags the more, the faster the shaft is."""

import math

import numpy as np
from numpy.typing import NDArray

from procedures.estimation.fitting.misfit import Cause
from procedures.estimation.mechanics.inertia import fit_ramps
from procedures.estimation.mechanics.turning import SpeedRamp

INERTIA, COULOMB, VISCOUS, TORQUE = 1.2e-4, 0.014, 4e-5, 0.035
#: A mean over 20 ms is that of 10 ms before.
RATE, LATE, EVERY = VISCOUS / INERTIA, 0.010, 0.006


def ramp(begin: float, torque: float, count: int, random: np.random.Generator) -> SpeedRamp:
    time = EVERY * np.arange(count)
    end = (torque - COULOMB) / VISCOUS

    def speed(at: NDArray[np.float64]) -> NDArray[np.float64]:
        return end + (begin - end) * np.exp(-RATE * at)

    angle = end * time + (begin - end) * -np.expm1(-RATE * time) / RATE
    read = speed(time - LATE) * (1.0 + 0.01 * np.sin(angle + 1.0)) + random.normal(0.0, 2e-3, count)
    return SpeedRamp(time, read, torque)


def test_it_is_taken_for_no_friction() -> None:
    random = np.random.default_rng(5)
    top = 5.0 + (TORQUE - COULOMB) / INERTIA * 0.4
    fit = fit_ramps([ramp(5.0, TORQUE, 68, random), ramp(top, 0.0, 82, random)])
    assert {finding.cause for finding in fit.misfit.findings} == {Cause.ECCENTRICITY}
    for name, truth in (("inertia", INERTIA), ("coulomb_friction", COULOMB), ("viscous_friction", VISCOUS)):
        assert math.isclose(fit.value(name), truth, abs_tol=2.0 * fit.uncertainty(name))
        assert fit.uncertainty(name) < 0.2 * truth
