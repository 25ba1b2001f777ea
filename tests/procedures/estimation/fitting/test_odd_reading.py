"""A reading that contradicts its siblings."""

import numpy as np
import pytest

from procedures.estimation.fitting.repeats import odd_reading, stands_out


@pytest.mark.parametrize(
    ("values", "odd"),
    [
        ([5.20, 0.52, 5.20], 1),
        ([0.52, 5.20, 5.20], 0),
        ([5.20, 5.21, 52.0], 2),
        ([5.20, 5.02, 5.20, 5.21], 1),
        ([5.20, 52.0], 1),
        ([5.20, -5.20, 5.20], 1),
        ([5.20, 5.21, 5.18], None),
        ([5.20, 5.20, 5.20], None),
        ([5.20], None),
        ([0.0, 0.0, 0.0], None),
        ([4.0, 5.0, 6.0], None),
    ],
)
def test_it_is_found(values: list[float], odd: int | None) -> None:
    assert odd_reading(values, 0.03) == odd


def test_what_the_instrument_cannot_tell_apart_is_no_contradiction() -> None:
    assert odd_reading([1.0e-3, 1.0e-3, 1.15e-3], 0.03) == 2
    assert odd_reading([1.0e-3, 1.0e-3, 1.15e-3], 0.03, limit=1e-4) is None


@pytest.mark.slow
@pytest.mark.parametrize("count", [3, 4, 5])
def test_noise_of_one_per_cent_hardly_ever_contradicts_by_a_tenth(count: int) -> None:
    readings = np.random.default_rng(count).normal(1.0, 0.01, (2000, count))
    assert sum(odd_reading(list(row), 0.1) is not None for row in readings) == 0


def test_a_slip_stands_out_and_the_farthest_of_scattered_ones_does_not() -> None:
    assert stands_out([5.20, 0.52, 5.21, 5.19], 1)
    assert not stands_out([5.20, 0.52, 5.21], 1)
    assert not stands_out([5.2, 3.1, 5.9, 4.4], 1)


@pytest.mark.slow
def test_what_is_left_out_of_scattered_readings_keeps_the_interval_s_promise() -> None:
    """Twenty per cent of noise: the farthest reading is left out of hardly any mean."""
    readings = np.random.default_rng(7).normal(1.0, 0.2, (3000, 4))
    out = [(odd := odd_reading(list(row), 0.1)) is not None and stands_out(list(row), odd) for row in readings]
    assert sum(out) < 0.006 * len(out)
