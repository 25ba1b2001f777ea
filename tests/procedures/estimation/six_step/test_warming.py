"""Where a winding's temperature stands at each of several loads, against a first-order winding integrated in small steps."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.six_step.warming import warming_shares

HEATS = st.lists(st.floats(1.0, 100.0), min_size=2, max_size=6).map(sorted)


@given(HEATS, st.floats(0.5, 5000.0), st.floats(1.0, 30.0))
def test_a_winding_of_one_time_constant_lies_between(heats, constant, length):
    begins = np.arange(len(heats)) * length
    reads, end = begins + 0.9 * length, len(heats) * length
    rise, warmth, step = [], 0.0, min(length, constant) / 2000.0
    for heat in heats:
        steps = round(length / step)
        for k in range(steps):
            if k == round(0.9 * steps):
                rise.append(warmth)
            warmth += step / constant * (heat - warmth)
    shares, half_widths = warming_shares(heats, begins, reads, end, warmed=True)
    assert np.all(np.abs(np.array(rise) / warmth - shares) <= half_widths + 0.01)


def test_a_winding_that_cooled_tells_nothing_of_its_course():
    shares, half_widths = warming_shares([1.0, 4.0], [0.0, 5.0], [4.0, 9.0], 10.0, warmed=False)
    assert list(shares) == [0.5, 0.5]
    assert list(half_widths) == [0.5, 0.5]


def test_a_load_read_before_it_came_is_refused():
    with pytest.raises(EstimationError, match="between its own beginning and the next"):
        warming_shares([1.0, 4.0], [0.0, 5.0], [6.0, 9.0], 10.0, warmed=True)
