"""A sample that is missing soon after a step looks like eddy currents: both are named, and the interval holds the truth."""

import numpy as np
import pytest

from procedures.estimation.fitting.misfit import Cause
from procedures.estimation.winding.current_step import lost_samples
from procedures.estimation.winding.current_step.response import StepFit, fit_step_response

R, L, SAMPLES = 0.2, 150e-6, 2500
STEP = 8.0 * L / R / SAMPLES


def fitted(lost: int, after: int, seed: int = 0, coupling: float = 0.0, lag: float = 0.02) -> StepFit:
    """Fit 12-bit readings of a step of 10 A of which `lost` samples are missing `after` samples on, or with a closed circuit beside."""
    random = np.random.default_rng(seed)
    time = (np.arange(SAMPLES + lost) - 250 + 0.37) * STEP
    on = np.maximum(time, 0.0) * R / L
    # Two coupled circuits of one inductance, the second closed: two rates.
    if coupling:
        rates, shares = (each.real for each in np.linalg.eig(-_inverse(coupling) @ np.diag([1.0, 1.0 / lag])))
        weights = np.linalg.solve(shares, np.array([1.0, 0.0]))
        current = 10.0 * (1.0 - np.exp(np.outer(on, rates)) @ (shares[0] * weights))
    else:
        current = -10.0 * np.expm1(-on)
    voltage = np.where(time >= 0.0, 2.0, 0.0)
    kept = np.r_[0 : 250 + after, 250 + after + lost : time.size]
    read = [
        np.round((x[kept] + random.normal(0.0, noise, SAMPLES)) / code) * code
        for x, noise, code in ((voltage, 0.006, 0.006), (current, 0.03, 0.03))
    ]
    return fit_step_response(np.arange(SAMPLES) * STEP, *read, voltage_resolution=0.006, current_resolution=0.03)


def _inverse(coupling: float) -> np.ndarray:
    """Return the inverse of two circuits' inductances over L that are coupled by k²."""
    mutual = np.sqrt(coupling)
    return np.linalg.inv(np.array([[1.0, mutual], [mutual, 1.0]]))


@pytest.mark.parametrize("after", [4, 8, 16])
@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_two_missing_samples_soon_after_the_step_are_a_cause_beside_eddy_currents(after: int, seed: int) -> None:
    fit = fitted(2, after, seed)
    assert {Cause.DROPOUTS, Cause.SECOND_TIME_CONSTANT} <= {f.cause for f in fit.misfit.findings}
    assert abs(fit.value("inductance") - L) < 2.0 * fit.uncertainty("inductance")
    assert abs(fit.value("resistance") - R) < 2.5 * fit.uncertainty("resistance")


def test_later_they_are_told_as_missing() -> None:
    fit = fitted(2, 30)
    assert [f.cause for f in fit.misfit.findings] == [Cause.DROPOUTS]


@pytest.mark.parametrize("seed", [0, 1])
def test_slow_eddy_currents_are_not_taken_for_a_gap(seed: int) -> None:
    fit = fitted(0, 0, seed, coupling=0.3, lag=0.3)
    causes = {f.cause for f in fit.misfit.findings}
    assert Cause.SECOND_TIME_CONSTANT in causes
    assert Cause.DROPOUTS not in causes
    assert abs(fit.value("inductance") - L) < 2.5 * fit.uncertainty("inductance")


def test_a_gap_that_no_place_explains_ends_the_search(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []

    def nowhere(place: int, *_: object) -> None:
        asked.append(place)
        assert len(asked) < 1000

    monkeypatch.setattr(lost_samples, "_at", nowhere)
    assert Cause.DROPOUTS in {f.cause for f in fitted(2, 30).misfit.findings}
    assert asked
