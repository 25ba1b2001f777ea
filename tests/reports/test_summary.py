import io
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from drivers.interfaces.text import english, text
from procedures.core.parameter_set import merge
from procedures.core.result import Notice, Parameter, ProcedureResult
from reports.labels import ParameterLabels
from reports.tables.figures import decimals_for, figure, percent, scale_of
from reports.tables.summary import rows, summary


def parameter(name: str, value: float, unit: str, uncertainty: float, **more: object) -> Parameter:
    given: dict[str, object] = {
        "degrees_of_freedom": math.inf,
        "coverage_interval": (value, value),
        "procedure": "p",
        "section": "3.3.2",
        "estimator": "e",
    }
    return Parameter(name, value, unit, uncertainty, **{**given, **more})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("value", "unit", "uncertainty", "shown"),
    [
        (0.01602, "Ω", 0.00093, ("16.02", "mΩ", "0.93", "5.8")),
        (73.02e-6, "H", 0.043e-6, ("73.020", "µH", "0.043", "0.059")),
        (2.0504e-3, "H", 6.5e-7, ("2.05040", "mH", "0.00065", "0.032")),
        (5.632, "Ω", 0.013, ("5.632", "Ω", "0.013", "0.23")),
        (6.0e-5, "kg·m²", 2.3e-6, ("60.0", "kg·mm²", "2.3", "3.8")),
        (4.0, "1", 0.0, ("4", "", "–", "–")),
        (3000.0, "rpm", 0.0, ("3000", "rpm", "–", "–")),
        (0.0, "N·m", 0.001, ("0.0000", "N·m", "0.0010", "–")),
    ],
)
def test_figures_have_a_fitting_prefix_and_honest_digits(
    value: float, unit: str, uncertainty: float, shown: tuple[str, str, str, str]
) -> None:
    merged = merge([ProcedureResult("p", "3", (parameter("x", value, unit, uncertainty),))])
    (row,) = rows(merged, {}, english)
    assert (row.value, row.unit, row.uncertainty, row.relative) == shown


def test_flux_linkage_is_in_webers() -> None:
    merged = merge(
        [ProcedureResult("p", "3", (parameter("flux_linkage", 8.5e-3, "V·s/rad", 1e-5, note_value=8.7e-3),))]
    )
    (row,) = rows(merged, {"flux_linkage": 8.5e-3}, english)
    assert (row.value, row.unit, row.note, row.truth) == ("8.500", "mWb", "8.700", "8.500")


@given(st.floats(1e-9, 1e6), st.floats(1e-6, 1.0))
def test_the_printed_figure_lies_within_the_uncertainty(value: float, relative: float) -> None:
    scale = scale_of(value, "H")
    spread = relative * value / scale.factor
    decimals = decimals_for(spread, value / scale.factor)
    printed = float(figure(value / scale.factor, decimals))
    assert abs(printed * scale.factor - value) <= 0.06 * relative * value + 1e-12 * value
    if value >= 1e-9 and value < 1.0:
        assert 0.99 <= value / scale.factor < 1000.0


def test_the_table_fits_and_says_everything() -> None:
    results = [
        ProcedureResult(
            "dq-inductance-extremes",
            "3.3.2",
            (
                parameter("d_axis_inductance", 73.0e-6, "H", 4e-8, note_value=74.75e-6),
                parameter("maximum_current", 80.0, "A", 0.0, source="data sheet", section="2.7"),
            ),
            (Notice("E3", text("differ by {share:.1%}", share=0.049)),),
        ),
        ProcedureResult(
            "dq-inductance-aligned",
            "3.3.3",
            (parameter("d_axis_inductance", 73.1e-6, "H", 5e-7, procedure="dq-inductance-aligned"),),
        ),
    ]
    merged = merge(results)
    said = io.StringIO()
    Console(file=said, width=110, color_system=None).print(
        summary(
            merged, [("dq-inductance-extremes", results[0].warnings[0])], {"d_axis_inductance": 73e-6}, english, 110
        )
    )
    lines = said.getvalue().splitlines()
    assert max(map(len, lines)) <= 110
    whole = said.getvalue()
    for part in (
        "d-axis inductance",
        "73.000",
        "µH",
        "74.750",
        "data sheet",
        "· dq-inductance-aligned",
        "E3 (dq-inductance-extremes): differ by 4.9%",
    ):
        assert part in whole


@pytest.mark.parametrize("width", [50, 60, 72, 80, 100, 120])
def test_a_narrow_terminal_has_fewer_columns_and_every_digit(width: int) -> None:
    given = (
        parameter("d_axis_inductance", 73.016e-6, "H", 0.043e-6),
        parameter("viscous_friction", 20.0049e-6, "N·m·s/rad", 3e-8),
    )
    merged = merge([ProcedureResult("dq-inductance-time-constant", "3.3", given)])
    said = io.StringIO()
    truth = {"d_axis_inductance": 73e-6, "viscous_friction": 20e-6}
    Console(file=said, width=width, color_system=None).print(summary(merged, [], truth, english, width))
    whole = said.getvalue()
    assert max(map(len, whole.splitlines())) <= width
    assert "…" not in whole
    for digits in ("73.016", "µH", "0.059", "20.005", "µN·m·s/rad", "0.15"):
        assert digits in whole
    assert ("73.000" in whole) == (width >= 60)


def test_without_truth_there_is_no_column_for_it() -> None:
    merged = merge([ProcedureResult("p", "3", (parameter("inertia", 1.0, "kg·m²", 0.1),))])
    said = io.StringIO()
    Console(file=said, width=110, color_system=None).print(summary(merged, [], {}, english, 110))
    assert "Truth" not in said.getvalue()
    assert "Warnings" not in said.getvalue()


def test_a_run_without_a_figure_says_so() -> None:
    said = io.StringIO()
    Console(file=said, width=110, color_system=None).print(summary(merge([]), [], {}, english, 110))
    assert said.getvalue() == "No parameter was measured.\n"


def test_unknown_parameters_keep_their_name() -> None:
    assert ParameterLabels({})["something_new"].render() == "something_new"
    assert percent(math.nan) == "–"
    assert figure(math.nan, 2) == "–"


@pytest.mark.parametrize(
    ("value", "shown"), [(2.01e9, (1e9, "GΩ")), (-5e6, (1e6, "MΩ")), (1500.0, (1.0, "Ω")), (0.016, (1e-3, "mΩ"))]
)
def test_an_insulation_is_told_in_gigaohms(value: float, shown: tuple[float, str]) -> None:
    scale = scale_of(value, "Ω")
    assert (scale.factor, scale.unit) == shown
