"""The torque of a ramp whose transducer turns with a shaft that is out of line."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.mechanics.ramp_torque import ramp_torque, torque_runout

TIME = np.arange(160) * 0.006
SPEED = 10.0 + 150.0 * TIME
ANGLE = 10.0 * TIME + 75.0 * TIME**2
SCATTER = 1e-4


def noisy(torque: np.ndarray, seed: int = 1) -> np.ndarray:
    return torque + np.random.default_rng(seed).normal(0.0, SCATTER, TIME.size)


@given(
    share=st.floats(0.002, 0.1), phase=st.floats(0.0, 6.3), late=st.floats(0.0, 0.008), seed=st.integers(0, 99)
)  # fmt: skip
def test_what_turns_with_the_shaft_is_no_torque_and_is_told(share: float, phase: float, late: float, seed: int) -> None:
    """Even where a reading is late; the level is found within its uncertainty, and the amplitude."""
    read = noisy(0.05 + 0.05 * share * np.sin(ANGLE - late * SPEED + phase), seed)
    found = torque_runout(read, TIME, SPEED)
    if found is None:
        # A lag of more than a radian is no slope of the speed any more.
        assert late > 0.004
        return
    assert abs(found.level - 0.05) < 5.0 * found.uncertainty + 0.02 * 0.05 * share
    assert found.likely == pytest.approx(0.05 * share, abs=4.0 * found.of_scatter, rel=0.15)
    torque = ramp_torque(read, TIME, SPEED, 1)
    assert not torque.varies
    assert np.ptp(torque.values) == 0.0


@given(st.integers(0, 999))
def test_scatter_alone_turns_with_nothing(seed: int) -> None:
    found = torque_runout(noisy(np.full(TIME.size, 0.05), seed), TIME, SPEED)
    assert found is not None
    assert found.score < 3.1
    assert found.likely < 0.7 * SCATTER


def test_a_torque_that_rises_is_one_that_varies() -> None:
    read = noisy(0.05 * (1.0 - np.exp(-TIME / 0.2)))
    assert torque_runout(read, TIME, SPEED) is None
    assert ramp_torque(read, TIME, SPEED, 1).varies


def test_less_than_a_turn_tells_no_level_beside_it() -> None:
    assert torque_runout(noisy(np.full(TIME.size, 0.05)), TIME, 0.01 * SPEED) is None


def test_a_torque_that_is_no_number_is_refused() -> None:
    with pytest.raises(EstimationError, match="ramp 2 is not a number"):
        ramp_torque(float("nan"), TIME, SPEED, 2)
