import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from bench.plugins.catalogues import installed
from drivers.interfaces.text import text
from procedures.core.parameter_set import merge
from procedures.core.result import Notice, Parameter, ProcedureResult
from reports.exports.checks import ExportRefusedError, UncertaintyBounds
from reports.exports.subject import Datasheet, Subject, doubtful, pole_pairs_doubt
from reports.exports.target import sheet_for
from reports.tables.figures import percent

Make = Callable[..., Subject]
Replaced = Callable[..., dict[str, Parameter]]


def reasons(subject: Subject, target: str = "vesc", limits: UncertaintyBounds | None = None) -> list[str]:
    with pytest.raises(ExportRefusedError) as refused:
        sheet_for(installed().exports[target], subject, limits)
    return [str(reason) for reason in refused.value.reasons]


def test_what_is_missing_is_named_with_what_gives_it(make_subject: Make) -> None:
    subject = make_subject({"pole_pairs": 4.0, "stator_resistance": 0.016})
    assert reasons(subject) == [
        "d_axis_inductance is needed and the run has none",
        "q_axis_inductance is needed and the run has none",
        "flux_linkage is needed and the run has none; run back-emf-constant",
    ]


def test_an_interval_that_contains_zero(make_subject: Make, replaced: Replaced) -> None:
    wide = replaced("flux_linkage", standard_uncertainty=5e-3, coverage_interval=(-1.3e-3, 18.3e-3))
    (reason,) = reasons(make_subject(parameters=wide), limits=UncertaintyBounds(1.0))
    assert "-0.0013 … 0.0183 V·s/rad contains zero" in reason


@pytest.mark.parametrize(
    ("name", "relative", "refused"),
    [
        ("flux_linkage", 0.06, True),
        ("flux_linkage", 0.04, False),
        ("stator_resistance", 0.11, True),
        ("stator_resistance", 0.09, False),
    ],
)
def test_bounds_on_relative_uncertainty(
    name: str, relative: float, refused: bool, make_subject: Make, replaced: Replaced
) -> None:
    value = {"flux_linkage": 8.5e-3, "stator_resistance": 0.016}[name]
    spread = relative * value
    subject = make_subject(
        parameters=replaced(
            name, standard_uncertainty=spread, coverage_interval=(value - 2 * spread, value + 2 * spread)
        )
    )
    if refused:
        (reason,) = reasons(subject)
        assert reason.startswith(f"{name} is known to {percent(relative)} % only")
    assert sheet_for(installed().exports["vesc"], subject, UncertaintyBounds(0.2)).lines
    assert not refused or reasons(subject, limits=UncertaintyBounds(0.01))


@pytest.mark.parametrize("value", [math.nan, math.inf, -0.016, 0.0])
def test_values_that_no_motor_has(value: float, make_subject: Make, replaced: Replaced) -> None:
    (reason,) = reasons(make_subject(parameters=replaced("stator_resistance", value=value)))
    assert reason.endswith("it must be above 0")


@pytest.mark.parametrize("spread", [0.0, math.nan, math.inf])
def test_a_measured_figure_without_uncertainty(spread: float, make_subject: Make, replaced: Replaced) -> None:
    (reason,) = reasons(make_subject(parameters=replaced("stator_resistance", standard_uncertainty=spread)))
    assert reason == "stator_resistance has no stated uncertainty"


@pytest.mark.parametrize("value", [0.0, 3.5, -4.0, math.nan, math.inf])
def test_pole_pairs_are_whole_numbers(value: float, make_subject: Make, replaced: Replaced) -> None:
    (reason,) = reasons(make_subject(parameters=replaced("pole_pairs", value=value)))
    assert "not a whole number" in reason


def count(procedure: str, value: float, certain: bool = True) -> ProcedureResult:
    counted = Parameter("pole_pairs", value, "1", 0.0, math.inf, (value, value), procedure, "3.1", "e")
    return ProcedureResult(procedure, "3.1", (counted,), findings={"certain": certain})


@pytest.mark.parametrize(
    ("results", "doubt"),
    [
        ([count("a", 4.0)], None),
        ([count("a", 4.0), count("b", 4.0, certain=False)], None),
        ([count("a", 4.0, certain=False)], "a: frequency and speed allow more than one whole number of pole pairs"),
        ([count("a", 4.0), count("b", 8.0)], "a counts 4 pole pairs, b 8"),
        ([], None),
    ],
)
def test_certain_counts(results: list[ProcedureResult], doubt: str | None, make_subject: Make) -> None:
    found = pole_pairs_doubt(merge(results), {r.procedure: r for r in results})
    assert (None if found is None else str(found)) == doubt
    if found is not None:
        assert reasons(make_subject(pole_pairs_doubt=found)) == [f"the number of pole pairs is not certain: {doubt}"]


def test_what_only_the_plate_knows(make_subject: Make) -> None:
    (reason,) = reasons(make_subject(datasheet=Datasheet(rated_speed_rpm=3000.0)), "mathworks")
    assert reason == "rated_current is needed and the data sheet's figure is not known; add it to the motor file"


def test_what_is_optional_is_left_out_with_the_reason(make_subject: Make) -> None:
    subject = make_subject()
    without = replace(subject, parameters={k: v for k, v in subject.parameters.items() if "friction" not in k})
    sheet = sheet_for(installed().exports["c-header"], without)
    assert [str(reason) for reason in sheet.left_out] == [
        "coulomb_friction is needed and the run has none",
        "viscous_friction is needed and the run has none",
    ]
    assert "left out: viscous_friction" in installed().exports["c-header"].write(sheet)


@pytest.mark.parametrize("target", ["json", "csv"])
def test_nothing_measured(target: str, make_subject: Make) -> None:
    assert reasons(make_subject(parameters={}), target) == ["no parameter was measured"]


def test_doubts_of_the_run_stand_in_the_file(make_subject: Make) -> None:
    notices = [
        ("", Notice("consistency-inductance", text("halved A→(B∥C)"))),
        ("", Notice("disagreement", text("they differ"))),
        ("x", Notice("E4", text("two names"))),
    ]
    kept = doubtful(notices)
    assert [notice.identifier for notice in kept] == ["consistency-inductance", "disagreement"]
    content = installed().exports["ti"].write(sheet_for(installed().exports["ti"], make_subject(warnings=kept)))
    assert "WARNING consistency-inductance: halved A" in content
    assert content.isascii()
