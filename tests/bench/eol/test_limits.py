import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.eol.limits import GuardBand, ParameterLimits, judge
from bench.eol.line.judging import described
from bench.eol.record import MeasuredFigure
from bench.eol.verdict import Verdict, together

BOUNDS = ParameterLimits(9.0, 11.0)
numbers = st.floats(-1e3, 1e3)
sizes = st.floats(0.0, 1e2)


@pytest.mark.parametrize(
    ("value", "strict", "shared", "lenient"),
    [
        (10.0, "pass", "pass", "pass"),
        (10.8, "fail", "pass", "pass"),
        (11.2, "fail", "fail", "pass"),
        (11.4, "fail", "fail", "fail"),
        (8.8, "fail", "fail", "pass"),
        (8.6, "fail", "fail", "fail"),
    ],
)
def test_the_guard_band_is_the_expanded_uncertainty(value: float, strict: str, shared: str, lenient: str) -> None:
    result = [
        judge(value, 0.3, BOUNDS, guard).verdict.value
        for guard in (GuardBand.STRICT, GuardBand.SHARED, GuardBand.LENIENT)
    ]
    assert result == [strict, shared, lenient]


@given(numbers, sizes, numbers, sizes)
def test_what_is_accepted_strictly_is_accepted_by_every_rule(
    value: float, expanded: float, low: float, width: float
) -> None:
    limits = ParameterLimits(low, low + width)
    order = [
        judge(value, expanded, limits, guard).verdict is Verdict.PASS
        for guard in (GuardBand.STRICT, GuardBand.SHARED, GuardBand.LENIENT)
    ]
    assert order == sorted(order)


def test_bands_that_meet_accept_nothing() -> None:
    assert judge(10.0, 1.5, BOUNDS, GuardBand.STRICT).verdict is Verdict.FAIL


@pytest.mark.parametrize(("value", "expanded"), [(math.nan, 0.1), (10.0, math.nan), (10.0, -1.0)])
def test_what_is_no_figure_is_an_error_of_the_station(value: float, expanded: float) -> None:
    assert judge(value, expanded, BOUNDS, GuardBand.SHARED).verdict is Verdict.ERROR


def test_an_open_side_binds_nothing() -> None:
    assert judge(1e9, 0.3, ParameterLimits(low=1.0), GuardBand.STRICT).verdict is Verdict.PASS
    assert judge(1.1, 0.3, ParameterLimits(low=1.0), GuardBand.STRICT).verdict is Verdict.FAIL


@pytest.mark.parametrize(("low", "high"), [(2.0, 1.0), (math.nan, 1.0)])
def test_reversed_limits_are_none(low: float, high: float) -> None:
    with pytest.raises(ValueError, match="reversed"):
        ParameterLimits(low, high)


@pytest.mark.parametrize(
    ("verdicts", "whole"),
    [
        ("pass pass", "pass"),
        ("pass fail error", "fail"),
        ("pass error", "error"),
        ("fail aborted", "aborted"),
        ("", "error"),
    ],
)
def test_the_verdict_on_the_whole(verdicts: str, whole: str) -> None:
    assert together(Verdict(word) for word in verdicts.split()) is Verdict(whole)


def test_what_a_label_says_of_a_figure_has_units_that_people_read() -> None:
    figure = MeasuredFigure("stator_resistance", 0.0191, "Ω", 4e-5, 8e-5, 0.0151, 0.0171, Verdict.FAIL)
    assert str(described(figure)) == "Stator resistance = 19.1 ± 0.08 mΩ, limits 15.1 … 17.1 mΩ"
