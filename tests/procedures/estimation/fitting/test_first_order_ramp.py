"""A time constant from where the response to a slow rise crosses 63.2 %."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from procedures.estimation.fitting.first_order import time_constant_of_ramp
from procedures.estimation.fitting.fit import EstimationError


@given(tau=st.floats(1e-7, 1.0), share=st.floats(0.0, 2.5))
def test_the_rise_is_taken_out(tau, share):
    rise = share * tau
    # The response to a straight rise, solved for the instant at which 1/e of it is left.
    after_start = tau * (1.0 + (math.log(math.expm1(share) / share) if share > 1e-9 else share / 2.0))
    assert time_constant_of_ramp(after_start - 0.5 * rise, rise) == pytest.approx(tau, rel=1e-6)


def test_a_crossing_within_the_rise_is_refused():
    with pytest.raises(EstimationError, match="before its end"):
        time_constant_of_ramp(1e-3, 2e-3)
