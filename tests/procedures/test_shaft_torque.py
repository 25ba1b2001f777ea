"""How much wider a flux map becomes by a shaft's torque that differs from its own."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from procedures.estimation.flux.flux_map import GainLimits
from procedures.techniques.maps.shaft_torque import ShaftTorque

OWN = 0.004
TORQUES = np.linspace(-1.0, 1.0, 9)


def compared(ratio: float) -> ShaftTorque:
    return ShaftTorque(ratio, OWN, OWN, TORQUES, ratio * TORQUES, GainLimits(0.003, 0.005))


@given(st.floats(-0.999, 0.999))
def test_what_chance_explains_widens_nothing(share: float) -> None:
    assert compared(1.0 + share * OWN).excess == 0.0


@given(off=st.floats(1.01, 100.0).filter(lambda off: abs(off - 3.0) > 1e-6), way=st.sampled_from([-1.0, 1.0]))
def test_more_than_chance_is_in_the_limit_whether_it_is_told_or_not(off: float, way: float) -> None:
    found = compared(1.0 + way * off * OWN)
    assert found.excess <= (off + 2.0) * OWN / 0.95 * (1.0 + 1e-9)
    # An interval of 95 % ends at 1.96/√3 of a limit: where the difference is told, it reaches beyond it.
    assert found.contradiction is None or 1.96 / np.sqrt(3.0) * found.excess > off * OWN
    assert (found.contradiction is not None) == (off > 3.0)


def test_a_little_more_difference_makes_it_no_narrower() -> None:
    widths = [compared(1.0 + off).excess for off in np.linspace(0.0, 0.2, 400)]
    assert np.all(np.diff(widths) >= 0.0)
    assert widths[-1] == pytest.approx((0.2 + 2.0 * OWN) / 0.95)
