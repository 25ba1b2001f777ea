"""What comes again with the angle of ramps that are read seldom, or as means: an encoder out of centre, and cogging."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from procedures.estimation.fitting.misfit import Cause
from procedures.estimation.mechanics.inertia import fit_ramps
from procedures.estimation.mechanics.turning import SpeedRamp

INERTIA, COULOMB, VISCOUS, TORQUE = 1.2e-4, 0.014, 4e-5, 0.035
#: A mean over 20 ms is that of 10 ms before.
RATE, LATE, EVERY = VISCOUS / INERTIA, 0.010, 0.006


def ramps(order: int, runout: float, cogging: float) -> list[SpeedRamp]:
    random = np.random.default_rng(5)
    top = 5.0 + (TORQUE - COULOMB) / INERTIA * 0.4
    return [ramp(*each, order, runout, cogging, random) for each in ((5.0, TORQUE, 68), (top, 0.0, 82))]


def ramp(
    begin: float, torque: float, count: int, order: int, runout: float, cogging: float, random: np.random.Generator
) -> SpeedRamp:
    time = EVERY * np.arange(count)
    end = (torque - COULOMB) / VISCOUS

    def speed(at: NDArray[np.float64]) -> NDArray[np.float64]:
        return end + (begin - end) * np.exp(-RATE * at)

    angle = end * time + (begin - end) * -np.expm1(-RATE * time) / RATE
    ripple = np.sin(order * angle + 1.0) * (runout + cogging / speed(time) ** 2)
    read = speed(time - LATE) * (1.0 + ripple) + random.normal(0.0, 2e-3, count)
    return SpeedRamp(time, read, torque)


def test_run_out_that_lags_the_more_the_faster_the_shaft_is_is_taken_for_no_friction() -> None:
    fit = fit_ramps(ramps(1, 0.01, 0.0))
    assert {finding.cause for finding in fit.misfit.findings} == {Cause.ECCENTRICITY}
    for name, truth in (("inertia", INERTIA), ("coulomb_friction", COULOMB), ("viscous_friction", VISCOUS)):
        assert math.isclose(fit.value(name), truth, abs_tol=2.0 * fit.uncertainty(name))
        assert fit.uncertainty(name) < 0.2 * truth


@pytest.mark.parametrize(("order", "told"), [(9, True), (40, False)])
def test_cogging_is_counted_only_where_the_readings_are_close_enough(order: int, told: bool) -> None:
    findings = [f for f in fit_ramps(ramps(order, 0.0, 1.0)).misfit.findings if f.cause is Cause.COGGING]
    assert findings
    for finding in findings:
        assert (finding.figures.get("record") != "ramp-seldom") is told
        assert finding.figures["order"] == order or not told
