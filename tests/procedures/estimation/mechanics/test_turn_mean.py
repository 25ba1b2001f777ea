"""The mean of a torque that varies once a turn."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.mechanics.turn_mean import mean_over_turns


def readings(amplitude: float, noise: float, *, turns: float = 0.38, seed: int = 1, phase: float = 0.3) -> Any:
    count, rng = 8, np.random.default_rng(seed)
    angle = 2.0 * np.pi * turns * np.arange(count)
    torque = 0.5 + amplitude * np.cos(angle + phase) + noise * rng.standard_normal(count)
    return torque, 0.02 * np.arange(count), np.full(count, 2.0 * np.pi * turns / 0.02)


@given(st.floats(0.05, 10.0), st.floats(0.0, 6.28), st.floats(0.12, 0.38))
def test_what_repeats_every_turn_does_not_count(amplitude: float, phase: float, turns: float) -> None:
    found = mean_over_turns(*readings(amplitude, 1e-4, turns=turns, phase=phase))
    assert found.once_a_turn == pytest.approx(amplitude, rel=0.02)
    assert found.mean == pytest.approx(0.5, abs=6.0 * found.uncertainty)
    assert found.uncertainty < 1e-3
    assert found.degrees_of_freedom == 5.0


def test_of_noise_it_is_the_mean() -> None:
    seen = 0
    for seed in range(2000):
        torque, time, speed = readings(0.0, 0.03, seed=seed)
        found = mean_over_turns(torque, time, speed)
        seen += bool(found.once_a_turn)
        if not found.once_a_turn:
            assert found.mean == pytest.approx(float(np.mean(torque)))
    assert seen <= 8


@pytest.mark.parametrize("turns", [1.0, 0.5])
def test_always_at_the_same_places_of_the_turn_nothing_is_told_apart(turns: float) -> None:
    assert mean_over_turns(*readings(1.0, 1e-4, turns=turns)).once_a_turn == 0.0


def test_one_reading_is_no_mean() -> None:
    with pytest.raises(EstimationError, match="two readings"):
        mean_over_turns([1.0], [0.0], [100.0])
