"""A file written faster than the converter samples: the repeats are told and left out, and the figures hold the truth."""

import numpy as np
import pytest

from procedures.core.misfit_text import sentence
from procedures.estimation.emf.back_emf import fit_back_emf
from procedures.estimation.emf.integrated_flux import flux_by_integration
from procedures.estimation.emf.record import DigitizedChannel
from procedures.estimation.fitting.fit import FloatArray, coverage_interval
from procedures.estimation.fitting.misfit import Answer, Cause, Misfit
from procedures.estimation.fitting.repeated_rows import repeated_rows
from procedures.estimation.winding.current_step.response import fit_step_response
from tests.studies.worlds.shaft_records import fit_coast_down

CODE, TAU, FLUX, FREQUENCY = 1.0 / 200.0, 4e-4, 0.02, 100.0


def held(rows: FloatArray, every: float, late: float = 0.3) -> FloatArray:
    """Return channels (…, m) as a program writes them that puts a row so many times for each reading."""
    return rows[..., np.floor(np.arange(int((rows.shape[-1] - 1) * every)) / every + late).astype(int)]


def read(values: FloatArray, seed: int, noise: float = 0.5) -> FloatArray:
    noisy = values + noise * CODE * np.random.default_rng(seed).standard_normal(values.shape)
    return np.asarray(np.round(noisy / CODE) * CODE)


def rows_told(misfit: Misfit) -> float:
    """Return how many rows a reading has, as the record's misfit tells."""
    told = [f for f in misfit.findings if f.cause is Cause.REPEATED_ROWS]
    assert len(told) == 1
    assert told[0].answer is Answer.MODELLED
    assert "Export at the converter's own rate" in sentence(told[0]).render()
    return float(told[0].figures["every"])


def step_channels(seed: int, count: int = 500) -> FloatArray:
    time = 1e-5 * (np.arange(count) - 0.2 * count - 0.4)
    return read(np.array(((time > 0.0) * 1.0, -np.expm1(-np.maximum(time, 0.0) / TAU))), seed)


@pytest.mark.parametrize("every", [2.0, 2.5, 4.0])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_step(every: float, seed: int) -> None:
    rows = held(step_channels(seed), every)
    fit = fit_step_response(
        1e-5 / every * np.arange(rows.shape[1]), *rows, voltage_resolution=CODE, current_resolution=CODE
    )
    assert rows_told(fit.misfit) == pytest.approx(every, rel=1e-3)
    late = fit.timing * TAU / np.sqrt(3.0)
    assert fit.value("inductance") == pytest.approx(TAU, abs=2.0 * np.hypot(fit.uncertainty("inductance"), late))
    assert fit.value("resistance") == pytest.approx(1.0, abs=2.5 * fit.uncertainty("resistance"))
    assert fit.residuals.size == rows.shape[1]
    assert fit.step == pytest.approx(1e-5, rel=1e-3)


def test_one_channel_of_a_step() -> None:
    rows = step_channels(1)
    rows[1] = rows[1, np.arange(500) // 2 * 2]
    fit = fit_step_response(1e-5 * np.arange(500), *rows, voltage_resolution=CODE, current_resolution=CODE)
    assert rows_told(fit.misfit) == 2.0
    late = fit.timing * TAU / np.sqrt(3.0)
    assert fit.value("inductance") == pytest.approx(TAU, abs=2.0 * np.hypot(fit.uncertainty("inductance"), late))


@pytest.mark.parametrize("every", [2.0, 3.5, 8.0])
def test_a_back_emf(every: float) -> None:
    turned = 2.0 * np.pi * FREQUENCY * 2e-4 * np.arange(600)
    lines = turned - 2.0 * np.pi / 3.0 * np.arange(3)[:, None] + 0.4
    rows = held(read(np.sin(lines) + 0.03 * np.sin(5.0 * lines), 5), every)
    time, told = 2e-4 / every * np.arange(rows.shape[1]), [DigitizedChannel(f"CH{k}", CODE, None) for k in range(3)]
    fit = fit_back_emf(time, rows, digitized=told)
    assert fit.residuals.shape == rows.shape
    for each in (fit, flux_by_integration(time, rows, digitized=told)):
        assert rows_told(each.misfit) == pytest.approx(every, rel=1e-3)
        flux = each.flux_linkage
        low, high = coverage_interval(flux.value, flux.uncertainty, flux.degrees_of_freedom)
        assert low < 1.0 / (2.0 * np.pi * FREQUENCY) < high


@pytest.mark.parametrize("every", [2.0, 5.0])
def test_a_coast_down(every: float) -> None:
    rate, floor, time = 0.3, 20.0, 0.02 * np.arange(400)
    speed = (100.0 + floor / rate) * np.exp(-rate * time) - floor / rate
    noisy = speed + 0.05 * np.random.default_rng(5).standard_normal(speed.size)
    rows = held(np.round(noisy[speed > 5.0], 2), every)
    fit = fit_coast_down(0.02 / every * np.arange(rows.size), rows, speed_resolution=0.01)
    assert rows_told(fit.misfit) == every
    for name, truth in (("coulomb_deceleration", floor), ("viscous_rate", rate)):
        low, high = fit.interval(name)
        assert low < truth < high


def test_readings_of_their_own_are_no_repeats() -> None:
    random = np.random.default_rng(6)
    for number in range(300):
        count = int(np.exp(random.uniform(np.log(60), np.log(5000))))
        place = np.arange(count) / count
        shape = (
            np.sin(2.0 * np.pi * random.uniform(2.0, 30.0) * place + 1.0),
            -np.expm1(-np.maximum(place - 0.2, 0.0) / random.uniform(0.02, 0.2)),
            1.0 - place,
        )[number % 3]
        noise = random.choice([0.0, 1.0]) * 10.0 ** random.uniform(-3.0, 1.0)
        assert repeated_rows([np.round(shape * 10.0 ** random.uniform(0.5, 4.0) + noise * random.normal(0, 1, count))]) is None  # fmt: skip


@pytest.mark.parametrize(
    "values",
    [
        np.round(100.0 - 0.05 * np.arange(1500), 1),
        np.sign(np.sin(2.0 * np.pi * (np.arange(2000) + 0.5) / 20.0)),
        np.repeat([1.0, 2.0, 1.5, 0.3], 5).repeat(3)[np.arange(3000) % 60],
    ],
    ids=["a straight line that was rounded", "a square wave", "levels that come again"],
)
def test_computed_readings_are_no_repeats(values: FloatArray) -> None:
    assert repeated_rows([values]) is None


def test_the_slowest_channel_counts_and_the_others_are_least_late() -> None:
    readings = np.random.default_rng(7).normal(0.0, 1.0, (3, 900))
    rows = readings[:, np.arange(900)]
    rows[1] = readings[1, np.arange(900) // 2 * 2]
    rows[2] = readings[2, np.maximum(np.arange(900) - 1, 0) // 4 * 4 + 1]
    found = repeated_rows(list(rows))
    assert found is not None
    assert (found.every, found.first) == (4.0, 1.0)
    assert np.all(rows[2, found.new] == readings[2, found.new])
    values = np.arange(found.new.size)
    assert np.array_equal(found.over_all(values)[found.new], values)
