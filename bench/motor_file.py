"""The motor's file: what a technician knows of it, and for a virtual motor the truth."""

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator
from pydantic_core import PydanticCustomError

from bench.errors import InputError
from bench.toml_file import Section, nearest, parse, read, validate
from procedures.nameplate import Connection, Nameplate
from sim_instruments.physics.motor import VirtualMotor

#: Tables of a BLDC drive's file, which the six-step simulation reads; they make no motor for the bench.
_SIX_STEP_TABLES = frozenset({"winding", "drive"})


def _number(
    unit: str,
    default: Any = ...,
    *,
    above: float | None = None,
    at_least: float | None = None,
    up_to: float | None = None,
    description: str | None = None,
) -> Any:
    """Return a field that takes a number of this unit within bounds, and nothing that merely looks like one."""
    return Field(
        default,
        gt=above,
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
    rated_current: float = _number("A", above=0.0, up_to=1e4, description="phase, peak")
    maximum_current: float | None = _number("A", None, above=0.0, up_to=1e4, description="phase, peak")
    rated_speed_rpm: float | None = _number("rpm", None, above=0.0, up_to=1e6)
    rated_voltage: float | None = _number("V", None, above=0.0, up_to=1e4)
    pole_pairs: int | None = _number("", None, at_least=1, up_to=200)
    maximum_speed_rpm: float | None = _number("rpm", None, above=0.0, up_to=1e6)
    maximum_winding_temperature: float | None = _number("°C", None, at_least=-40.0, up_to=300.0)
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


#: Of the Y-equivalent, as Saturation's law takes it: the q axis' differential inductance has halved there.
_SATURATION = "peak, of the Y-equivalent; without it the axis does not saturate"

Resistance = Annotated[float, Field(gt=0.0, le=1e4, strict=True)]


class FluxHarmonic(Section):
    """One harmonic of the EMF: its order, its amplitude relative to the fundamental's, its phase (rad)."""

    order: int = _number("", at_least=2, up_to=100)
    amplitude: float = _number("", at_least=0.0, up_to=1.0, description="relative to the fundamental of the EMF")
    phase: float = _number("rad", 0.0, at_least=-2.0 * math.pi, up_to=2.0 * math.pi)


class VirtualSection(Section):
    """`[virtual]`: the truth of a virtual motor, SI; for a delta the values are those of one winding."""

    phase_resistance: tuple[Resistance, Resistance, Resistance] = Field(
        description="a number above 0 and up to 10000 ohm for all three windings, or a list of three such numbers",
        json_schema_extra={"unit": "ohm"},
    )
    resistance_temperature: float = _number("°C", 25.0, at_least=-40.0, up_to=300.0)
    d_axis_inductance: float = _number("H", above=0.0, up_to=10.0)
    q_axis_inductance: float = _number("H", above=0.0, up_to=10.0)
    zero_sequence_inductance: float | None = _number("H", None, above=0.0, up_to=10.0)
    flux_linkage: float = _number("V·s/rad", above=0.0, up_to=100.0, description="peak, per electrical radian")
    flux_harmonics: tuple[FluxHarmonic, ...] = ()
    pole_pairs: int = _number("", at_least=1, up_to=200)
    inertia: float = _number("kg·m²", above=0.0, up_to=1e3)
    coulomb_friction: float = _number("N·m", 0.0, at_least=0.0, up_to=1e3)
    viscous_friction: float = _number("N·m·s/rad", 0.0, at_least=0.0, up_to=1e3)
    cogging_torque: float = _number("N·m", 0.0, at_least=0.0, up_to=1e3, description="amplitude")
    cogging_order: int = _number("", 12, at_least=1, up_to=10_000, description="periods a turn")
    temperature_coefficient: float = _number("1/K", 0.00393, at_least=0.0, up_to=0.1, description="copper's at 20 °C")
    flux_temperature_coefficient: float = _number("1/K", -0.001, at_least=-0.1, up_to=0.1)
    thermal_resistance: float = _number("K/W", 0.5, at_least=0.0, up_to=1e3)
    thermal_time_constant: float = _number("s", 600.0, above=0.0, up_to=1e6)
    d_axis_saturation_current: float | None = _number("A", None, above=0.0, up_to=1e5, description=_SATURATION)
    q_axis_saturation_current: float | None = _number("A", None, above=0.0, up_to=1e5, description=_SATURATION)

    @field_validator("phase_resistance", mode="before")
    @classmethod
    def _three(cls, value: object) -> object:
        if isinstance(value, int | float) and not isinstance(value, bool):
            return (value, value, value)
        if isinstance(value, list):
            if len(value) != 3:
                raise PydanticCustomError("list_length", "a motor has three windings, not {n}", {"n": len(value)})
            for item in value:
                if isinstance(item, bool) or not isinstance(item, int | float):
                    raise PydanticCustomError("float_type", "not a number")
            return tuple(value)
        raise PydanticCustomError("float_type", "not a number")

    def motor(self, connection: Connection) -> VirtualMotor:
        """Return it as the virtual bench takes it."""
        values = {name: getattr(self, name) for name in VirtualSection.model_fields}
        values["phase_resistances"] = values.pop("phase_resistance")
        values["flux_harmonics"] = tuple((h.order, h.amplitude, h.phase) for h in self.flux_harmonics)
        for axis in ("d_axis_saturation_current", "q_axis_saturation_current"):
            # An axis that the file says nothing of does not saturate.
            values[axis] = math.inf if values[axis] is None else values[axis]
        name: Literal["wye", "delta"] = "delta" if connection is Connection.DELTA else "wye"
        return VirtualMotor(connection=name, **values)


class _File(Section):
    nameplate: NameplateSection
    virtual: VirtualSection | None = None


@dataclass(frozen=True)
class MotorFile:
    """A motor file that was read: its plate, the truth of a virtual motor where it holds one, and what identifies it."""

    source: str
    content: str
    sha256: str
    nameplate: Nameplate
    virtual: VirtualMotor | None

    def virtual_motor(self) -> VirtualMotor:
        """Return the virtual motor. Raises InputError where the file has none."""
        if self.virtual is None:
            raise InputError(
                f"{self.source}: the virtual bench needs the motor's truth and the file has none; "
                "add a table [virtual] with phase_resistance, d_axis_inductance, q_axis_inductance, flux_linkage, "
                "pole_pairs and inertia"
            )
        return self.virtual


def shipped_motors() -> tuple[str, ...]:
    """Return the names of the motors that come with the program."""
    folder = resources.files("bench") / "motors"
    return tuple(sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml")))


def load_motor(reference: str) -> MotorFile:
    """Return a motor by its file, or by its name for one that comes with the program.

    Raises InputError for a file that cannot be read or is not right, naming key, value and allowed range.
    """
    if reference in shipped_motors():
        content = (resources.files("bench") / "motors" / f"{reference}.toml").read_bytes()
        return _motor(content, parse(content, reference), reference)
    path = Path(reference)
    if not path.suffix and path.name == reference and not path.exists():
        raise InputError(f"there is no motor {reference!r}: {nearest(reference, shipped_motors())}; or give a file")
    content, data = read(path, "motor file")
    return _motor(content, data, str(path))


def _motor(content: bytes, data: Mapping[str, Any], source: str) -> MotorFile:
    virtual = data.get("virtual")
    if isinstance(virtual, dict) and _SIX_STEP_TABLES & virtual.keys():
        # Their reader checks the table; here it only means that there is no motor for the bench in it.
        data = {key: value for key, value in data.items() if key != "virtual"}
    file = validate(_File, data, source)
    try:
        motor = file.virtual.motor(file.nameplate.connection) if file.virtual else None
    except ValueError as error:
        raise InputError(f"{source}: virtual: {error}") from None
    return MotorFile(
        source=source,
        content=content.decode("utf-8"),
        sha256=hashlib.sha256(content).hexdigest(),
        nameplate=file.nameplate.nameplate(),
        virtual=motor,
    )
