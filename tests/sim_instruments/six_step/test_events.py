"""No event is missed, however short; none is invented."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_instruments.six_step.events import first_below_zero


def curve(decays: list[float], constant: float, swings: list[complex]) -> np.ndarray:
    return np.array([[*decays, constant, *swings]], dtype=complex)


EXPONENTS = np.array([-0.7, -3.0, -40.0, 0.0, 5.0j, 35.0j])
TIMES = np.linspace(0, 2, 40001)
BASIS = np.exp(EXPONENTS[:, None] * TIMES)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.floats(-3, 3), min_size=3, max_size=3),
    st.floats(-1, 3),
    st.lists(st.complex_numbers(max_magnitude=2, allow_nan=False, allow_infinity=False), min_size=2, max_size=2),
)
def test_first_crossing_is_found(decays: list[float], constant: float, swings: list[complex]) -> None:
    c = curve(decays, constant, swings)
    values = (c @ BASIS).real[0]
    found = first_below_zero(c, EXPONENTS, 3, 2.0)
    below = np.flatnonzero(values < -1e-9)
    if len(below) == 0:
        assert found is None or (c @ np.exp(EXPONENTS * found[0])).real[0] < 1e-9
        return
    assert found is not None
    assert found[0] <= TIMES[below[0]] + 1e-12
    # Nothing below zero before it.
    assert values[found[0] - 1e-9 > TIMES].min(initial=1.0) >= -1e-9


def test_a_dip_of_a_millionth_of_the_span_is_found() -> None:
    # 1 − cos(t − 0.777) touches 0 at 0.777; lowered by 1e-14 it is below for 2.8e-7 of the span.
    exponents = np.array([-1.0, 0.0, 1.0j])
    c = curve([0.0], 1.0 - 1e-14, [-np.exp(-0.777j)])
    found = first_below_zero(c, exponents, 1, 1.0)
    assert found is not None
    assert found[0] == pytest.approx(0.777, abs=1e-6)


def test_a_near_touch_is_no_event() -> None:
    exponents = np.array([-1.0, 0.0, 1.0j])
    assert first_below_zero(curve([0.0], 1.0 + 1e-12, [-np.exp(-0.777j)]), exponents, 1, 1.0) is None


def test_the_earliest_of_several_curves() -> None:
    exponents = np.array([-1.0, 0.0, 1.0j])
    c = np.vstack([curve([1.0], -0.5, [0.0]), curve([1.0], -0.49, [0.0]), curve([1.0], -0.51, [0.0])])
    found = first_below_zero(c, exponents, 1, 2.0)
    assert found is not None
    assert found == (pytest.approx(-np.log(0.51), abs=1e-12), 2)
