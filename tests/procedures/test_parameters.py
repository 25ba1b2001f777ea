"""The table of parameters, and what a procedure may give."""

from pathlib import Path
from typing import ClassVar

import pytest

from drivers.interfaces.text import text
from procedures.catalogue import catalogue
from procedures.core.parameter_definition import Bounds, ParameterDefinition, ParameterTable
from procedures.core.parameters import PARAMETERS
from procedures.core.procedure import Procedure, Settings
from procedures.known_parameters import givers, known_parameters
from reports.tables.parameter_reference import page, values

OWN = ParameterDefinition("winding_capacitance", "C_w", "F", text("Capacitance of the winding"), "to the frame")


def gives(*given: str | ParameterDefinition) -> type[Procedure[Settings]]:
    class Made(Procedure[Settings]):
        gives: ClassVar[tuple[str | ParameterDefinition, ...]] = given

        def measure(self) -> None:
            """Measure nothing."""

    return Made


def test_the_page_is_what_the_table_gives() -> None:
    found = (Path(__file__).parents[2] / "docs" / "reference" / "parameters.md").read_text(encoding="utf-8")
    assert found == page(known_parameters().values(), givers()), (
        "docs/reference/parameters.md is stale; its first lines say which command makes it"
    )


def test_every_parameter_of_the_table_is_given_by_a_procedure_or_comes_from_a_capture() -> None:
    given = givers()
    for name, definition in PARAMETERS.items():
        assert definition.type_value == (name in given), name
        assert definition.convention or not definition.type_value, name


def test_a_procedure_gives_rows_by_name_and_definitions_of_its_own() -> None:
    made = gives("stator_resistance", OWN)
    assert dict(made.parameters) == {"stator_resistance": PARAMETERS["stator_resistance"], OWN.name: OWN}
    assert OWN.name not in PARAMETERS


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("winding_capacitanse", "'winding_capacitanse' is no known parameter; give a ParameterDefinition of it"),
        (
            ParameterDefinition("stator_resistance", "R", "mΩ", text("Stator resistance")),
            "parameter stator_resistance is defined twice, and differently",
        ),
    ],
)
def test_a_procedure_that_gives_what_nothing_defines_is_refused(given: str | ParameterDefinition, said: str) -> None:
    with pytest.raises(TypeError, match=rf"Made\.gives: {said}"):
        gives(given)


@pytest.mark.parametrize(
    ("name", "unit", "said"),
    [
        ("Winding", "F", "small letters, digits and underscores"),
        ("winding capacitance", "F", "small letters, digits and underscores"),
        ("winding", "", "the unit is missing; 1 stands for none"),
        (
            "winding",
            "Ohmz",
            r"parameter winding: unit 'Ohmz' is no unit; allowed are .* Ω .* multiplied by · and divided by /",
        ),
        ("winding", "V*s/rad", "is no unit"),
        ("winding", "N·m/", "is no unit"),
        ("winding", "k%", "is no unit"),
    ],
)
def test_a_definition_without_a_proper_name_or_unit_is_refused(name: str, unit: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        ParameterDefinition(name, "", unit, text("Winding"))


@pytest.mark.parametrize("unit", ["1", "%/K", "mΩ", "kg·m²", "N·m/√W", "µV·s/rad", "s⁻¹", "V/krpm", "dB", "°"])
def test_units_are_those_of_the_field(unit: str) -> None:
    assert ParameterDefinition("winding", "", unit, text("Winding")).unit == unit


def test_an_ohm_sign_is_an_omega() -> None:
    assert ParameterDefinition("winding", "", "\u2126", text("Winding")).unit == "\u03a9"


def test_a_table_is_extended_to_another_and_a_name_that_it_has_not_is_answered_with_those_it_has() -> None:
    table = ParameterTable([OWN])
    more = table.extended(PARAMETERS.values())
    assert (len(table), len(more)) == (1, 1 + len(PARAMETERS))
    with pytest.raises(KeyError, match="'inertia' is none of the parameters winding_capacitance"):
        table["inertia"]


def test_of_procedures_that_define_one_name_differently_the_first_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    other = ParameterDefinition(OWN.name, "C", "nF", text("Capacitance"))
    own = {"first": gives(OWN), "second": gives(other)}
    monkeypatch.setattr("procedures.known_parameters.catalogue", lambda: {**catalogue(), **own})
    assert known_parameters()[OWN.name] == OWN
    assert givers()[OWN.name] == ["first", "second"]
    assert set(known_parameters()) - set(PARAMETERS) == {OWN.name}


def test_bounds_are_shown_as_readers_expect_them() -> None:
    assert [values(b) for b in (Bounds(0.0, open=True), Bounds(0.0), Bounds(-1.0, 1.0))] == ["> 0", "≥ 0", "-1 … 1"]
