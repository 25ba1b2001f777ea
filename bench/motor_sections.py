"""What every motor file has: the nameplate, and how a number of a file is described."""

from typing import Any

from pydantic import Field, model_validator

from bench.toml_file import Section
from procedures.nameplate import Connection, Nameplate


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


class WireColours(Section):
    """Colour of each terminal's wire."""

    A: str = ""
    B: str = ""
    C: str = ""


class NameplateSection(Section):
    """`[nameplate]`: plate and data sheet; currents are phase, peak."""

    name: str = Field(min_length=1, description="the motor's name, text in quotes")
    connection: Connection
    rated_current: float = number("A", above=0.0, up_to=1e4, description="phase, peak")
    maximum_current: float | None = number("A", None, above=0.0, up_to=1e4, description="phase, peak")
    rated_speed_rpm: float | None = number("rpm", None, above=0.0, up_to=1e6)
    rated_voltage: float | None = number("V", None, above=0.0, up_to=1e4)
    pole_pairs: int | None = number("", None, at_least=1, up_to=200)
    maximum_speed_rpm: float | None = number("rpm", None, above=0.0, up_to=1e6)
    maximum_winding_temperature: float | None = number("°C", None, at_least=-40.0, up_to=300.0)
    wire_colours: WireColours = WireColours()
    serial_number: str = ""

    @model_validator(mode="after")
    def _consistent(self) -> "NameplateSection":
        if self.maximum_current is not None and self.maximum_current < self.rated_current:
            raise ValueError(
                f"maximum_current = {self.maximum_current:g} A is below rated_current = {self.rated_current:g} A; "
                "both are phase, peak"
            )
        if None not in (self.maximum_speed_rpm, self.rated_speed_rpm) and (
            (self.maximum_speed_rpm or 0.0) < (self.rated_speed_rpm or 0.0)
        ):
            raise ValueError(
                f"maximum_speed_rpm = {self.maximum_speed_rpm:g} is below rated_speed_rpm = {self.rated_speed_rpm:g}"
            )
        return self

    def nameplate(self) -> Nameplate:
        """Return it as procedures see it."""
        return Nameplate(
            **{name: getattr(self, name) for name in NameplateSection.model_fields if name != "wire_colours"},
            wire_colours={terminal: colour for terminal, colour in self.wire_colours.model_dump().items() if colour},
        )
