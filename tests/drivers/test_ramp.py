"""How long a driver waits for an instrument that goes to its target along a ramp of its own."""

import pytest

from drivers.interfaces import Clock, OwnRamp


def _waited(clock: Clock, rate: float, ends_at: float, target: float = 1000.0) -> tuple[bool, float]:
    """Return whether the target was reached by a ramp of this rate (1/s) that goes no further than `ends_at`, and when (s)."""
    ramp = OwnRamp(clock, 30.0, 0.1)
    for _ in ramp.polls():
        found = min(rate * ramp.elapsed, ends_at)
        if abs(found - target) < 1.0:
            return True, ramp.elapsed
        if ramp.stalled(abs(found - target)):
            return False, ramp.elapsed
    raise AssertionError


@pytest.mark.parametrize("rate", [1000.0, 20.0, 2.0])
def test_a_slow_ramp_is_waited_for(clock: Clock, rate: float) -> None:
    reached, after = _waited(clock, rate, 1000.0)
    assert reached
    assert after == pytest.approx(1000.0 / rate, abs=0.6)


def test_a_ramp_that_ends_early_is_given_up_when_it_comes_no_nearer(clock: Clock) -> None:
    reached, after = _waited(clock, 20.0, 599.0)
    assert not reached
    assert after == pytest.approx(60.0, abs=0.5)


@pytest.mark.parametrize("rate", [0.0, -20.0])
def test_what_does_not_move_or_goes_away_is_given_up_at_once(clock: Clock, rate: float) -> None:
    reached, after = _waited(clock, rate, 0.0)
    assert not reached
    assert after == pytest.approx(30.0, abs=0.2)


def test_one_that_creeps_is_given_up(clock: Clock) -> None:
    reached, after = _waited(clock, 1.0, 1000.0)
    assert not reached
    assert after == pytest.approx(30.0, abs=0.2)
