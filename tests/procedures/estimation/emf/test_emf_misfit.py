from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from procedures.estimation.emf.back_emf import BackEmfFit, fit_back_emf
from procedures.estimation.emf.integrated_flux import flux_by_integration
from procedures.estimation.emf.record import DigitizedChannel
from procedures.estimation.fitting.fit import EstimationError, FloatArray, coverage_interval
from procedures.estimation.fitting.misfit import Answer, Cause, Finding
from tests.studies.worlds.emf_records import Setup, draw, record

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


@pytest.mark.parametrize("records", [12, pytest.param(60, marks=pytest.mark.slow)])
def test_a_clean_record_is_told_nothing_of(records: int) -> None:
    random = np.random.default_rng(3)
    said = 0
    for seed in range(records):
        setup = replace(draw(random), drift=0.0, points=1000)
        said += bool(fitted(setup, seed).misfit)
    assert said <= records / 30


@pytest.mark.parametrize("gain", [0.02, -0.1])
def test_polarities_of_unequal_gain_show_in_even_orders_and_are_held(gain: float) -> None:
    time, v = record(np.random.default_rng(4), PLAIN)
    bent = np.where(v > 0.0, (1.0 + gain) * v, v)
    fit = fit_back_emf(time, bent, digitized=told(PLAIN))
    assert only(fit, Cause.DISTORTION).answer is Answer.WIDENED
    assert holds(fit, PLAIN.flux)
    assert not holds(fitted(PLAIN), PLAIN.flux * (1.0 + 0.5 * gain))
    whole = flux_by_integration(time, bent, digitized=told(PLAIN))
    assert Cause.DISTORTION in {finding.cause for finding in whole.misfit.findings}


def test_polarities_so_unequal_that_the_interval_would_say_little_give_no_flux_linkage() -> None:
    time, v = record(np.random.default_rng(4), PLAIN)
    bent = np.where(v > 0.0, 0.5 * v, v)
    for fit in (
        fit_back_emf(time, bent, digitized=told(PLAIN)),
        flux_by_integration(time, bent, digitized=told(PLAIN)),
    ):
        reason = fit.misfit.withholding("flux_linkage")
        assert reason is not None
        assert reason.cause is Cause.DISTORTION


@pytest.mark.parametrize("records", [8, pytest.param(40, marks=pytest.mark.slow)])
def test_a_machine_of_many_odd_harmonics_is_not_taken_for_a_bent_channel(records: int) -> None:
    random, said = np.random.default_rng(6), 0
    for seed in range(records):
        odd = tuple((k, float(random.uniform(0.0, 0.1 / k)), float(random.uniform(0.0, 6.3))) for k in range(3, 26, 2))
        setup = replace(draw(random), harmonics=odd, drift=0.0, points=1000)
        said += any(finding.cause is Cause.DISTORTION for finding in fitted(setup, seed).misfit.findings)
    assert said <= records / 20


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
    silent = fit_back_emf(time, v).flux_linkage.value
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


def before_the_noise(setup: Setup, level: float, seed: int = 2) -> tuple[FloatArray, FloatArray]:
    """Return a record whose probes' amplifiers cut off at so much of the amplitude, above and below zero; noise comes after them."""
    random = np.random.default_rng(seed)
    time, v = record(random, replace(setup, noise=0.0, steps=1e9))
    amplitude = setup.step * setup.steps
    noisy = np.clip(v, -level * amplitude, level * amplitude) + random.normal(0.0, setup.noise * setup.step, v.shape)
    return time, np.round(noisy / setup.step) * setup.step


@pytest.mark.parametrize("level", [0.94, 0.83])
def test_tops_that_an_amplifier_cuts_off_are_seen_beneath_the_noise(level: float) -> None:
    setup = replace(PLAIN, noise=1.5, points=1000)
    time, v = before_the_noise(setup, level)
    # The converter itself is whole, as the instrument says.
    fit = fit_back_emf(time, v, digitized=told(setup, clipped=False))
    assert only(fit, Cause.CLIPPED).figures["level"] == pytest.approx(level * setup.step * setup.steps, rel=0.01)
    assert holds(fit, setup.flux, times=1.5)
    assert fit_back_emf(time, v).flux_linkage.value < 0.99 * setup.flux


def test_a_trapezoid_is_not_taken_for_a_cut_wave() -> None:
    orders = np.arange(1, 60, 2)[:, None]
    # Flat over 110°, its corners rounded over about 15°.
    ramp = np.radians(35.0)
    sizes = np.sin(orders * ramp) / (orders**2 * ramp) * np.exp(-0.5 * (orders * np.radians(6.5)) ** 2)
    random = np.random.default_rng(6)
    time = np.arange(2500) * 1e-5
    for noise in (0.2, 0.5, 1.0):
        angle = 2.0 * np.pi * 300.0 * time + np.array([0.0, -2.0, 2.0])[:, None] * np.pi / 3.0
        v = 90.0 / sizes[0] * np.einsum("ko,ckn->cn", sizes, np.sin(orders * angle[:, None]))
        v = np.round(v + random.normal(0.0, noise, v.shape))
        fit = fit_back_emf(time, v, digitized=told(replace(PLAIN, flux=90.0 / (2 * np.pi * 80.0))))
        assert not any(f.cause is Cause.CLIPPED for f in fit.misfit.findings)


@pytest.mark.parametrize(("share", "noise"), [(0.2, 0.05), (0.3, 0.05), (0.2, 0.2), (0.4, 0.64), (0.5, 0.2)])
def test_a_wave_of_which_little_is_left_gives_no_figure(share: float, noise: float) -> None:
    setup = replace(PLAIN, periods=10.0, points=5000, ends=(share, share), steps=60.0 / share, noise=noise)
    time, v = record(np.random.default_rng(3), setup)
    withheld = fit_back_emf(time, v, digitized=told(setup)).misfit.withholding("flux_linkage")
    assert withheld is not None
    assert withheld.cause is Cause.CLIPPED


def frozen(v: FloatArray) -> FloatArray:
    v[1, 700:1500] = v[1, 699]
    return v


def with_spikes(v: FloatArray) -> FloatArray:
    v[[0, 1, 2], [300, 1100, 2000]] *= [40.0, -3.0, 7.0]
    return v


@pytest.mark.parametrize(("spoilt", "lost"), [(frozen, 800), (with_spikes, 3)])
def test_readings_that_are_none_are_counted_and_left_out(spoilt: Callable[[FloatArray], FloatArray], lost: int) -> None:
    time, v = record(np.random.default_rng(3), PLAIN)
    v = spoilt(v)
    fit = fit_back_emf(time, v, digitized=told(PLAIN))
    finding = only(fit, Cause.DROPOUTS)
    assert finding.answer is Answer.MODELLED
    assert finding.figures["count"] == pytest.approx(lost, abs=2)
    assert holds(fit, PLAIN.flux, times=1.5)
    assert (
        only(fit, Cause.DROPOUTS).figures
        == flux_by_integration(time, v, digitized=told(PLAIN)).misfit.findings[0].figures
    )


def test_a_channel_that_stood_still_for_most_of_the_record_gives_no_figure() -> None:
    time, v = record(np.random.default_rng(3), PLAIN)
    v[2, 600:2100] = v[2, 600]
    fit = fit_back_emf(time, v, digitized=told(PLAIN))
    assert fit.misfit.withholding("flux_linkage") is only(fit, Cause.DROPOUTS)


def test_samples_lost_under_a_time_without_a_gap_leave_the_longest_whole_part() -> None:
    time, v = record(np.random.default_rng(3), PLAIN)
    whole = np.ones(time.size, dtype=bool)
    whole[500:560] = whole[2000:2100] = False
    v, time = v[:, whole], time[: np.count_nonzero(whole)]
    fit = fit_back_emf(time, v, digitized=told(PLAIN))
    figures = only(fit, Cause.DROPOUTS).figures
    assert figures["count"] == 2.0
    assert figures["used"] == pytest.approx(1440 / 2340, abs=0.05)
    assert holds(fit, PLAIN.flux, times=1.5)
    assert fit.residuals.shape == v.shape
    integrated = flux_by_integration(time, v, digitized=told(PLAIN))
    assert integrated.flux_linkage.value == pytest.approx(PLAIN.flux, rel=1e-3)
    # Where neither part holds a period, nothing is given.
    short = slice(140, 740)
    fit = fit_back_emf(time[short], v[:, short], digitized=told(PLAIN))
    assert fit.misfit


def test_wild_readings_of_a_long_record_leave_the_frequency_known() -> None:
    random = np.random.default_rng(5)
    time = np.linspace(0.0, 0.12, 60_000)
    v = np.array([2.0 * np.sin(2.0 * np.pi * 58.3 * time - k * 2.0 * np.pi / 3.0) for k in range(3)])
    v += random.normal(0.0, 0.02, v.shape)
    v[1, random.integers(0, time.size, 100)] += random.choice([-8.0, 8.0], 100)
    told = [DigitizedChannel(f"CH{k + 1}", 0.02, None, 0.01) for k in range(3)]
    fit = fit_back_emf(time, v, digitized=told)
    assert [finding.cause for finding in fit.misfit.findings] == [Cause.DROPOUTS]
    assert abs(fit.frequency - 58.3) < 2.0 * fit.frequency_uncertainty < 0.2
