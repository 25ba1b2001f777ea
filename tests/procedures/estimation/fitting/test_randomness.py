"""Residuals whose making is known: noise of several kinds, and what no noise makes."""

from collections.abc import Callable

import numpy as np
import pytest

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.randomness import LEAST_READINGS, chance_of_pattern

LEVEL = 0.01
Draw = Callable[[np.random.Generator, int], FloatArray]
NOISE: dict[str, Draw] = {
    "normal": lambda random, n: random.normal(size=n),
    "long-tailed": lambda random, n: random.standard_t(2.0, size=n),
    "rounded": lambda random, n: np.round(random.normal(size=n)),
}


def found(residuals: FloatArray) -> bool:
    chance = chance_of_pattern(residuals)
    assert chance is not None
    return chance < LEVEL


@pytest.mark.parametrize("kind", NOISE)
@pytest.mark.parametrize("n", [LEAST_READINGS, 40, 320])
def test_noise_shows_a_pattern_in_less_than_two_cases_of_a_hundred(kind: str, n: int) -> None:
    random = np.random.default_rng(n)
    assert sum(found(NOISE[kind](random, n)) for _ in range(1500)) <= 0.02 * 1500


def test_what_a_fit_takes_away_is_no_pattern() -> None:
    random = np.random.default_rng(5)
    basis = np.linalg.qr(np.polynomial.chebyshev.chebvander(np.linspace(-1.0, 1.0, 320), 40))[0]
    noises = (random.normal(size=320) for _ in range(1500))
    assert sum(found(noise - basis @ (basis.T @ noise)) for noise in noises) <= 0.02 * 1500


@pytest.mark.parametrize("cycles", [8.0, 28.0, 70.0, 120.0])
def test_a_beat_is_a_pattern(cycles: float) -> None:
    random, place = np.random.default_rng(int(cycles)), np.linspace(0.0, 1.0, 320)
    for _ in range(100):
        first, second = random.uniform(0.0, 2.0 * np.pi, 2)
        beat = np.sin(2.0 * np.pi * cycles * place + first) * np.sin(3.0 * np.pi * place + second)
        assert found(2.0 * beat + random.normal(size=place.size))


def test_a_bend_is_a_pattern_and_few_or_equal_readings_are_not_judged() -> None:
    place = np.linspace(-1.0, 1.0, 40)
    assert found(place**2 - np.mean(place**2) + 0.1 * np.random.default_rng(1).normal(size=40))
    assert chance_of_pattern(np.arange(LEAST_READINGS - 1.0)) is None
    assert chance_of_pattern(np.zeros(100)) is None
