"""Figures of several procedures together: what contradicts is said, and no interval of it leaves out the other."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from procedures.core.parameter_set import ParameterSet, merge
from procedures.core.result import Parameter, ProcedureResult


def figure(procedure: str, value: float, relative: float, name: str = "d_axis_inductance") -> ProcedureResult:
    u = relative * value
    ends = (value - 1.96 * u, value + 1.96 * u)
    parameter = Parameter(name, value, "H", u, math.inf, ends, procedure, "3", "e")
    return ProcedureResult(procedure, "3", (parameter,))


def together(ratio: float) -> ParameterSet:
    return merge(
        [figure("dq-inductance-aligned", 1e-3, 0.001), figure("dq-inductance-time-constant", 1e-3 * ratio, 0.02)]
    )


@given(ratio=st.floats(0.5, 2.0))
def test_of_two_that_contradict_none_is_sure(ratio: float) -> None:
    found = together(ratio)
    best, (other,) = found.parameters["d_axis_inductance"], found.alternatives["d_axis_inductance"]
    if found.notices:
        assert best.coverage_interval == other.coverage_interval
        assert all(best.coverage_interval[0] < value < best.coverage_interval[1] for value in (1e-3, 1e-3 * ratio))
    else:
        assert abs(ratio - 1.0) < 0.06
        assert best.coverage_interval[1] == pytest.approx(1e-3 * (1.0 + 1.96 * 0.001))


def test_inductances_that_contradict_name_what_makes_them_differ() -> None:
    (notice,) = together(1.2).notices
    assert notice.identifier == "disagreement"
    for cause in ("eddy currents", "saturation", "probe"):
        assert cause in str(notice.message)


def test_the_short_circuit_s_chord_is_held_against_the_inductance_at_no_current() -> None:
    bridge = figure("dq-inductance-aligned", 1e-3, 0.001)
    assert not merge([bridge, figure("short-circuit", 0.95e-3, 0.03, "d_axis_chord_inductance")]).notices
    found = merge([bridge, figure("short-circuit", 0.8e-3, 0.03, "d_axis_chord_inductance")])
    (notice,) = found.notices
    assert "the d axis saturates" in str(notice.message)
    # Saturation is no error of either: both keep their intervals.
    assert found.parameters["d_axis_inductance"] == bridge.parameters[0]


def test_a_count_that_contradicts_keeps_its_interval() -> None:
    found = merge(
        [figure("pole-pairs-static", 4.0, 0.0, "pole_pairs"), figure("pole-pairs-inverter", 8.0, 0.0, "pole_pairs")]
    )
    assert found.notices
    assert found.parameters["pole_pairs"].coverage_interval == (4.0, 4.0)
