"""The common parts of every motor file: the nameplate, and the description of a number."""

from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, Self, TypeVar

from pydantic import Field, create_model, model_validator

from bench.files.toml_file import Section
from drivers.interfaces.text import text
from procedures.core.nameplate import Nameplate, WindingConnection
from procedures.core.parameter_definition import ParameterDefinition, ParameterTable
from procedures.core.parameters import PARAMETERS

if TYPE_CHECKING:
    from procedures.known_parameters import Procedures

S = TypeVar("S", bound=Section)
#: Units of the table as a person types them; a count has none.
_TYPED_UNITS = {"1": "", "Ω": "ohm", "°": "deg"}


def number(
    unit: str,
    default: Any = ...,
    *,
    above: float | None = None,
    below: float | None = None,
    at_least: float | None = None,
    up_to: float | None = None,
    description: str | None = None,
) -> Any:
    """Return a field that takes a number of this unit within bounds, and nothing that merely looks like one."""
    return Field(
        default,
        gt=above,
        lt=below,
        ge=at_least,
        le=up_to,
        strict=True,
        description=description,
        json_schema_extra={"unit": unit},
    )


#: Fields of the table that the nameplate of procedures takes otherwise, or not at all.
_NOT_OF_THE_PLATE = ("wire_colours", "photo")


class WireColours(Section):
    """Colour of each terminal's wire."""

    A: str = ""
    B: str = ""
    C: str = ""


class NameplateSection(Section):
    """`[nameplate]`: plate and data sheet; currents are phase, peak."""

    name: str = Field(min_length=1, description="the motor's name, text in quotes")
    connection: WindingConnection
    rated_current: float = number("A", above=0.0, up_to=1e4, description="phase, peak")
    maximum_current: float | None = number("A", None, above=0.0, up_to=1e4, description="phase, peak")
    rated_speed_rpm: float | None = number("rpm", None, above=0.0, up_to=1e6)
    rated_voltage: float | None = number("V", None, above=0.0, up_to=1e4)
    maximum_voltage: float | None = number("V", None, above=0.0, up_to=1e4)
    pole_pairs: int | None = number("", None, at_least=1, up_to=200)
    maximum_speed_rpm: float | None = number("rpm", None, above=0.0, up_to=1e6)
    maximum_winding_temperature: float | None = number("°C", None, at_least=-40.0, up_to=300.0)
    wire_colours: WireColours = WireColours()
    serial_number: str = ""
    photo: str = Field(default="", max_length=255, description="the name of a JPEG or PNG file beside this one")
    insulation_test_voltage: float | None = number(
        "V", None, above=0.0, up_to=1e4, description="DC, between winding and frame"
    )
    hall_sensors: bool | None = None

    @model_validator(mode="after")
    def _consistent(self) -> "NameplateSection":
        if self.maximum_current is not None and self.maximum_current < self.rated_current:
            raise ValueError(
                text(
                    "maximum_current = {maximum_current:g} A is below rated_current = {rated_current:g} A; "
                    "both are phase, peak",
                    maximum_current=self.maximum_current,
                    rated_current=self.rated_current,
                )
            )
        if None not in (self.maximum_speed_rpm, self.rated_speed_rpm) and (
            (self.maximum_speed_rpm or 0.0) < (self.rated_speed_rpm or 0.0)
        ):
            raise ValueError(
                text(
                    "maximum_speed_rpm = {maximum_speed_rpm:g} is below rated_speed_rpm = {rated_speed_rpm:g}",
                    maximum_speed_rpm=self.maximum_speed_rpm,
                    rated_speed_rpm=self.rated_speed_rpm,
                )
            )
        if self.maximum_voltage is not None and self.maximum_voltage < (self.rated_voltage or 0.0):
            raise ValueError(
                text(
                    "maximum_voltage = {maximum_voltage:g} V is below rated_voltage = {rated_voltage:g} V",
                    maximum_voltage=self.maximum_voltage,
                    rated_voltage=self.rated_voltage,
                )
            )
        return self

    def nameplate(self, expected: "ExpectedSection", tolerance: Mapping[str, float]) -> Nameplate:
        """Return it as procedures see it, with the type values and tolerances of the same file."""
        return Nameplate(
            **{name: getattr(self, name) for name in NameplateSection.model_fields if name not in _NOT_OF_THE_PLATE},
            wire_colours={terminal: colour for terminal, colour in self.wire_colours.model_dump().items() if colour},
            expected=expected.values(),
            tolerance=dict(tolerance),
        )


class ExpectedSection(Section):
    """`[expected]`: type values by parameter name, in the unit and by the convention in which results give them.

    It has the fields of the parameters in the model that `with_type_values` makes.
    """

    def values(self) -> dict[str, float]:
        """Return what was given."""
        return {name: float(value) for name, value in self.model_dump().items() if value is not None}


#: `[tolerance]`: how far a motor may be from its type's value, by parameter name, as a share of that value.
Tolerances = dict[str, Annotated[float, Field(gt=0.0, le=1.0)]]


class TypedMotor(Section):
    """The optional sections of every motor file about its type."""

    expected: ExpectedSection = ExpectedSection()
    tolerance: Tolerances = Field(default_factory=dict)

    @model_validator(mode="after")
    def _tolerances_have_values(self) -> Self:
        for name in self.tolerance:
            if getattr(self.expected, name, None) is None:
                raise ValueError(text("tolerance.{name} is a share of expected.{name}, which is missing", name=name))
        return self


def with_type_values(model: type[S], data: Mapping[str, Any], procedures: "Procedures | None" = None) -> type[S]:
    """Return the model of a motor file, its `[expected]` with a field for every known parameter.

    The parameters that `procedures`, else the installed ones, define of their own are looked for where the table has not all
    that `data` names.
    """
    given = data.get("expected")
    if not isinstance(given, Mapping) or given.keys() <= PARAMETERS.keys():
        return _of_table(model)
    # Only these need the procedures, whose import takes long.
    from procedures.known_parameters import known_parameters

    return _with_fields(model, known_parameters(procedures))


@cache
def _of_table(model: type[S]) -> type[S]:
    return _with_fields(model, PARAMETERS)


def _with_fields(model: type[S], table: ParameterTable) -> type[S]:
    fields: Any = {each.name: _type_value(each) for each in table.values() if each.type_value}
    section = create_model("ExpectedSection", __base__=ExpectedSection, **fields)
    return create_model(model.__name__, __base__=model, expected=(section, section()))


def _type_value(definition: ParameterDefinition) -> tuple[Any, Any]:
    bounds = definition.bounds
    field = number(
        _TYPED_UNITS.get(definition.unit, definition.unit),
        None,
        above=bounds.low if bounds.open else None,
        at_least=None if bounds.open else bounds.low,
        up_to=bounds.high,
        description=definition.convention or None,
    )
    return (int if definition.whole else float) | None, field
