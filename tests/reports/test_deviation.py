import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.interfaces.text import Text
from procedures.core.nameplate import Nameplate, WindingConnection
from procedures.core.parameter_set import ParameterSet
from procedures.core.result import Notice, Parameter, ProcedureResult, Withheld
from procedures.plausibility.type_tolerance import Conformity, conformity, held_against_type
from reports.tables.attention import Rank, ranked
from reports.tables.deviation import axis_end, deviations


def figure(name: str, value: float, u: float, unit: str = "Ω", note: float | None = None) -> Parameter:
    return Parameter(name, value, unit, u, math.inf, (value - 2 * u, value + 2 * u), "p", "3.2", "fit", note)


def found(*parameters: Parameter) -> ParameterSet:
    return ParameterSet({p.name: p for p in parameters}, {p.name: () for p in parameters}, ())


@given(
    value=st.floats(1e-6, 1e3),
    relative=st.floats(1e-5, 0.2),
    expected=st.floats(1e-6, 1e3),
    tolerance=st.floats(1e-3, 1.0),
)
def test_a_verdict_is_what_the_interval_and_the_limits_say(
    value: float, relative: float, expected: float, tolerance: float
) -> None:
    measured = figure("stator_resistance", value, relative * value)
    low, high = measured.coverage_interval
    least, most = expected * (1 - tolerance), expected * (1 + tolerance)
    verdict = conformity(measured, expected, tolerance)
    assert (verdict is Conformity.WITHIN) == (least <= low and high <= most)
    assert (verdict is Conformity.OUTSIDE) == (high < least or low > most)


def test_every_place_on_the_axis_is_per_cent_of_the_type() -> None:
    measured = figure("stator_resistance", 0.0155, 0.0001, note=0.0168)
    (row,) = deviations(found(measured), {"stator_resistance": 0.016}, {"stator_resistance": 0.02})
    assert row.on_axis is not None
    assert row.on_axis.value == pytest.approx(-3.125)
    assert row.on_axis.interval == pytest.approx((-4.375, -1.875))
    assert row.on_axis.note == pytest.approx(5.0)
    assert (row.value, row.expanded, row.unit) == ("15.50", "0.20", "mΩ")
    assert (row.of_type, row.tolerance, row.verdict) == (True, 2.0, Conformity.OPEN)
    assert axis_end([row]) == 5.0


def test_what_restates_a_quantity_stands_with_it_and_counts_have_no_axis() -> None:
    rows = deviations(
        found(
            figure("flux_linkage", 8.5e-3, 1e-5, "V·s/rad"),
            figure("back_emf_constant_v_per_krpm", 3.56, 0.004, "V/krpm"),
            figure("pole_pairs", 4.0, 0.0, "1"),
            figure("resistance_unbalance", 0.4, 0.1, "%"),
        ),
        {"pole_pairs": 5.0},
        {},
    )
    by_name = {row.name: row for row in rows}
    assert set(by_name) == {"flux_linkage", "pole_pairs", "resistance_unbalance"}
    assert by_name["flux_linkage"].also == ("3.5600 V/krpm",)
    assert str(by_name["pole_pairs"].exact) == "the type says 5"
    assert by_name["resistance_unbalance"].on_axis is None


def test_only_what_is_not_proved_within_is_warned_of() -> None:
    plate = Nameplate(
        "m",
        WindingConnection.WYE,
        1.0,
        expected={"stator_resistance": 1.0, "inertia": 1.0, "flux_linkage": 1.0},
        tolerance={"stator_resistance": 0.05, "inertia": 0.05, "flux_linkage": 0.05},
    )
    measured = found(
        figure("stator_resistance", 1.01, 0.01),
        figure("inertia", 1.04, 0.01, "kg·m²"),
        figure("flux_linkage", 0.9, 0.01, "V·s/rad"),
    )
    said = [str(notice.message) for notice in held_against_type(measured, plate)]
    assert said == [
        "Inertia is +4 % off the type's value; its interval shows it neither within ±5 % nor outside",
        "Flux linkage is -10 % off the type's value, outside its ±5 %",
    ]
    # What gave the figure is what may be measured again.
    warnings = [("", notice) for notice in held_against_type(measured, plate)]
    assert [each.procedure for each in ranked(measured, warnings, {})] == ["p", "p"]


def test_what_is_missing_comes_first_and_what_is_known_last() -> None:
    lacking = Withheld("inertia", "inertia", "3.5", "clipped", Text("take a wider range"))
    measured = ParameterSet({}, {}, (), {"inertia": (lacking,)})
    modelled = ProcedureResult(
        "back-emf-constant", "3.4", (), findings={"misfit": [{"cause": "hum", "answer": "modelled"}]}
    )
    warnings = [
        ("back-emf-constant", Notice("hum", Text("hum"))),
        ("stator-resistance", Notice("E7", Text("coefficient"))),
        ("stator-resistance", Notice("E9", Text("bridge"))),
        ("", Notice("consistency-plate", Text("plate"))),
        ("", Notice("consistency-plate", Text("plate"))),
    ]
    listed = ranked(measured, warnings, {"back-emf-constant": modelled})
    assert [(each.rank, each.identifier) for each in listed] == [
        (Rank.MISSING, "clipped"),
        (Rank.CONTRADICTION, "consistency-plate"),
        (Rank.CONDITION, "E9"),
        (Rank.KNOWN, "hum"),
        (Rank.KNOWN, "E7"),
    ]
