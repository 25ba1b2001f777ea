import numpy as np
import pytest

from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.fitting.smoothing import smooth
from procedures.estimation.winding.current_step.first_look import look_at_step
from procedures.estimation.winding.current_step.response import fit_step_response, time_constant_63
from tests.procedures.estimation.responses import respond
from tests.studies.worlds.simulated import TAU, L, R, V, step_record

TIME = np.arange(-200, 1200) * TAU / 200


def exact(drive: np.ndarray) -> np.ndarray:
    return respond(TIME, drive / L, R / L)


def test_exact_data_give_exact_parameters_also_with_an_overshooting_supply() -> None:
    after = np.maximum(TIME, 0)
    v = V * (1 - np.exp(-after / (0.1 * TAU)) * np.cos(2 * np.pi * after / (0.3 * TAU)))
    fit = fit_step_response(TIME, v, exact(v))
    assert fit.value("resistance") == pytest.approx(R, rel=1e-6)
    assert fit.value("inductance") == pytest.approx(L, rel=1e-6)
    assert fit.names[:3] == ("resistance", "inductance", "offset")


def test_source_resistance_and_probe_offsets_do_not_enter() -> None:
    emf, source = np.where(TIME > 0, V, 0.0), 0.1 * R
    i = respond(TIME, emf / L, (R + source) / L)
    fit = fit_step_response(TIME, emf - source * i + 0.05, i - 0.7)
    assert fit.value("inductance") == pytest.approx(L, rel=2e-3)
    assert fit.value("resistance") == pytest.approx(R, rel=2e-3)
    assert fit.value("offset") == pytest.approx(-0.7, abs=1e-3)
    assert fit.value("voltage_offset") == pytest.approx(0.05, abs=1e-6)


def test_negative_steps_are_steps() -> None:
    v = -np.clip(TIME / (0.2 * TAU), 0, 1)
    assert fit_step_response(TIME, v, exact(v)).value("inductance") == pytest.approx(L, rel=1e-6)


def test_ripple_all_along_the_record_is_taken_as_sampled() -> None:
    random = np.random.default_rng(4)
    v = np.where(TIME > 0, 1 + 0.3 * np.sin(TIME * 60 / TAU), 0.0)
    i = exact(v) + random.normal(0, 0.02, TIME.size)
    noisy = v + random.normal(0, 0.002, TIME.size)
    assert smooth(noisy[200:], 0.002) is None
    fit = fit_step_response(TIME, noisy, i)
    assert abs(fit.value("inductance") - L) < 4 * fit.uncertainty("inductance")
    assert fit.uncertainty("inductance") < 0.01 * L


@pytest.mark.slow
def test_levels_before_and_after_the_step_are_each_rounded_where_noise_is_small() -> None:
    time = np.arange(-800, 5200) * 8.0 / 5200.0
    truth = np.where(time > 0, 1.0, 0.0), np.where(time > 0, 1.0 - np.exp(-np.maximum(time, 0.0)), 0.0)
    off = []
    for number in range(50):
        random = np.random.default_rng(number)
        steps = 1.0 / random.uniform(100.0, 220.0, 2)
        noisy = [
            x / q + random.normal(0.0, 0.3, x.size) + random.uniform(-0.5, 0.5)
            for x, q in zip(truth, steps, strict=True)
        ]
        v, i = (np.round(x) * q for x, q in zip(noisy, steps, strict=True))
        fit = fit_step_response(time, v, i, voltage_resolution=steps[0], current_resolution=steps[1])
        off.append((fit.value("resistance") - 1.0) / fit.uncertainty("resistance"))
    assert np.std(off) < 1.1


def test_rounding_that_noise_does_not_hide_is_in_the_uncertainty() -> None:
    v = np.clip(TIME / (0.2 * TAU), 0, 1)
    step = V / R / 100
    i = np.round(exact(v) / step) * step
    fit = fit_step_response(TIME, v, i, current_resolution=step)
    assert abs(fit.value("resistance") - R) < 3 * fit.uncertainty("resistance")
    assert fit.uncertainty("resistance") > 1e-3 * R


def test_time_constant_as_the_note_reads_it() -> None:
    v = np.where(TIME > 0, V, 0.0)
    assert time_constant_63(TIME, exact(v)) == pytest.approx(TAU, rel=0.03)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda t, v, i: (t, v, np.where(np.arange(t.size) == 700, np.nan, i)),
            "current holds 1 values that are not numbers",
        ),
        (lambda t, v, i: (np.delete(t, 700), np.delete(v, 700), np.delete(i, 700)), "not evenly spaced"),
        (lambda t, v, i: (t, v, np.zeros_like(i)), "the current shows no step"),
        (lambda t, v, i: (t, v, -i), "reverse the current probe"),
        (lambda t, v, i: (t[:10], v[:10], i[:10]), "at least 20"),
        (lambda t, v, i: (t[:320], v[:320], i[:320]), "record at least three"),
        (lambda t, v, i: (t, v[:-1], i), "differ in length"),
        (lambda t, v, i: (t, np.zeros_like(v), i), "the voltage shows no step"),
        (lambda t, v, i: (t, v, v + 0 * i), "sample faster"),
    ],
)
def test_records_that_carry_no_estimate_are_refused(change, message) -> None:
    v = np.clip(TIME / (0.05 * TAU), 0, 1)
    with pytest.raises(EstimationError, match=message):
        fit_step_response(*change(TIME, v, exact(v)))


def test_time_constant_needs_a_step() -> None:
    with pytest.raises(EstimationError, match="no step"):
        time_constant_63(TIME, np.ones_like(TIME))
    spike = exact(np.where(TIME > 0, V, 0.0))
    spike[0] = spike[-1]
    with pytest.raises(EstimationError, match="first sample"):
        time_constant_63(TIME, spike)


def test_uneven_sampling_is_solved_exactly() -> None:
    time = np.cumsum(np.random.default_rng(2).uniform(0.01, 0.1, 500))
    assert respond(time, np.full(500, 3.0), 2.0, 5.0) == pytest.approx(1.5 + 3.5 * np.exp(-2.0 * (time - time[0])))
    assert respond(time, time, 0.0) == pytest.approx((time**2 - time[0] ** 2) / 2)


def test_a_record_of_eight_bits_is_fitted_within_its_uncertainty() -> None:
    time, v, i, v_step, i_step = step_record(np.random.default_rng(8), 8, points=20000)
    fit = fit_step_response(time, v, i, voltage_resolution=v_step, current_resolution=i_step)
    assert abs(fit.value("inductance") / L - 1) < 4 * fit.uncertainty("inductance") / L < 4e-3


def test_63_percent_are_read_through_noise_as_an_eye_does() -> None:
    random = np.random.default_rng(5)
    time = np.arange(-3000, 7000) * 6e-4 * TAU
    i = respond(time, np.where(time > 0, V, 0.0) / L, R / L)
    noisy = i + random.normal(0, 0.07 * V / R, i.size)
    assert time_constant_63(time, noisy) == pytest.approx(TAU, rel=0.15)


@pytest.mark.parametrize("ramp", [0.0, 0.5, 5.0])
@pytest.mark.parametrize("window", [2.0, 9.0, 60.0])
@pytest.mark.parametrize("noise", [0.001, 0.07])
def test_a_first_look_finds_the_time_constant_through_noise(ramp: float, window: float, noise: float) -> None:
    random = np.random.default_rng(6)
    time = np.linspace(-0.3, 0.7, 10_000) * (window + ramp) * TAU
    v = np.clip(time / (ramp * TAU), 0, 1) if ramp else np.where(time > 0, V, 0.0)
    i = respond(time, v / L, R / L)
    seen = look_at_step(
        time, v + random.normal(0, noise * V, v.size) + 0.1, i + random.normal(0, noise * V / R, i.size) - 0.3
    )
    assert seen.time_constant == pytest.approx(TAU, rel=0.25)
    assert seen.begin == pytest.approx(0.0, abs=0.15 * ramp * TAU + 0.01 * (window + ramp) * TAU)
    assert seen.end == pytest.approx(0.9 * ramp * TAU, abs=0.1 * ramp * TAU + 0.01 * (window + ramp) * TAU)


def test_a_first_look_at_far_too_long_a_record_says_so() -> None:
    time = np.linspace(-0.3, 0.7, 10_000) * 5000 * TAU
    v = np.where(time > 0, V, 0.0)
    assert look_at_step(time, v, respond(time, v / L, R / L)).time_constant < 20 * TAU


@pytest.mark.parametrize(("dead", "said"), [(0, "the voltage shows no step"), (1, "the current shows no step")])
def test_a_first_look_wants_a_step(dead: int, said: str) -> None:
    random = np.random.default_rng(7)
    v = np.where(TIME > 0, V, 0.0)
    signals = [v, exact(v)]
    signals[dead] = np.zeros_like(v)
    with pytest.raises(EstimationError, match=said):
        look_at_step(TIME, *(x + random.normal(0, 0.01, v.size) for x in signals))


@pytest.mark.parametrize("ramp", [0, 35, 200])
def test_a_step_that_single_samples_hardly_show(ramp: int) -> None:
    # 10 mV through noise of 1.5 mV: where the voltage begins to rise is known to some dozen samples only.
    z = []
    for seed in range(12):
        random = np.random.default_rng([7, seed])
        time = (np.arange(4000) - 1200 + random.uniform()) * 4e-3 * TAU
        v = np.clip(time / (ramp * 4e-3 * TAU), 0, 1) if ramp else np.where(time > 0, V, 0.0)
        i = respond(time, v / L, R / L) + random.normal(-0.5, V / R / 120, time.size)
        fit = fit_step_response(time, v + random.normal(0.07, V / 6.6, time.size), i)
        z.append((fit.value("inductance") - L) / fit.uncertainty("inductance"))
    assert np.sqrt(np.mean(np.square(z))) < 1.7
    assert abs(np.mean(z)) < 1.2
