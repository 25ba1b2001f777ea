import numpy as np
import pytest

from procedures.estimation.emf.back_emf import (
    fit_back_emf,
)
from procedures.estimation.emf.integrated_flux import flux_by_integration
from procedures.estimation.emf.period import peak_amplitude, peak_to_peak
from procedures.estimation.fitting.fit import EstimationError
from tests.studies.worlds.simulated import FLUX, SPEED, emf_record

TIME = np.arange(2000) * 5e-5
SHIFT = -2 * np.pi / 3 * np.arange(3)[:, None]


def waves(frequency: float = 53.0, fifth: float = 0.05) -> np.ndarray:
    angle = 2 * np.pi * frequency * TIME + 0.3 + SHIFT
    return 3.0 * np.cos(angle) + 3.0 * fifth * np.cos(5 * angle) + np.array([[0.1], [-0.2], [0.0]])


def test_exact_waveforms_come_back() -> None:
    fit = fit_back_emf(TIME, waves())
    assert fit.frequency == pytest.approx(53.0, rel=1e-9)
    assert np.abs(fit.amplitudes[:, 0]) == pytest.approx(3.0)
    assert np.abs(fit.amplitudes[:, 2]) == pytest.approx(0.15)
    assert np.degrees(fit.phases) == pytest.approx([0.0, -120.0, 120.0])
    assert fit.offsets == pytest.approx([0.1, -0.2, 0.0])
    assert fit.thd == pytest.approx(0.05)
    assert not fit.drift_significant
    assert fit.flux_linkage.value == pytest.approx(3.0 / (2 * np.pi * 53.0))


def test_an_order_that_was_not_asked_for_is_found_and_taken_out_of_what_is_left() -> None:
    noise = np.random.default_rng(7).normal(0.0, 0.02, (3, TIME.size))
    eleventh = 0.02 * np.cos(11 * (2 * np.pi * 53.0 * TIME + 0.3 + SHIFT))
    plain, fit = fit_back_emf(TIME, waves() + noise), fit_back_emf(TIME, waves() + noise + eleventh)
    assert set(plain.further) == set()
    assert set(fit.further) == {11}
    assert fit.further[11] == pytest.approx(0.02, abs=0.003)
    assert np.std(fit.residuals) == pytest.approx(0.02, rel=0.03)
    assert fit.flux_linkage.value == pytest.approx(plain.flux_linkage.value, rel=1e-4)


def test_noise_shows_no_further_orders() -> None:
    found = [
        fit_back_emf(TIME, waves() + np.random.default_rng(seed).normal(0.0, 0.02, (3, TIME.size))).further
        for seed in range(20, 60)
    ]
    assert sum(map(len, found)) <= 1


def test_phase_refers_to_the_stated_origin() -> None:
    fit = fit_back_emf(TIME, waves())
    expected = np.exp(1j * (2 * np.pi * 53.0 * fit.time_origin + 0.3 + SHIFT[:, 0]))
    assert fit.amplitudes[:, 0] / 3.0 == pytest.approx(expected)


def test_little_more_than_one_period_and_one_channel_suffice() -> None:
    fit = fit_back_emf(TIME, waves(11.5)[0], harmonics=(1, 5))
    assert fit.frequency == pytest.approx(11.5, rel=1e-6)


def test_start_value_and_block_averaging_do_not_change_the_result() -> None:
    time = np.arange(60_000) * 0.1 / 60_000
    v = 3.0 * np.cos(2 * np.pi * 53.0 * time) + np.random.default_rng(1).normal(0, 0.05, time.size)
    fit = fit_back_emf(time, v, frequency=54.0)
    assert fit.frequency == pytest.approx(53.0, abs=4 * fit.frequency_uncertainty)
    assert fit.fundamental()[0] == pytest.approx(3.0, abs=4 * fit.fundamental()[1])
    assert fit.fundamental()[1] == pytest.approx(0.05 * np.sqrt(2 / time.size), rel=0.2)
    assert fit.residuals.shape == (1, 60_000)
    assert fit.residual_rms[0] == pytest.approx(0.05, rel=0.02)


def test_drift_is_found_with_its_size_and_the_flux_does_not_depend_on_it() -> None:
    time, v = emf_record(np.random.default_rng(2), drift=0.1)
    fit = fit_back_emf(time, v)
    assert fit.drift_significant
    assert fit.drift == pytest.approx(0.1, abs=4 * fit.drift_uncertainty)
    flux = flux_by_integration(time, v)
    value, uncertainty = flux.mean()
    assert value == pytest.approx(FLUX, abs=4 * uncertainty)
    assert uncertainty < 2e-3 * FLUX
    assert flux.period_frequencies == pytest.approx(SPEED / (2 * np.pi) * np.linspace(0.96, 1.04, 5), rel=0.02)


def test_flux_survives_a_speed_that_halves() -> None:
    time, v = emf_record(np.random.default_rng(3), drift=-0.6)
    value, uncertainty = flux_by_integration(time, v).mean()
    assert value == pytest.approx(FLUX, abs=5 * uncertainty)


def test_steady_speed_is_not_called_drifting() -> None:
    assert sum(fit_back_emf(*emf_record(np.random.default_rng(s))).drift_significant for s in range(20)) <= 1


def test_plain_readings_of_the_note() -> None:
    v = waves(fifth=0.0)[0]
    assert peak_to_peak(v) == pytest.approx(6.0, rel=1e-3)
    assert peak_amplitude(v) == pytest.approx(3.0, rel=1e-3)


@pytest.mark.parametrize(
    ("time", "values", "message"),
    [
        (TIME, np.ones(2000), "channel 1 is constant"),
        (TIME, np.where(np.arange(2000) == 5, np.nan, waves()[0]), "not numbers"),
        (np.delete(TIME, 900), np.delete(waves()[0], 900), "not evenly spaced"),
        (TIME, np.sin(2 * np.pi * 6.0 * TIME), "no whole period"),
        (TIME, np.random.default_rng(1).normal(0, 1, 2000), "nothing periodic|does not converge"),
        (TIME[:10], waves()[0][:10], "at least 16"),
    ],
)
def test_records_that_carry_no_estimate_are_refused(time, values, message) -> None:
    with pytest.raises(EstimationError, match=message):
        fit_back_emf(time, values)
    with pytest.raises(EstimationError, match=message):
        flux_by_integration(time, values)


def test_harmonics_must_include_the_fundamental() -> None:
    with pytest.raises(EstimationError, match="include 1"):
        fit_back_emf(TIME, waves(), harmonics=(3, 5))
