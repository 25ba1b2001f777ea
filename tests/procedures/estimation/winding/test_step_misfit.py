"""Disturbed current steps, integrated without the estimator's model: what is said of them, and that intervals hold the truth."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from procedures.core.misfit_text import sentence
from procedures.estimation.fitting.fit import EstimationError, WithheldError
from procedures.estimation.fitting.misfit import Answer, Cause
from procedures.estimation.winding.current_step.codes import clipped_at, too_coarse
from procedures.estimation.winding.current_step.repeats import StepReading, fit_repeats
from procedures.estimation.winding.current_step.response import StepFit, fit_step_response
from procedures.estimation.winding.current_step.ringing import RingingEdge
from tests.studies.worlds.disturbed_steps import Batch, Sampled, row, sampled


def fitted(record: Sampled) -> StepFit:
    return fit_step_response(
        record.time,
        record.voltage,
        record.current,
        voltage_resolution=record.voltage_step,
        current_resolution=record.current_step,
        voltage_ends=record.voltage_ends,
        current_ends=record.current_ends,
    )


def alike(count: int = 3, seed: int = 1) -> Batch:
    """Batch of like circuits: τ = 5 ms, a sharp step."""
    batch = Batch(count, np.random.default_rng(seed), points=1500, fine=4)
    batch.tau[:], batch.window[:], batch.rise[:], batch.source[:] = 5e-3, 7.0, 0.0, 0.05
    return batch


def with_(name: str, value: float) -> Batch:
    batch = alike()
    getattr(batch, name)[:] = value
    return batch


def off(fit: StepFit, record: Sampled, name: str) -> float:
    """Error in standard uncertainties, that of half a sampling interval between the channels with it."""
    truth = record.inductance if name == "inductance" else record.resistance
    timing = fit.timing * truth / np.sqrt(3.0) if name == "inductance" else 0.0
    return abs(fit.value(name) - truth) / float(np.hypot(fit.uncertainty(name), timing))


@pytest.mark.parametrize(
    ("name", "value", "cause"),
    [
        ("skew", 0.02, Cause.SKEW),
        ("pole", 0.1, Cause.BANDWIDTH),
        ("knee", 1.5, Cause.SATURATION),
        ("corner", 0.1, Cause.AC_COUPLED),
        pytest.param("corner", 0.15, Cause.AC_COUPLED, marks=pytest.mark.slow),
        ("voltage_corner", 0.1, Cause.AC_COUPLED),
        pytest.param("voltage_corner", 0.02, Cause.AC_COUPLED, marks=pytest.mark.slow),
        ("hum", 0.02, Cause.HUM),
        pytest.param("voltage_hum", 0.02, Cause.HUM, marks=pytest.mark.slow),
        ("slope", 0.02, Cause.SLOPE),
        ("odd", 0.02, Cause.RINGING),
        ("resonance", 20.0, Cause.RINGING),
    ],
)
def test_a_gross_disturbance_is_named_modelled_and_its_interval_holds(name: str, value: float, cause: Cause) -> None:
    # `python -m tests.studies.step_misfit` has hundreds of each.
    for record in sampled(with_(name, value), bits=12, noise=(0.5, 2.0))[:2]:
        fit = fitted(record)
        assert cause in {f.cause for f in fit.misfit.findings if f.answer is Answer.MODELLED}
        assert all(sentence(f).render() for f in fit.misfit.findings)
        for estimate in ("resistance", "inductance"):
            assert off(fit, record, estimate) < 4.0


@pytest.mark.parametrize(
    "law",
    [
        lambda i: 1.5 * np.tanh(i / 1.5),
        pytest.param(lambda i: i - 0.1 * i**3, marks=pytest.mark.slow),
        pytest.param(lambda i: i / (1.0 + 0.1 * i**2), marks=pytest.mark.slow),
        pytest.param(lambda i: i / (1.0 + np.abs(0.85 * i) ** 6) ** (1.0 / 6.0), marks=pytest.mark.slow),
    ],
)
def test_a_current_probe_near_saturation_leaves_the_resistance_within_its_interval(law) -> None:
    for record in sampled(alike(), bits=12, noise=(0.5, 2.0))[:2]:
        step = record.current_step
        bent = replace(record, current=np.round(law(record.current) / step) * step)
        fit = fitted(bent)
        if fit.misfit.withholding("resistance") is not None:
            continue
        told = [f for f in fit.misfit.findings if f.cause is Cause.DISTORTION]
        assert all("probe" in sentence(f).render() for f in told)
        assert told
        for estimate in ("resistance", "inductance"):
            assert off(fit, bent, estimate) < 3.0


@pytest.mark.parametrize("on_current", [0.0, 0.03])
def test_hum_on_the_voltage_is_told_in_a_record_shorter_than_its_period(on_current: float) -> None:
    batch = alike(8, seed=3)
    batch.tau[:], batch.window[:], batch.hum[:], batch.voltage_hum[:] = 1.5e-3, 8.0, on_current, 0.03
    for record in sampled(batch, bits=8, noise=(0.5, 1.0)):
        fit = fitted(record)
        (hum,) = (f for f in fit.misfit.findings if f.cause is Cause.HUM)
        assert hum.figures["voltage"] == pytest.approx(0.03, rel=0.5)
        assert "on the voltage" in sentence(hum).render()
        for estimate in ("resistance", "inductance"):
            assert off(fit, record, estimate) < 4.0


def test_hum_that_a_short_record_leaves_open_gives_no_resistance() -> None:
    batch = alike(6, seed=4)
    batch.tau[:], batch.window[:], batch.voltage_hum[:] = 1e-3, 2.0, 0.3
    withheld = 0
    for record in sampled(batch, bits=8, noise=(1.0, 2.0)):
        fit = fitted(record)
        if cause := fit.misfit.withholding("resistance"):
            withheld += 1
            assert cause.cause is Cause.HUM
            assert not any(f.answer is Answer.MODELLED and f.concerns("resistance") for f in fit.misfit.findings)
        else:
            assert off(fit, record, "resistance") < 4.0
    assert withheld


def test_eddy_currents_are_a_second_time_constant() -> None:
    batch = alike()
    batch.coupling[:], batch.closed[:] = 0.4, 5.0
    for record in sampled(batch, bits=12, noise=(0.5, 2.0)):
        fit = fitted(record)
        assert Cause.SECOND_TIME_CONSTANT in {f.cause for f in fit.misfit.findings}
        assert off(fit, record, "inductance") < 4.0


@pytest.mark.parametrize(
    ("share", "time"),
    [pytest.param(0.1, 0.3, marks=pytest.mark.slow), (-0.1, 0.3), pytest.param(-0.1, 2.0, marks=pytest.mark.slow)],
)
def test_a_divider_that_is_badly_compensated_is_named_and_held(share: float, time: float) -> None:
    # What a second circuit can do as well is within the interval.
    batch = with_("divider", share)
    batch.divider_time[:] = time
    for record in sampled(batch, bits=12, noise=(0.5, 2.0)):
        fit = fitted(record)
        assert Cause.COMPENSATION in {f.cause for f in fit.misfit.findings}
        assert off(fit, record, "inductance") < 3.0


def test_saturation_offers_the_smaller_step() -> None:
    (record, *_) = sampled(with_("knee", 1.5), bits=12, noise=(0.5, 2.0))
    (found,) = (f for f in fitted(record).misfit.findings if f.cause is Cause.SATURATION)
    # L(i) = L₀/(1 + (i/1.5)²) of a step of 1 A.
    assert found.figures["share"] == pytest.approx(1.0 / (1.0 + 1.0 / 1.5**2), rel=0.05)
    assert found.figures["smaller"] == pytest.approx(0.15, rel=0.2)
    assert "zero current" in sentence(found).render()


@pytest.mark.parametrize(
    ("knee", "magnets"),
    [
        (1.8, -0.3),
        pytest.param(2.5, -0.3, marks=pytest.mark.slow),
        pytest.param(2.0, 0.5, marks=pytest.mark.slow),
        pytest.param(3.0, -0.9, marks=pytest.mark.slow),
    ],
)
def test_iron_that_the_magnets_fill_is_no_second_circuit(knee: float, magnets: float) -> None:
    # Against the magnets the inductance rises first, and may fall again: no law of one figure is of that shape.
    batch = with_("knee", knee)
    batch.magnets[:] = magnets
    for record in sampled(batch, bits=12, noise=(0.5, 2.0)):
        fit = fitted(record)
        assert Cause.SATURATION in {f.cause for f in fit.misfit.findings}
        assert off(fit, record, "inductance") < 3.0


def test_the_corner_of_a_coupling_is_named() -> None:
    (record, *_) = sampled(with_("corner", 0.1), bits=12, noise=(0.5, 2.0))
    (found,) = (f for f in fitted(record).misfit.findings if f.cause is Cause.AC_COUPLED)
    assert found.figures["corner"] == pytest.approx(0.1 / (2 * np.pi * 5e-3), rel=0.05)
    assert found.figures["channel"] == "current"


@pytest.mark.parametrize(
    ("share", "samples"),
    [(0.8, 1250), (0.7, 5000), (0.8, 5000), (0.9, 5000)],
)
def test_a_top_that_an_amplifier_cuts_ahead_of_its_noise_is_left_out(share: float, samples: int) -> None:
    random, time = np.random.default_rng(5), np.arange(samples) * (0.01 / samples)
    full = -10.0 * np.expm1(-np.maximum(time - 0.0016, 0.0) / 1e-3)
    voltage = np.where(time > 0.0016, 2.0, 0.0) + random.normal(0.0, 0.008, time.size)
    current = np.minimum(full, 10.0 * share) + random.normal(0.0, 0.04, time.size)
    fit = fit_step_response(time, voltage, current)
    assert fit.misfit.findings[0].cause is Cause.CLIPPED
    assert abs(fit.value("resistance") - 0.2) < 3.0 * fit.uncertainty("resistance")
    assert abs(fit.value("inductance") - 2e-4) < 3.0 * fit.uncertainty("inductance") + fit.timing * 2e-4


def test_the_third_harmonic_of_hum_is_modelled() -> None:
    for mains in (50.0, 60.0):
        random, time = np.random.default_rng(7), np.arange(5000) * 2e-6
        full = -10.0 * np.expm1(-np.maximum(time - 0.0016, 0.0) / 1e-3)
        voltage = np.where(time > 0.0016, 2.0, 0.0) + random.normal(0.0, 0.008, time.size)
        hum = 0.2 * np.sin(2.0 * np.pi * 3.0 * mains * time + 1.0)
        fit = fit_step_response(time, voltage, full + hum + random.normal(0.0, 0.04, time.size))
        (finding,) = (f for f in fit.misfit.findings if f.answer is Answer.MODELLED)
        assert (finding.cause, finding.figures["frequency"]) == (Cause.HUM, 3.0 * mains)
        assert abs(fit.value("resistance") - 0.2) < 3.0 * fit.uncertainty("resistance")


def turning(inertia: float, seed: int) -> StepFit:
    """Fit the step of a winding of 0.15 Ω and 0.2 mH whose rotor (0.02 V·s) turns on its inertia (kg·m²)."""
    count, before, fine, dt = 3000, 400, 10, 3e-6
    current, speed, flowing = 0.0, 0.0, np.zeros(count)
    for k in range(before, count):
        flowing[k] = current
        for _ in range(fine):
            current += (2.0 - 0.15 * current - 0.02 * speed) / 2e-4 * dt / fine
            speed += 0.02 * current / inertia * dt / fine
    random = np.random.default_rng(seed)
    voltage = np.where(np.arange(count) >= before, 2.0, 0.0)
    return fit_step_response(
        np.arange(count) * dt,
        voltage + random.normal(0.0, 0.01, count),
        flowing + random.normal(0.0, 0.04, count),
    )


@pytest.mark.parametrize("inertia", [2e-5, 6e-5, 2e-4])
def test_a_rotor_that_turns_is_held_or_withheld_and_told_of(inertia: float) -> None:
    fit = turning(inertia, 3)
    assert Cause.AC_COUPLED in {f.cause for f in fit.misfit.findings}
    for name, truth in (("resistance", 0.15), ("inductance", 2e-4)):
        if fit.misfit.withholding(name) is None:
            reach = 2.0 * np.hypot(fit.uncertainty(name), fit.timing * truth * (name == "inductance"))
            assert abs(fit.value(name) - truth) < reach, name


def test_an_ac_coupled_current_leaves_the_resistance_within_its_interval() -> None:
    """A rotor that turns would make the same record: the truth is at one end of what both span."""
    for record in sampled(with_("corner", 0.1), bits=12, noise=(0.5, 2.0)):
        fit = fitted(record)
        if fit.misfit.withholding("resistance") is None:
            assert abs(fit.value("resistance") - record.resistance) < 1.96 * fit.uncertainty("resistance")


@pytest.mark.parametrize("corner", [1.0, 3.0, 10.0])
def test_a_current_that_dies_away_under_a_lasting_voltage_is_ac_coupled(corner: float) -> None:
    for record in sampled(with_("corner", corner), bits=12, noise=(0.5, 2.0)):
        try:
            found = fitted(record).misfit
        except WithheldError as error:
            found = error.misfit
        assert Cause.AC_COUPLED in {f.cause for f in found.findings}
        assert all(sentence(f).render() for f in found.findings)


@pytest.mark.parametrize("corner", [pytest.param(0.1, marks=pytest.mark.slow), 0.5, 1.0, 3.0])
def test_a_voltage_that_is_ac_coupled_is_put_right_or_withheld(corner: float) -> None:
    for record in sampled(with_("voltage_corner", corner), bits=12, noise=(0.5, 2.0)):
        try:
            found = fitted(record).misfit
        except WithheldError as error:
            found = error.misfit
        (coupling,) = (f for f in found.findings if f.cause is Cause.AC_COUPLED)
        assert coupling.figures["channel"] == "voltage"
        assert coupling.figures["corner"] == pytest.approx(corner / (2 * np.pi * 5e-3), rel=0.5)


def test_a_reversed_probe_is_not_called_ac_coupled() -> None:
    (record, *_) = sampled(alike(), bits=12)
    with pytest.raises(EstimationError, match="reverse the current probe") as told:
        fit_step_response(record.time, record.voltage, -record.current)
    assert not isinstance(told.value, WithheldError)


def test_clean_records_are_not_accused() -> None:
    warned = [bool(fitted(record).misfit) for record in sampled(row("clean", 40, 5))]
    assert sum(warned) <= 3


@pytest.mark.slow
def test_noise_that_is_left_in_a_smoothed_voltage_is_no_ringing() -> None:
    """What of it lasts for some time constants drives a current: residuals of such records are not white."""
    batch = row("clean", 40, 6)
    batch.voltage_noise[:] = 0.1
    records = sampled(batch, bits=12)
    fits = [fitted(record) for record in records]
    assert sum(bool(fit.misfit) for fit in fits) <= 1
    assert np.mean([off(*each, "inductance") <= 2.0 for each in zip(fits, records, strict=True)]) >= 0.9


def test_a_supply_that_rises_within_a_few_samples_is_no_other_cause() -> None:
    # v = 1 − exp(−t/a) drives i = 1 − (τ·exp(−t/τ) − a·exp(−t/a))/(τ − a) through 1 Ω; samples fall anywhere within the rise.
    tau, code, accused = 260.0, 1.0 / 3277.0, []
    for seed in range(12):
        random = np.random.default_rng(seed)
        rise, time = random.uniform(2.0, 4.0), np.arange(2000.0) - 400.0 + random.uniform()
        since = np.maximum(time, 0.0)
        current = 1.0 - (tau * np.exp(-since / tau) - rise * np.exp(-since / rise)) / (tau - rise)
        clean = np.array([-np.expm1(-since / rise), current])
        read = np.round(clean / code + 0.4 * random.standard_normal(clean.shape)) * code
        fit = fit_step_response(time, *read, voltage_resolution=code, current_resolution=code)
        accused += fit.misfit.findings
        assert abs(fit.value("inductance") - tau) < 4.0 * fit.uncertainty("inductance")
    assert accused == []


@pytest.mark.parametrize(("lost", "begin", "sag"), [(4, 560, 0.0), (60, 560, 0.0), (60, 430, 0.2)])
def test_samples_that_are_missing_are_counted_and_put_right(lost: int, begin: int, sag: float) -> None:
    random = np.random.default_rng(lost)
    time, tau, gone = np.arange(2000.0), 260.0, slice(begin, begin + lost)
    # The source's own resistance makes the voltage sag as the current rises.
    current = -np.expm1(-np.maximum(time - 400.5, 0.0) * (1.0 + sag) / tau)
    voltage = np.where(time > 400.5, 1.0 + sag * (1.0 - current), 0.0)
    read = np.array([voltage, current]) + 3e-4 * random.standard_normal((2, time.size))
    fit = fit_step_response(time[:-lost], *np.delete(read, gone, axis=1))
    (finding,) = fit.misfit.findings
    assert (finding.cause, finding.answer) == (Cause.DROPOUTS, Answer.MODELLED)
    assert abs(float(finding.figures["count"]) - lost) < 1.0
    assert abs(fit.value("inductance") - tau) < 3.0 * fit.uncertainty("inductance")
    assert "samples are missing" in sentence(finding).render()


@settings(max_examples=4, deadline=None)
@given(begin=st.floats(0.0, 3.0), seed=st.integers(0, 50))
def test_a_record_that_begins_with_the_step_or_later_is_withheld(begin: float, seed: int) -> None:
    batch = alike(1, seed)
    batch.begin[:] = max(begin, 1e-9)
    (record,) = sampled(batch, bits=12)
    with pytest.raises(WithheldError, match="no baseline") as told:
        fitted(record)
    assert [f.cause for f in told.value.misfit.findings] == [Cause.NO_BASELINE]


@pytest.mark.parametrize("known", [True, False])
def test_what_is_cut_off_is_left_out(known: bool) -> None:
    batch = with_("cut", 0.9)
    batch.known = known
    for record in sampled(batch, bits=8, noise=(0.5, 1.0)):
        fit = fitted(record)
        assert fit.misfit.findings[0].cause is Cause.CLIPPED
        assert off(fit, record, "inductance") < 4.0


def test_a_record_of_which_half_is_cut_off_gives_no_figure() -> None:
    for record in sampled(with_("cut", 0.45), bits=8, noise=(0.5, 1.0)):
        with pytest.raises(WithheldError, match="cut off"):
            fitted(record)


def test_a_voltage_that_is_cut_off_gives_no_figure() -> None:
    for record in sampled(with_("voltage_cut", 0.9), bits=8, noise=(0.5, 1.0)):
        with pytest.raises(WithheldError, match="voltage is cut off"):
            fitted(record)


def test_a_supply_that_limits_the_current_ends_the_record() -> None:
    for record in sampled(with_("limit", 0.8), bits=12, noise=(0.5, 2.0)):
        fit = fitted(record)
        assert fit.misfit.findings[0].cause is Cause.CLIPPED
        assert off(fit, record, "inductance") < 4.0


@pytest.mark.parametrize(("noise", "said"), [(0.02, True), (0.3, False)])
def test_a_converter_too_coarse_for_its_noise_is_told(noise: float, said: bool) -> None:
    model = 200.0 * -np.expm1(-np.linspace(0.0, 6.0, 2000))
    values = np.round(model + np.random.default_rng(1).normal(0.0, noise, model.size))
    assert too_coarse(values, model, 1.0) is said
    assert not too_coarse(values, model, 0.0)


def test_an_end_of_range_is_not_seen_where_noise_ends_by_itself() -> None:
    random = np.random.default_rng(2)
    values = np.append(random.normal(0.0, 0.7, 500), 100.0 + random.normal(0.0, 0.7, 1500))
    assert clipped_at(np.round(values), 500, 1.0, True) is None
    assert clipped_at(np.minimum(np.round(values), 100.0), 500, 1.0, True) == 100.0
    assert clipped_at(-np.minimum(np.round(values), 100.0), 500, 1.0, False) == -100.0


@pytest.mark.parametrize("noise", [0.35, 0.42, 0.6])
def test_a_top_without_noise_is_cut_where_the_baseline_has_some(noise: float) -> None:
    random = np.random.default_rng(4)
    read = np.round(np.where(np.arange(2500) < 500, 0.3, 180.0) + random.normal(0.0, noise, 2500))
    assert clipped_at(read, 500, 1.0, True) is None
    assert clipped_at(np.minimum(read, 170.0), 500, 1.0, True) == 170.0


def test_what_creeps_is_no_ringing() -> None:
    ring = RingingEdge(turning=5.0, decay=1.0)
    assert ring.possible(np.array([0.01, 0.0, -0.3, 0.3]))
    assert not ring.possible(np.array([0.01, 0.0, -0.9, 0.0]))
    assert not ring.possible(np.array([0.01, 0.0, 0.0, 1.7]))


@pytest.mark.parametrize(("natural", "damping"), [(40.0, 0.3), (90.0, 0.1), (90.0, 0.5)])
def test_a_channel_that_rings_is_one_thing(natural: float, damping: float) -> None:
    batch = alike(1)
    batch.resonance[:], batch.damping[:] = natural, damping
    (record,) = sampled(batch, bits=12, noise=(0.5, 0.5001))
    fit = fitted(record)
    assert [finding.cause for finding in fit.misfit.findings] == [Cause.RINGING]
    assert max(off(fit, record, name) for name in ("resistance", "inductance")) < 3.0
    assert fit.uncertainty("inductance") < 4.0 * fit.plain_uncertainty("inductance")


@pytest.mark.parametrize("phase", np.linspace(0.0, 6.0, 7))
def test_hum_is_not_taken_for_the_end_of_a_range(phase: float) -> None:
    place = np.arange(2000)
    hum = 2.3 * np.sin(2.0 * np.pi * place / 1300.0 + phase)
    noise = np.random.default_rng(3).normal(0.0, 0.45, place.size)
    values = np.round(np.where(place < 500, 0.0, 100.0) + hum + noise)
    assert clipped_at(values, 500, 1.0, True) is None
    assert clipped_at(np.minimum(values, 100.0), 500, 1.0, True) == 100.0


def readings(batch: Batch) -> list[StepReading]:
    return [
        StepReading(r.time, r.voltage, r.current, r.voltage_step, r.current_step)
        for r in sampled(batch, bits=12, noise=(0.5, 0.5001))
    ]


def test_repeats_average_their_noise_and_say_nothing_where_they_agree() -> None:
    repeats = fit_repeats(readings(alike(4)))
    assert not repeats.misfit
    mean = repeats.mean("inductance")
    assert mean.ratio == 0.0
    assert mean.uncertainty < repeats.fits[0].uncertainty("inductance")


def test_repeats_that_contradict_each_other_say_so() -> None:
    steps = readings(alike(4))
    moved = steps[3]._replace(current=np.asarray(steps[3].current) * 1.01)
    repeats = fit_repeats([*steps[:3], moved])
    assert Cause.REPEATS_DIFFER in {f.cause for f in repeats.misfit.findings}
    mean = repeats.mean("resistance")
    assert abs(mean.value - 1.0) < 3.0 * mean.uncertainty


@pytest.mark.slow
def test_what_no_single_record_shows_repeats_show_together() -> None:
    batch = alike(16)
    batch.slope[:] = 1.2e-4
    repeats = fit_repeats(readings(batch))
    assert repeats.misfit
    assert abs(repeats.mean("resistance").value - 1.0) < 3.0 * repeats.mean("resistance").uncertainty
