"""What two parameters share of their uncertainty, as told from their budgets alone."""

import math

import pytest
from GTC import get_covariance
from GTC.lib import UncertainReal
from hypothesis import given
from hypothesis import strategies as st

from drivers.interfaces import Accuracy
from drivers.interfaces.text import word
from procedures.core.budget import Uncertainties
from procedures.core.result import Contribution, Parameter

positive = st.floats(1e-6, 1e3)


def parameter(unc: Uncertainties, name: str, quantity: UncertainReal) -> Parameter:
    return unc.parameter(name, "H", quantity, procedure="p", section="3", estimator="e")


@given(low=positive, high=positive, gain=st.floats(1e-5, 0.1), offset=positive)
def test_the_budgets_know_what_the_uncertain_numbers_know(low: float, high: float, gain: float, offset: float) -> None:
    unc = Uncertainties()
    meter = Accuracy(gain=gain, offset=offset, source="manual")
    d, q = (
        unc.instrument("meter", unc.statistical(f"repeats of {axis}", value, 0.01 * value, 9.0), meter)
        for axis, value in (("d", low), ("q", high))
    )
    one, other = parameter(unc, "d", d), parameter(unc, "q", q)
    assert one.covariance(other) == pytest.approx(float(get_covariance(d, q)), rel=1e-9)
    assert one.covariance(other) == pytest.approx(other.covariance(one), rel=1e-12)
    assert one.covariance(one) == pytest.approx(one.standard_uncertainty**2, rel=1e-9)
    difference = math.sqrt(max(0.0, one.covariance(one) + other.covariance(other) - 2.0 * one.covariance(other)))
    assert difference == pytest.approx(float((q - d).u), rel=1e-6, abs=1e-7 * max(offset, gain * high, high))


def test_inputs_of_a_resumed_run_are_its_own_but_the_instrument_is_the_same() -> None:
    meter = Accuracy(gain=0.01, source="manual")
    found = []
    for session in (1, 2):
        unc = Uncertainties(session)
        found.append(parameter(unc, "d", unc.instrument("meter", unc.statistical("repeats", 1.0, 0.1, 9.0), meter)))
    assert found[0].covariance(found[1]) == pytest.approx(0.01**2 / 3.0)


def test_rows_that_name_no_input_share_none() -> None:
    row = Contribution(word("repeats"), 1.0, 0.1, 1.0, 0.1, "A")
    made = Parameter("d", 1.0, "H", 0.1, 9.0, (0.8, 1.2), "p", "3", "e", budget=(row,))
    assert made.covariance(made) == 0.0
