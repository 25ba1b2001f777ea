from dataclasses import replace

import numpy as np
import pytest

from procedures.estimation.emf.back_emf import BackEmfFit, fit_back_emf
from procedures.estimation.emf.integrated_flux import flux_by_integration
from procedures.estimation.emf.record import DigitizedChannel
from procedures.estimation.fitting.fit import EstimationError, coverage_interval
from procedures.estimation.fitting.misfit import Answer, Cause, Finding
from tests.studies.emf_records import Setup, draw, record

PLAIN = Setup()


def told(setup: Setup, *, clipped: bool | None = None, gain_limit: float = 0.0) -> list[DigitizedChannel]:
    return [DigitizedChannel(f"CH{k + 1}", setup.step, clipped, gain_limit) for k in range(len(setup.gains))]


def fitted(setup: Setup, seed: int = 1, *, clipped: bool | None = None, gain_limit: float = 0.0) -> BackEmfFit:
    time, v = record(np.random.default_rng(seed), setup)
    return fit_back_emf(time, v, digitized=told(setup, clipped=clipped, gain_limit=gain_limit))


def only(fit: BackEmfFit, cause: Cause) -> Finding:
    (finding,) = (f for f in fit.misfit.findings if f.cause is cause)
    return finding


def holds(fit: BackEmfFit, true: float, times: float = 1.0) -> bool:
    flux = fit.flux_linkage
    low, high = coverage_interval(flux.value, flux.uncertainty, flux.degrees_of_freedom)
    return abs(flux.value - true) <= 0.5 * times * (high - low)


def test_a_clean_record_is_told_nothing_of() -> None:
    random = np.random.default_rng(3)
    said = 0
    for seed in range(60):
        setup = replace(draw(random), drift=0.0, points=1000)
        said += bool(fitted(setup, seed).misfit)
    assert said <= 2


@pytest.mark.parametrize("ends", [(0.95, 0.95), (0.85, 0.85), (np.inf, 0.9), (0.8, np.inf)])
def test_what_clipped_is_left_out_and_the_rest_tells_the_waveform(ends: tuple[float, float]) -> None:
    setup = replace(PLAIN, ends=ends)
    fit = fitted(setup)
    finding = only(fit, Cause.CLIPPED)
    assert finding.answer in (Answer.MODELLED, Answer.WIDENED)
    assert 0.1 < finding.figures["lost"] < 0.45
    assert holds(fit, setup.flux, times=1.5)
    # What all readings would give is several times as far off.
    time, v = record(np.random.default_rng(1), setup)
    silent = fit_back_emf(time, v, digitized=told(setup, clipped=False)).flux_linkage.value
    assert abs(silent - setup.flux) > 3.0 * abs(fit.flux_linkage.value - setup.flux)


def test_a_record_that_lost_half_of_itself_gives_no_figure() -> None:
    fit = fitted(replace(PLAIN, ends=(0.65, 0.65)))
    assert fit.misfit.withholding("flux_linkage") is only(fit, Cause.CLIPPED)


def test_a_drifting_record_that_clipped_is_integrated_over_its_model() -> None:
    setup = replace(PLAIN, ends=(0.9, 0.9), drift=0.04)
    time, v = record(np.random.default_rng(4), setup)
    flux = flux_by_integration(time, v, digitized=told(setup))
    assert any(f.cause is Cause.CLIPPED for f in flux.misfit.findings)
    assert flux.mean()[0] == pytest.approx(setup.flux, rel=5e-3)


@pytest.mark.parametrize(
    ("factor", "proposed"), [(0.1, 10.0), (10.0, 0.1), (3**-0.5, 3**0.5), (0.5, 2.0), (0.37, 1 / 0.37)]
)
def test_a_channel_with_another_factor_is_named_with_what_to_multiply_it_by(factor: float, proposed: float) -> None:
    fit = fitted(replace(PLAIN, gains=(1.0, factor, 1.004)))
    finding = only(fit, Cause.PROBE_FACTOR)
    assert fit.misfit.withholding("flux_linkage") is finding
    assert finding.figures["channel"] == "CH2"
    assert finding.figures["factor"] == pytest.approx(proposed, rel=1e-9 if factor != 0.37 else 0.01)


def test_channels_that_differ_beyond_chance_have_their_scatter_in_the_interval() -> None:
    setup = replace(PLAIN, gains=(1.0, 1.02, 1.03))
    fit = fitted(setup)
    finding = only(fit, Cause.CHANNELS_DIFFER)
    assert (finding.figures["lowest"], finding.figures["highest"]) == ("CH1", "CH3")
    assert finding.figures["difference"] == pytest.approx(0.03 / 1.0167, rel=0.02)
    assert fit.flux_linkage.degrees_of_freedom == pytest.approx(2.0, rel=0.01)
    assert holds(fit, setup.flux)
    # What was stated is expected, and not told twice.
    assert not fitted(setup, gain_limit=0.02).misfit


def test_hum_is_taken_out_where_the_record_tells_it_from_the_fundamental() -> None:
    setup = replace(PLAIN, frequency=62.0, periods=5.0, hum=(0.05, 0.04, 0.05))
    fit = fitted(setup)
    finding = only(fit, Cause.HUM)
    assert finding.answer is Answer.MODELLED
    assert finding.figures["frequency"] == pytest.approx(50.0, rel=0.01)
    assert finding.figures["amplitude"] == pytest.approx(0.05 * setup.step * setup.steps, rel=0.1)
    assert holds(fit, setup.flux, times=1.5)


def test_noise_that_does_not_average_the_steps_out_is_said() -> None:
    coarse = fitted(replace(PLAIN, noise=0.0, steps=40.0))
    assert only(coarse, Cause.TOO_COARSE).answer is Answer.WIDENED
    assert holds(coarse, PLAIN.flux, times=1.5)
    assert (
        coarse.flux_linkage.uncertainty > 2.0 * fitted(replace(PLAIN, noise=0.5, steps=40.0)).flux_linkage.uncertainty
    )


def test_each_channel_is_described() -> None:
    time, v = record(np.random.default_rng(1), PLAIN)
    with pytest.raises(EstimationError, match="1 channels are described, 3 recorded"):
        fit_back_emf(time, v, digitized=told(PLAIN)[:1])
