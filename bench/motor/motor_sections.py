"""What every motor file has: the nameplate, and how a number of a file is described."""

from typing import Any

from pydantic import Field, model_validator

from bench.files.toml_file import Section
from drivers.interfaces.text import text
from procedures.core.nameplate import Connection, Nameplate


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
    maximum_voltage: float | None = number("V", None, above=0.0, up_to=1e4)
    pole_pairs: int | None = number("", None, at_least=1, up_to=200)
    maximum_speed_rpm: float | None = number("rpm", None, above=0.0, up_to=1e6)
    maximum_winding_temperature: float | None = number("°C", None, at_least=-40.0, up_to=300.0)
    wire_colours: WireColours = WireColours()
    serial_number: str = ""
    insulation_test_voltage: float | None = number(
        "V", None, above=0.0, up_to=1e4, description="DC, between winding and frame"
    )

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

    def nameplate(self, expected: "ExpectedSection") -> Nameplate:
        """Return it as procedures see it, with the type values of the same file."""
        return Nameplate(
            **{name: getattr(self, name) for name in NameplateSection.model_fields if name != "wire_colours"},
            wire_colours={terminal: colour for terminal, colour in self.wire_colours.model_dump().items() if colour},
            expected=expected.values(),
        )


class ExpectedSection(Section):
    """`[expected]`: type values by parameter name, in the unit and by the convention in which results give them."""

    pole_pairs: int | None = number("", None, at_least=1, up_to=200)
    stator_resistance: float | None = number("ohm", None, above=0.0, description="per phase of the Y-equivalent, 25 °C")
    d_axis_inductance: float | None = number("H", None, above=0.0, description="per phase of the Y-equivalent")
    q_axis_inductance: float | None = number("H", None, above=0.0, description="per phase of the Y-equivalent")
    flux_linkage: float | None = number("V·s/rad", None, above=0.0, description="peak, per electrical radian")
    back_emf_constant_mechanical: float | None = number("V·s/rad", None, above=0.0, description="peak, phase")
    back_emf_constant_v_per_krpm: float | None = number("V/krpm", None, above=0.0, description="peak, phase")
    back_emf_constant_v_per_rpm: float | None = number("V/rpm", None, above=0.0, description="peak, phase")
    torque_constant: float | None = number("N·m/A", None, above=0.0, description="per peak phase ampere")
    inertia: float | None = number("kg·m²", None, above=0.0)
    coulomb_friction: float | None = number("N·m", None, above=0.0)
    viscous_friction: float | None = number("N·m·s/rad", None, above=0.0)
    maximum_current: float | None = number("A", None, above=0.0, description="phase, peak")
    rated_speed: float | None = number("rpm", None, above=0.0)
    line_emf_constant: float | None = number("V·s/rad", None, above=0.0, description="peak, line to line")
    switch_resistance: float | None = number("ohm", None, above=0.0)
    equivalent_resistance: float | None = number("ohm", None, above=0.0)
    commutation_resistance: float | None = number("ohm", None, above=0.0)
    copper_resistance: float | None = number("ohm", None, above=0.0)
    resistance_unbalance: float | None = number("%", None, at_least=0.0, up_to=200.0, description="between lines")
    inductance_unbalance: float | None = number("%", None, at_least=0.0, up_to=200.0, description="between lines")
    phase_order: float | None = number("", None, at_least=-1.0, up_to=1.0, description="+1 for A, B, C; -1 for A, C, B")
    back_emf_unbalance: float | None = number("%", None, at_least=0.0, up_to=200.0)
    back_emf_angle_deviation: float | None = number("deg", None, at_least=0.0, up_to=180.0, description="electrical")
    insulation_resistance: float | None = number("ohm", None, above=0.0, description="winding to frame")
    no_load_current: float | None = number("A", None, at_least=0.0, description="phase, peak")
    no_load_bus_current: float | None = number("A", None, at_least=0.0, description="from the DC source")
    cogging_torque: float | None = number("N·m", None, at_least=0.0, description="peak to peak")
    hall_faults: float | None = number("", None, at_least=0.0, up_to=3.0)
    hall_offset: float | None = number("deg", None, at_least=-180.0, up_to=180.0, description="electrical")
    hall_spacing_deviation: float | None = number("deg", None, at_least=0.0, up_to=180.0, description="electrical")
    hall_duty_deviation: float | None = number("%", None, at_least=0.0, up_to=50.0, description="of a turn")
    back_emf_thd: float | None = number("%", None, at_least=0.0, up_to=1000.0)

    def values(self) -> dict[str, float]:
        """Return what was given."""
        return {name: float(value) for name, value in self.model_dump().items() if value is not None}
