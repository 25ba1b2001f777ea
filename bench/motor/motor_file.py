"""The motor's file: what a technician knows of it, and for a virtual motor the truth."""

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, field_validator
from pydantic_core import PydanticCustomError

from bench.files.photo import Photo, photo_beside
from bench.files.toml_file import Section, parse, validate
from bench.i18n.errors import InputError, at
from bench.motor.motor_insides import InsideSection
from bench.motor.motor_sections import NameplateSection, TypedMotor, number, with_type_values
from bench.motor.shipped_motors import motor_content
from bench.motor.six_step_file import drive_file_of, holds_drive
from drivers.interfaces.text import text, text_of
from procedures.core.nameplate import Nameplate, WindingConnection
from procedures.core.parameters import PARAMETERS
from sim_instruments.physics.bearing import Bearing
from sim_instruments.physics.iron import Iron
from sim_instruments.physics.motor import VirtualMotor
from sim_instruments.physics.shorted_turns import ShortedTurns
from sim_instruments.six_step.drive import SixStepDrive
from sim_instruments.six_step.machine import virtual_motor

if TYPE_CHECKING:
    from procedures.known_parameters import Procedures

Resistance = Annotated[float, Field(gt=0.0, le=1e4, strict=True)]
Share = Annotated[float, Field(ge=0.0, le=2.0, strict=True)]
TurnShare = Annotated[float, Field(gt=0.0, le=2.0, strict=True)]


class FluxHarmonic(Section):
    """One harmonic of the EMF: its order, its amplitude relative to the fundamental's, its phase (rad)."""

    order: int = number("", at_least=2, up_to=100)
    amplitude: float = number("", at_least=0.0, up_to=1.0, description="relative to the fundamental of the EMF")
    phase: float = number("rad", 0.0, at_least=-2.0 * math.pi, up_to=2.0 * math.pi)


class BearingSection(Section):
    """`[virtual.bearing]`: drag beside Coulomb and viscous friction."""

    windage: float = number(
        "N·m·s²/rad²", 0.0, at_least=0.0, up_to=1e3, description="drag over the square of the speed"
    )
    stribeck_torque: float = number(
        "N·m", 0.0, at_least=0.0, up_to=1e3, description="on top of Coulomb friction at standstill"
    )
    stribeck_speed: float = number("rad/s", 10.0, above=0.0, up_to=1e5, description="at which a 1/e of it is left")
    stribeck_exponent: float = number("", 1.0, at_least=0.5, up_to=4.0)
    cogging_while_turning: bool = Field(
        default=False,
        strict=True,
        description="true or false: whether the shaft feels its cogging while it coasts or is driven as well",
    )


class IronSection(Section):
    """`[virtual.iron]`: eddy currents, and what speed does to the flux linkage."""

    eddy_coupling: float = number("", 0.0, at_least=0.0, below=1.0, description="share of the flux, k")
    eddy_resistance: float = number("ohm", 1.0, above=0.0, up_to=1e6, description="of a winding's shorted turn")
    emf_corner: float | None = number("Hz", None, above=0.0, up_to=1e7, description="electrical; without it none")
    magnet_rise: float = number("K", 0.0, at_least=0.0, up_to=300.0, description="of the magnets over the winding")
    magnet_rise_speed: float = number("rad/s", 100.0, above=0.0, up_to=1e5, description="mechanical, at which it holds")

    def iron(self) -> Iron:
        """Return it as the virtual motor takes it."""
        corner = math.inf if self.emf_corner is None else self.emf_corner
        return Iron(self.eddy_coupling, self.eddy_resistance, corner, self.magnet_rise, self.magnet_rise_speed)


class ShortedTurnsSection(Section):
    """`[virtual.shorted_turns]`: turns of one winding that are shorted."""

    winding: Literal["A", "B", "C"] = Field(description="A, B or C; of a delta AB, BC, CA")
    share: float = number("", above=0.0, below=1.0, description="of the winding's turns")
    resistance: float = number("ohm", 0.0, at_least=0.0, up_to=1e6, description="of what shorts them")

    def turns(self) -> ShortedTurns:
        """Return them as the virtual motor takes them."""
        return ShortedTurns("ABC".index(self.winding), self.share, self.resistance)


class VirtualSection(InsideSection):
    """`[virtual]`: the truth of a virtual motor, SI; for a delta the values are those of one winding."""

    phase_resistance: tuple[Resistance, Resistance, Resistance] = Field(
        description="a number above 0 and up to 10000 ohm for all three windings, or a list of three such numbers",
        json_schema_extra={"unit": "ohm"},
    )
    resistance_temperature: float = number("°C", 25.0, at_least=-40.0, up_to=300.0)
    d_axis_inductance: float = number("H", above=0.0, up_to=10.0)
    q_axis_inductance: float = number("H", above=0.0, up_to=10.0)
    zero_sequence_inductance: float | None = number("H", None, above=0.0, up_to=10.0)
    flux_linkage: float = number("V·s/rad", above=0.0, up_to=100.0, description="peak, per electrical radian")
    flux_harmonics: tuple[FluxHarmonic, ...] = ()
    pole_pairs: int = number("", at_least=1, up_to=200)
    inertia: float = number("kg·m²", above=0.0, up_to=1e3)
    coulomb_friction: float = number("N·m", 0.0, at_least=0.0, up_to=1e3)
    viscous_friction: float = number("N·m·s/rad", 0.0, at_least=0.0, up_to=1e3)
    cogging_torque: float = number("N·m", 0.0, at_least=0.0, up_to=1e3, description="amplitude")
    cogging_order: int = number("", 12, at_least=1, up_to=10_000, description="periods a turn")
    cogging_phase: float = number("rad", 0.0, at_least=-2.0 * math.pi, up_to=2.0 * math.pi, description="at angle zero")
    emf_shares: tuple[Share, Share, Share] = Field(
        (1.0, 1.0, 1.0),
        description="a list of three numbers from 0 to 2: each winding's EMF as a share of flux_linkage's",
        json_schema_extra={"unit": ""},
    )
    turn_shares: tuple[TurnShare, TurnShare, TurnShare] = Field(
        (1.0, 1.0, 1.0),
        description="a list of three numbers above 0, up to 2: each winding's turns, which inductances and EMF follow",
        json_schema_extra={"unit": ""},
    )
    shorted_turns: ShortedTurnsSection | None = None
    rubbing_torque: float = number("N·m", 0.0, at_least=0.0, up_to=1e3, description="drag once a turn, at the most")
    temperature_coefficient: float = number("1/K", 0.00393, at_least=0.0, up_to=0.1, description="copper's at 20 °C")
    flux_temperature_coefficient: float = number("1/K", -0.001, at_least=-0.1, up_to=0.1)
    thermal_resistance: float = number("K/W", 0.5, at_least=0.0, up_to=1e3)
    thermal_time_constant: float = number("s", 600.0, above=0.0, up_to=1e6)
    # As Saturation's law takes it: the q axis' differential inductance has halved there.
    d_axis_saturation_current: float | None = number(
        "A", None, above=0.0, up_to=1e5, description="peak, of the Y-equivalent; without it the axis does not saturate"
    )
    q_axis_saturation_current: float | None = number(
        "A", None, above=0.0, up_to=1e5, description="peak, of the Y-equivalent; without it the axis does not saturate"
    )

    bearing: BearingSection = BearingSection()
    iron: IronSection = IronSection()

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

    def motor(self, connection: WindingConnection) -> VirtualMotor:
        """Return it as the virtual bench takes it."""
        own = VirtualSection.model_fields.keys() - InsideSection.model_fields.keys()
        values = {**{name: getattr(self, name) for name in own}, **self.insides()}
        values["phase_resistances"] = values.pop("phase_resistance")
        values["flux_harmonics"] = tuple((h.order, h.amplitude, h.phase) for h in self.flux_harmonics)
        for axis in ("d_axis_saturation_current", "q_axis_saturation_current"):
            # An axis that the file says nothing of does not saturate.
            values[axis] = math.inf if values[axis] is None else values[axis]
        values["bearing"], values["iron"] = Bearing(**self.bearing.model_dump()), self.iron.iron()
        values["shorted_turns"] = None if self.shorted_turns is None else self.shorted_turns.turns()
        name: Literal["wye", "delta"] = "delta" if connection is WindingConnection.DELTA else "wye"
        return VirtualMotor(connection=name, **values)


class _File(TypedMotor):
    nameplate: NameplateSection
    virtual: VirtualSection | None = None


@dataclass(frozen=True)
class MotorFile:
    """A motor file that was read: its plate, the truth of a virtual motor where it holds one, and what identifies it.

    `six_step` is the drive of a BLDC file, whose machine the virtual motor then is; `photo` stands beside the file.
    """

    source: str
    content: str
    sha256: str
    nameplate: Nameplate
    virtual: VirtualMotor | None
    six_step: SixStepDrive | None = None
    photo: Photo | None = None

    def virtual_motor(self) -> VirtualMotor:
        """Return the virtual motor. Raises InputError where the file has none."""
        if self.virtual is None:
            raise InputError(
                text(
                    "{source}: the virtual bench needs the motor's truth and the file has none; "
                    "add a table [virtual] with phase_resistance, d_axis_inductance, q_axis_inductance, flux_linkage, "
                    "pole_pairs and inertia",
                    source=self.source,
                )
            )
        return self.virtual


def load_motor(reference: str, procedures: "Procedures | None" = None) -> MotorFile:
    """Return a motor by its file, or by its name for one that comes with the program.

    Its type values may be of any parameter that `procedures`, usually the installed ones, give.
    Raises InputError for a file that cannot be read or is not right, naming key, value and allowed range.
    """
    source, content, data = motor_content(reference)
    read = _motor(content, data, source, procedures)
    return replace(read, photo=photo_beside(source, "nameplate.photo", data["nameplate"].get("photo", "")))


def recorded_motor(content: str, source: str) -> MotorFile:
    """Return the motor of a file's text as a run's journal keeps it. Raises InputError where it is not right.

    Type values of parameters that the table has not are taken as they stand: the plug-in that defined them may be gone.
    """
    raw = content.encode("utf-8")
    data = parse(raw, source)
    given = data.get("expected")
    if not isinstance(given, Mapping):
        return _motor(raw, data, source, None)
    own = {name: value for name, value in given.items() if name not in PARAMETERS and isinstance(value, int | float)}
    ours = {name: value for name, value in given.items() if name not in own}
    tolerance = dict(data.get("tolerance", {}))
    of_own = {name: tolerance.pop(name) for name in own if name in tolerance}
    read = _motor(raw, {**data, "expected": ours, "tolerance": tolerance}, source, None)
    plate = read.nameplate
    plate = replace(plate, expected={**plate.expected, **own}, tolerance={**plate.tolerance, **of_own})
    return replace(read, nameplate=plate)


def _motor(content: bytes, data: Mapping[str, Any], source: str, procedures: "Procedures | None") -> MotorFile:
    if holds_drive(data):
        drive_file = drive_file_of(data, source, procedures)
        drive = drive_file.drive
        nameplate = drive_file.nameplate.nameplate(drive_file.expected, drive_file.tolerance)
        return _made(content, source, nameplate, replace(virtual_motor(drive), **drive_file.insides), drive)
    file = validate(with_type_values(_File, data, procedures), data, source)
    try:
        motor = file.virtual.motor(file.nameplate.connection) if file.virtual else None
    except ValueError as error:
        raise InputError(at(f"{source}: virtual", text_of(error))) from None
    return _made(content, source, file.nameplate.nameplate(file.expected, file.tolerance), motor, None)


def _made(
    content: bytes,
    source: str,
    nameplate: Nameplate,
    virtual: VirtualMotor | None,
    six_step: SixStepDrive | None,
) -> MotorFile:
    return MotorFile(
        source=source,
        content=content.decode("utf-8"),
        sha256=hashlib.sha256(content).hexdigest(),
        nameplate=nameplate,
        virtual=virtual,
        six_step=six_step,
    )
