import numpy as np
import pytest

from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.fitting.misfit import Answer, Cause
from procedures.estimation.fitting.randomness import chance_of_pattern
from procedures.estimation.winding.sweep.rotor_sweep import (
    axis_inductances,
    extremes,
    fit_rotor_sweep,
    motor_class,
    saliency_significant,
)
from procedures.estimation.winding.sweep.timed_sweep import fit_timed_sweep
from tests.studies.worlds.simulated import LD, LQ, READ_NOISE, READINGS, sweep_record

ANGLE = np.linspace(0, 2 * np.pi, 90, endpoint=False)


def readings(course: np.ndarray) -> np.ndarray:
    return LD + LQ - (LQ - LD) * np.cos(course + 0.7)


@pytest.mark.parametrize("given", [{"pole_pairs": 4}, {}])
def test_exact_readings_over_a_known_angle(given: dict[str, float]) -> None:
    fit = fit_rotor_sweep(ANGLE, readings(8 * ANGLE), **given)
    assert fit.values == pytest.approx([LD + LQ, LQ - LD, 0.7])
    axes = axis_inductances(fit, 0.5)
    assert axes.values == pytest.approx([LD, LQ])
    assert saliency_significant(fit) == (True, 0.0)


def test_uncertainty_is_the_textbooks() -> None:
    random = np.random.default_rng(3)
    noisy = readings(8 * ANGLE) + random.normal(0, READ_NOISE, 90)
    axes = axis_inductances(fit_rotor_sweep(ANGLE, noisy, pole_pairs=4), 0.5)
    assert axes.uncertainty("d_axis_inductance") == pytest.approx(READ_NOISE * np.sqrt(3 / (4 * 90)), rel=0.15)


@pytest.mark.parametrize("wobble", [0.0, 0.3])
def test_a_shaft_turned_by_hand_over_one_electrical_turn(wobble: float) -> None:
    at, noisy = sweep_record(np.random.default_rng(5), wobble=wobble, turns=2.1)
    fit = fit_timed_sweep(20 * at, noisy)
    axes = axis_inductances(fit, 0.5)
    assert fit.periods == pytest.approx(2.1, abs=0.15)
    assert abs(axes.value("d_axis_inductance") - LD) < 4 * axes.uncertainty("d_axis_inductance")
    assert abs(axes.value("q_axis_inductance") - LQ) < 4 * axes.uncertainty("q_axis_inductance")


def test_exact_readings_of_a_strongly_wobbling_hand() -> None:
    at = np.linspace(0, 1, 200)
    course = 2 * np.pi * 8 * (at + 0.3 / (3 * np.pi) * np.sin(3 * np.pi * at))
    fit = fit_timed_sweep(at, readings(course))
    assert axis_inductances(fit, 0.5).values == pytest.approx([LD, LQ], rel=1e-3)


def test_without_saliency_both_axes_are_the_mean() -> None:
    _, noisy = sweep_record(np.random.default_rng(6), saliency=0.0)
    fit = fit_rotor_sweep(np.linspace(0, 2 * np.pi, READINGS), noisy, pole_pairs=3)
    significant, p_value = saliency_significant(fit)
    assert not significant
    assert 0.05 < p_value <= 1
    axes = axis_inductances(fit, 0.5)
    assert axes.value("d_axis_inductance") == axes.value("q_axis_inductance") == pytest.approx(0.5 * fit.value("mean"))


def test_class_by_the_notes_rule() -> None:
    assert motor_class(146e-6, 153e-6) == "SPMSM"
    assert motor_class(100e-6, 110.1e-6) == "IPMSM"
    assert extremes([3.0, 1.0, 2.0]) == (1.0, 3.0)
    with pytest.raises(EstimationError, match="swap"):
        motor_class(2.0, 1.0)


def test_sweeps_that_carry_no_estimate_are_refused() -> None:
    with pytest.raises(EstimationError, match="at one angle"):
        fit_rotor_sweep(np.ones(10), np.ones(10))
    with pytest.raises(EstimationError, match="turn the rotor over at least one"):
        fit_rotor_sweep(ANGLE[:5], readings(ANGLE[:5]), pole_pairs=1)
    with pytest.raises(EstimationError, match="less than one period"):
        fit_rotor_sweep(np.linspace(0, 0.01, 10), np.arange(10.0))
    with pytest.raises(EstimationError, match="at least 4"):
        fit_rotor_sweep(ANGLE[:3], readings(ANGLE[:3]))
    with pytest.raises(EstimationError, match="only 1"):
        fit_timed_sweep(np.linspace(0, 1, 100), readings(np.linspace(0, 2.2 * np.pi, 100)))
    with pytest.raises(EstimationError, match="triggers anew"):
        fit_timed_sweep(np.arange(20.0), np.ones(20))
    with pytest.raises(EstimationError, match="not numbers"):
        fit_timed_sweep(np.arange(20.0), np.full(20, np.nan))


def test_a_long_sweep_is_followed_through_every_waver_of_the_hand() -> None:
    time = np.linspace(0.0, 17.5, 160)
    course = 8.0 * np.pi * (time + 0.1 / 4.4 * np.sin(4.4 * time)) / 17.5
    noise = 3e-5 * (LQ - LD)
    values = readings(course + 0.7) + np.random.default_rng(3).normal(0.0, noise, time.size)
    fit = fit_timed_sweep(time, values)
    assert fit.value("mean") == pytest.approx(LD + LQ, abs=4.0 * fit.uncertainty("mean"))
    assert fit.value("amplitude") == pytest.approx(LQ - LD, abs=4.0 * fit.uncertainty("amplitude"))
    assert fit.uncertainty("amplitude") < 3e-4 * (LQ - LD)


def test_residuals_that_hang_together_count_for_fewer_readings() -> None:
    random, time = np.random.default_rng(4), np.linspace(0.0, 10.0, 160)
    white = random.normal(0.0, READ_NOISE, time.size)
    smooth = np.convolve(random.normal(0.0, READ_NOISE, time.size + 8), np.full(9, 1 / 3.0), "valid")
    course = 0.8 * np.pi * time
    scattered, wavering = (fit_timed_sweep(time, readings(course) + left, largest_degree=3) for left in (white, smooth))
    assert wavering.uncertainty("amplitude") > 2.0 * scattered.uncertainty("amplitude")
    assert wavering.degrees_of_freedom < 0.3 * scattered.degrees_of_freedom


def test_an_induced_voltage_of_one_period_a_turn_is_no_saliency() -> None:
    time = np.linspace(0.0, 10.5, 96)
    noise = np.random.default_rng(5).normal(0.0, 2e-5, time.size)
    fit = fit_timed_sweep(time, (LD + LQ) * (1.0 + 1.5e-4 * np.cos(0.9 * time) + noise))
    assert fit.periods == pytest.approx(1.5, abs=0.1)
    assert fit.value("mean") == pytest.approx(LD + LQ, rel=1e-4)
    with pytest.raises(EstimationError, match="periods of the inductance"):
        fit_timed_sweep(time, (LD + LQ) * (1.0 + 0.05 * np.cos(0.9 * time) + noise))


@pytest.mark.parametrize("given", [1, 3, 5])
def test_readings_that_swing_at_another_period_than_the_pole_pairs_say_are_withheld(given: int) -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 96, endpoint=False)
    values = 500e-6 - 100e-6 * np.cos(8.0 * angle + 0.3) + np.random.default_rng(given).normal(0.0, 1e-6, angle.size)
    fit = fit_rotor_sweep(angle, values, pole_pairs=given)
    assert [(f.cause, f.answer) for f in fit.misfit.findings] == [(Cause.WRONG_PERIOD, Answer.WITHHELD)]
    assert not fit_rotor_sweep(angle, values, pole_pairs=4).misfit


def test_few_readings_a_period_tell_it_too() -> None:
    angle = np.deg2rad(np.arange(0.0, 361.0, 10.0))
    values = 500e-6 - 100e-6 * np.cos(8.0 * angle + 0.3) + np.random.default_rng(1).normal(0.0, 1e-6, angle.size)
    assert fit_rotor_sweep(angle, values, pole_pairs=3).misfit.findings[0].cause is Cause.WRONG_PERIOD


def test_a_rotor_without_saliency_is_not_called_wrong() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 96, endpoint=False)
    for seed in range(20):
        values = 500e-6 + np.random.default_rng(seed).normal(0.0, 1e-6, angle.size)
        assert Cause.WRONG_PERIOD not in {f.cause for f in fit_rotor_sweep(angle, values, pole_pairs=4).misfit.findings}


@pytest.mark.parametrize("bend", ["the detent moves the rotor", "the meter warms up in steps"])
def test_what_moves_the_mean_of_a_sweep_is_held(bend: str) -> None:
    angle, held = np.linspace(0.0, 2.0 * np.pi, 72), 0
    for seed in range(20):
        moved = angle + (0.03 / 4) * np.sin(8.0 * angle) if bend.startswith("the detent") else angle
        values = 500e-6 - 100e-6 * np.cos(8.0 * moved + 0.6) + np.random.default_rng(seed).normal(0.0, 3e-7, angle.size)
        if not bend.startswith("the detent"):
            values *= 1.0 + 0.002 * np.floor(angle / 1.4)
        fit = fit_rotor_sweep(angle, values, pole_pairs=4)
        assert bool(fit.misfit) is not bend.startswith("the detent")
        held += abs(fit.value("mean") - 500e-6) < 2.0 * fit.uncertainty("mean")
    assert held >= 18


@pytest.mark.parametrize("factor", [10.0, 0.1, 1.5, -1.0])
@pytest.mark.parametrize("timed", [False, True])
def test_a_wild_reading_is_left_out_and_named(factor: float, timed: bool) -> None:
    random = np.random.default_rng(11)
    at, values = sweep_record(random)
    values[37] *= factor

    fit = fit_timed_sweep(10 * at, values) if timed else fit_rotor_sweep(2 * np.pi * at, values, pole_pairs=4)
    assert fit.left_out == (37,)
    (odd,) = (finding for finding in fit.misfit.findings if finding.cause is Cause.ODD_READING)
    assert odd.figures["number"] == 38.0
    assert odd.figures["read"] == pytest.approx(1e6 * values[37])
    assert odd.figures["expected"] == pytest.approx(1e6 * values[37] / factor, rel=0.03)
    axes = axis_inductances(fit, 0.5)
    assert axes.value("d_axis_inductance") == pytest.approx(LD, rel=0.01)
    assert axes.value("q_axis_inductance") == pytest.approx(LQ, rel=0.01)


@pytest.mark.slow
def test_readings_of_a_clean_sweep_are_all_taken() -> None:
    left = 0
    for seed in range(40):
        at, values = sweep_record(np.random.default_rng([seed, 77]))
        left += len(fit_rotor_sweep(2 * np.pi * at, values).left_out) + len(fit_timed_sweep(10 * at, values).left_out)
    assert left == 0


def test_of_one_pole_pair_the_inductance_is_no_run_out() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    random = np.random.default_rng(5)
    values = readings(2 * angle) + 0.03 * (LQ - LD) * np.cos(angle) + random.normal(0.0, 0.01 * READ_NOISE, 24)
    axes = axis_inductances(fit_rotor_sweep(angle, values), 0.5)
    assert axes.value("q_axis_inductance") == pytest.approx(LQ, rel=0.01)


def test_angles_at_half_periods_tell_no_amplitude() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    with pytest.raises(EstimationError, match="no half or whole period"):
        fit_rotor_sweep(angle, readings(6 * angle), pole_pairs=3)


def test_three_places_a_period_do_not_tell_a_wave_of_the_fourth_order() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 18, endpoint=False)
    wave = 6 * angle + 0.7
    values = LD + LQ - (LQ - LD) * (np.cos(wave) - 0.03 * np.cos(2 * wave))
    axes = axis_inductances(fit_rotor_sweep(angle, values, pole_pairs=3), 0.5)
    for name, truth in (("d_axis_inductance", LD), ("q_axis_inductance", LQ)):
        assert abs(axes.value(name) - truth) < 2.0 * axes.uncertainty(name)


@pytest.mark.parametrize("seed", [3, 4])
def test_the_rotors_voltage_in_the_readings_is_modelled(seed: int) -> None:
    random = np.random.default_rng(seed)
    time = np.linspace(0.0, 20.0, 160)
    course = 2.0 * np.pi * 4.0 * (time / 20.0 + 0.01 * np.sin(0.9 * time + random.uniform(0.0, 6.0)))
    speed = np.gradient(course, time)
    noise = random.normal(0.0, 1e-5 * LQ, time.size)
    values = readings(course) + 5e-4 * LQ * speed / np.mean(speed) * np.cos(0.5 * course) + noise
    fit = fit_timed_sweep(time, values)
    assert fit.value("amplitude") == pytest.approx(LQ - LD, abs=4.0 * fit.uncertainty("amplitude"))
    assert fit.uncertainty("amplitude") < 1e-4 * LQ
    chance = chance_of_pattern(fit.residuals)
    assert chance is not None
    assert chance > 0.01
