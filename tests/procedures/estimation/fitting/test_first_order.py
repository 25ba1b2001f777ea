import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import solve_banded

from procedures.estimation.fitting.first_order import (
    Decay,
    gathered_evenly,
    recursion,
    respond_evenly,
    response_and_slope_evenly,
    weights,
)
from tests.procedures.estimation.responses import respond

DECAYS = st.one_of(st.floats(-0.999, 1.0), st.floats(0.0, 1e-3), st.just(1.0), st.just(0.0))
RATES = st.floats(0.0, 5e3)
STEP = 1e-3


def drive(seed: int, points: int = 400) -> np.ndarray:
    return np.random.default_rng(seed).normal(1.0, 1.0, points)


@given(DECAYS, st.integers(1, 3000), st.integers(0, 99))
def test_the_recursion_solves_its_difference_equation(decay: float, points: int, seed: int) -> None:
    gain = drive(seed, points)
    bands = np.array([np.ones(points), np.full(points, -decay)])
    expected = solve_banded((1, 0), bands, gain)
    assert recursion(decay, gain) == pytest.approx(expected, abs=1e-12 * np.abs(expected).max())
    assert recursion(decay, np.column_stack((gain, -gain)))[:, 1] == pytest.approx(-expected, abs=1e-9)


@given(RATES, st.integers(0, 99))
def test_even_samples_respond_as_any_others_do(rate: float, seed: int) -> None:
    given_drive, time = drive(seed), np.arange(400) * STEP
    uneven = np.insert(time, 200, 0.5 * (time[199] + time[200]))
    finer = np.insert(given_drive, 200, 0.5 * (given_drive[199] + given_drive[200]))
    everywhere = respond(uneven, finer, rate)
    assert respond_evenly(STEP, given_drive, rate) == pytest.approx(np.delete(everywhere, 200), abs=1e-9)
    assert respond(time, given_drive, rate, 2.0) == pytest.approx(
        respond_evenly(STEP, given_drive, rate) + 2.0 * np.exp(-rate * time), abs=1e-9
    )


@given(RATES, st.integers(0, 99))
def test_shares_are_gathered_as_responses_spread(rate: float, seed: int) -> None:
    given_drive, shares = drive(seed), np.column_stack((drive(seed + 100), drive(seed + 200)))
    spread = shares.T @ respond_evenly(STEP, given_drive, rate)
    assert gathered_evenly(STEP, shares, rate).T @ given_drive == pytest.approx(spread, abs=1e-10)


@given(st.floats(0.1, 2e3), st.integers(0, 99))
def test_the_slope_by_the_rate_is_that_of_differences(rate: float, seed: int) -> None:
    given_drive, change = drive(seed), 1e-5 * rate
    response, slope = response_and_slope_evenly(STEP, given_drive, rate)
    assert response == pytest.approx(respond_evenly(STEP, given_drive, rate))
    by_differences = (
        respond_evenly(STEP, given_drive, rate + change) - respond_evenly(STEP, given_drive, rate - change)
    ) / (2.0 * change)
    assert slope == pytest.approx(by_differences, abs=1e-5 * np.abs(slope).max())


def test_a_segment_in_which_all_decays_leaves_what_the_drive_holds() -> None:
    time = np.array([0.0, 1.0, 1.1, 3.0, 3.05])
    assert respond(time, np.full(5, 2000.0), 1000.0, 5.0) == pytest.approx([5.0, 2.0, 2.0, 2.0, 2.0], rel=1e-9)


@given(st.floats(1e-9, 50.0))
def test_the_weights_of_a_constant_input_are_its_whole_response(x: float) -> None:
    w = weights(x)
    assert w.first + w.last == pytest.approx(-math.expm1(-x) / x)
    assert w.decay + x * (w.first + w.last) == pytest.approx(1.0)


@given(st.lists(st.floats(-10.0, 2.0), min_size=1, max_size=60), st.integers(0, 99))
def test_several_drives_between_uneven_samples_follow_the_weights_of_each_segment(logs: list[float], seed: int) -> None:
    x, random = 10.0 ** np.array(logs), np.random.default_rng(seed)
    steps, drives = random.uniform(0.1, 2.0, x.size), random.normal(size=(3, x.size + 1))
    one_by_one = [np.array([1.0, 0.0, -2.0])]
    for k, each in enumerate(x):
        w = weights(float(each))
        gain = steps[k] * (w.first * drives[:, k] + w.last * drives[:, k + 1])
        one_by_one.append(w.decay * one_by_one[-1] + gain)
    found = Decay(steps, x).respond(drives, one_by_one[0])
    assert found == pytest.approx(np.array(one_by_one).T, rel=1e-9, abs=1e-9)


@given(st.lists(st.floats(-50.0, 5e3), min_size=1, max_size=4), st.integers(0, 99))
def test_several_systems_respond_as_each_does(rates: list[float], seed: int) -> None:
    steps, drives = np.full(199, STEP), np.array([drive(seed + k, 200) for k in range(len(rates))])
    x = np.outer(rates, steps)
    together = Decay(steps, x)
    each = [Decay(steps, own) for own in x]
    expected = np.array([one.respond(own, 2.0) for one, own in zip(each, drives, strict=True)])
    assert together.respond(drives, 2.0) == pytest.approx(expected, rel=1e-9, abs=1e-9)
    two = np.stack((drives, -drives), axis=1)
    assert together.respond(two)[:, 1] == pytest.approx(-together.respond(drives), rel=1e-9, abs=1e-9)
