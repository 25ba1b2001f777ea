import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.mechanics.pole_pairs import from_angles, from_frequency, places


@given(st.integers(1, 24), st.floats(0, 6.28), st.integers(0, 2**32 - 1))
def test_marks_with_scatter_give_the_count(p: int, start: float, seed: int) -> None:
    scatter = np.random.default_rng(seed).uniform(-0.25, 0.25, p)
    assert from_angles(start + (2 * np.pi * np.arange(p) + scatter) / p).pole_pairs == p


@given(st.integers(3, 24), st.integers(0, 23), st.integers(0, 23))
def test_one_missed_and_one_double_mark_do_not_matter(p: int, missed: int, double: int) -> None:
    marks = 2 * np.pi * np.arange(p) / p
    assert from_angles(np.delete(marks, missed % p)).pole_pairs == p
    assert from_angles(np.append(marks, marks[double % p] + 0.1 / p)).pole_pairs == p


@given(st.integers(1, 24), st.integers(1, 3), st.floats(0, 6.28))
def test_marks_round_all_turns_take_every_place_once_a_turn(p: int, turns: int, start: float) -> None:
    found = places(start + 2 * np.pi * np.arange(p * turns) / p, p, turns)
    assert (found.taken, found.repeated) == (p, 0)
    assert found.spread == pytest.approx(0.0, abs=1e-6)
    assert found.gap == pytest.approx(2 * np.pi / p)


def test_marks_of_a_part_of_the_turn_leave_places_empty() -> None:
    found = places(2 * np.pi * np.array([0, 1, 2, 2.1, 3]) / 12, 12)
    assert (found.taken, found.repeated) == (4, 1)
    assert found.spread == pytest.approx(2 * np.pi * 0.1 / 12)
    assert found.gap == pytest.approx(2 * np.pi * 9 / 12)


def test_concentration_tells_how_even_the_marks_are() -> None:
    assert from_angles(np.arange(4) * np.pi / 2).concentration == pytest.approx(1.0)
    with pytest.raises(EstimationError, match="not evenly spaced"):
        from_angles([0.0, 0.4, 0.9, 1.1, 3.0, 3.3, 5.0])
    with pytest.raises(EstimationError, match="at least 1"):
        from_angles([])


def test_the_notes_frequency_example() -> None:
    found = from_frequency(53.76, 1600.0, 0.05, 2.0)
    assert found.pole_pairs == 2
    assert found.ratio == pytest.approx(2.016)
    assert found.certain


def test_many_pole_pairs_need_a_good_speed() -> None:
    assert not from_frequency(500.0, 1500.0, 0.5, 50.0).certain
    assert from_frequency(500.0, 1500.0, 0.5, 20.0).certain
    with pytest.raises(EstimationError, match="do not belong together"):
        from_frequency(1.0, 1000.0, 0.0, 0.0)
    with pytest.raises(EstimationError, match="speed = 0 rpm"):
        from_frequency(50.0, 0.0, 0.1, 1.0)
