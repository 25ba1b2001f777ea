"""Records that no model explains, and channels that show nothing, end with a figure or a refusal in words."""

import numpy as np
import pytest

from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.fitting.misfit import Cause
from procedures.estimation.mechanics.cogging import fit_cogging
from procedures.estimation.winding.current_step.response import fit_step_response
from procedures.estimation.winding.current_step.ringing import Resonance
from procedures.estimation.winding.sweep.rotor_sweep import fit_rotor_sweep
from tests.studies.wild_records import ESTIMATORS, outcome


@pytest.mark.parametrize("name", ESTIMATORS)
def test_each_ends(name: str) -> None:
    assert {outcome(name, seed) for seed in range(3)} <= {"figure", "refused"}


@pytest.mark.slow
@pytest.mark.parametrize("name", ESTIMATORS)
def test_each_ends_whatever_it_is_given(name: str) -> None:
    ends = {outcome(name, seed) for seed in range(3, 30)}
    assert "figure" in ends
    assert ends <= {"figure", "refused"}


def test_a_voltage_that_stands_still_is_a_probe_to_check() -> None:
    time = np.arange(400) * 1e-5
    current = -np.expm1(-np.maximum(time - 1e-3, 0.0) / 5e-4)
    with pytest.raises(EstimationError, match="check the voltage probe"):
        fit_step_response(time, np.full(400, 12.0), current)


def test_a_voltage_without_noise_that_goes_back_ends_the_part_that_is_fitted() -> None:
    time = np.arange(400) * 1e-5
    voltage = np.where((time > 1e-3) & (time < 2e-3), 12.0, 0.0)
    fit = fit_step_response(time, voltage, -np.expm1(-np.maximum(time - 1e-3, 0.0) / 5e-4))
    assert [f.cause for f in fit.misfit.findings] == [Cause.PULSE_ENDS]
    assert fit.value("inductance") == pytest.approx(6e-3)


def test_a_resonance_far_from_any_damping_is_outside() -> None:
    assert not Resonance().within(np.array([0.0, 1000.0]))
    assert not Resonance().within(np.array([1000.0, 0.0]))
    assert Resonance().within(np.zeros(2))


def test_an_inductance_that_stays_has_no_saliency() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    fit = fit_rotor_sweep(angle, np.full(40, 1e-3), pole_pairs=2)
    assert fit.value("mean") == pytest.approx(1e-3)
    assert abs(fit.value("amplitude")) <= 1e-9


def test_a_torque_that_stays_has_no_cogging() -> None:
    angle = np.linspace(0.0, 4.0 * np.pi, 800, endpoint=False)
    assert fit_cogging(angle, np.full(800, 0.01)).peak_to_peak == pytest.approx(0.0, abs=1e-12)
