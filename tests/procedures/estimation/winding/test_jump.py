import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from procedures.estimation.winding.sweep.jump import clearest_jump


@given(
    st.integers(min_value=9, max_value=60),
    st.integers(min_value=0, max_value=999),
    st.floats(min_value=-1, max_value=1),
)
def test_it_is_the_best_of_all_least_squares(readings: int, seed: int, height: float) -> None:
    random = np.random.default_rng(seed)
    way = np.linspace(0.0, 4.0, readings)
    design = np.column_stack((np.ones(readings), np.cos(way), np.sin(way)))
    values = design @ [1.0, 0.2, -0.1] + 0.05 * random.standard_normal(readings)
    values[random.integers(readings) :] += height
    found = clearest_jump(design, values)

    def squares(place: int) -> float:
        step = (np.arange(readings) >= place) - 0.5
        both = np.column_stack((design, step))
        return float(np.sum((values - both @ np.linalg.lstsq(both, values, rcond=None)[0]) ** 2))

    left = {place: squares(place) for place in range(2, readings - 1)}
    assert left[found.place] == pytest.approx(min(left.values()), rel=1e-9)
    assert found.squares == pytest.approx(min(left.values()), rel=1e-6)


def test_a_logged_sweep_has_room() -> None:
    """A table of every place against every reading would take 80 GB."""
    way = np.linspace(0.0, 40.0, 100_000)
    values = 1.0 + 0.2 * np.cos(way) + 0.01 * (way > 25.0)
    found = clearest_jump(np.column_stack((np.ones(way.size), np.cos(way), np.sin(way))), values)
    assert found.height == pytest.approx(0.01)
    assert way[found.place] == pytest.approx(25.0, abs=1e-3)
