"""The motor file of a BLDC drive: its winding, its mechanics and its bridge."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bench.files.toml_file import Section, validate
from bench.i18n.errors import FileError, at
from bench.i18n.simulated import simulation_error
from bench.motor.motor_insides import InsideSection
from bench.motor.motor_sections import ExpectedSection, NameplateSection, TypedMotor, number, with_type_values
from bench.motor.shipped_motors import motor_content
from drivers.interfaces.text import text
from sim_instruments.six_step.drive import EmfHarmonic, SixStepDrive, SixStepError

if TYPE_CHECKING:
    from procedures.known_parameters import Procedures

#: A file in which every table of a drive can be seen.
EXAMPLE = "92bl-30-25l"
_TABLES = ("winding", "drive")


class HarmonicSection(Section):
    """One harmonic of a winding's EMF k·ω·cos(φ): it adds k·ω·amplitude·cos(order·φ + phase)."""

    order: int = number("", at_least=3, up_to=99, description="odd")
    amplitude: float = number("", at_least=-1.0, up_to=1.0, description="relative to the fundamental")
    phase: float = number("rad", 0.0, at_least=-2 * math.pi, up_to=2 * math.pi)


class WindingSection(Section):
    """`[virtual.winding]`: one winding of a delta or one phase of a wye."""

    resistance: float = number("ohm", above=0.0, up_to=1e4)
    self_inductance: float = number("H", above=0.0, up_to=10.0)
    mutual_inductance: float = number("H", at_least=-10.0, up_to=10.0, description="with its sign")


class DriveSection(Section):
    """`[virtual.drive]`: bridge and source."""

    source_voltage: float = number("V", above=0.0, up_to=1e4)
    source_resistance: float = number("ohm", at_least=0.0, up_to=1e4)
    switch_resistance: float = number("ohm", at_least=0.0, up_to=1e3)
    diode_drop: float = number("V", at_least=0.0, up_to=10.0)
    advance_angle_degrees: float = number("° electrical", 0.0, above=-90.0, below=90.0)


class DriveMotorSection(InsideSection):
    """`[virtual]` of a BLDC drive."""

    emf_constant: float = number("V/(rad/s)", above=0.0, up_to=1e3, description="peak of one winding, mechanical speed")
    pole_pairs: int = number("", at_least=1, up_to=200)
    inertia: float = number("kg·m²", above=0.0, up_to=1e3)
    coulomb_friction: float = number("N·m", 0.0, at_least=0.0, up_to=1e3)
    viscous_friction: float = number("N·m/(rad/s)", 0.0, at_least=0.0, up_to=1e3)
    emf_harmonics: tuple[HarmonicSection, ...] = ()
    winding: WindingSection
    drive: DriveSection


class DriveFile(TypedMotor):
    """A whole motor file of a BLDC drive."""

    nameplate: NameplateSection
    virtual: DriveMotorSection

    def six_step_drive(self) -> SixStepDrive:
        """Return the drive as the simulation takes it. Raises SixStepError for values that do not go together."""
        virtual, winding, drive = self.virtual, self.virtual.winding, self.virtual.drive
        return SixStepDrive(
            connection="delta" if self.nameplate.connection.value == "delta" else "wye",
            resistance=winding.resistance,
            self_inductance=winding.self_inductance,
            mutual_inductance=winding.mutual_inductance,
            emf_constant=virtual.emf_constant,
            pole_pairs=virtual.pole_pairs,
            source_voltage=drive.source_voltage,
            source_resistance=drive.source_resistance,
            switch_resistance=drive.switch_resistance,
            diode_drop=drive.diode_drop,
            inertia=virtual.inertia,
            coulomb_friction=virtual.coulomb_friction,
            viscous_friction=virtual.viscous_friction,
            emf_harmonics=tuple(EmfHarmonic(h.order, h.amplitude, h.phase) for h in virtual.emf_harmonics),
            advance_angle=math.radians(drive.advance_angle_degrees),
        )


@dataclass(frozen=True)
class ReadDriveFile:
    """A BLDC drive's file that was read: its plate, its type values and tolerances, the drive, and by name what else is inside."""

    nameplate: NameplateSection
    expected: ExpectedSection
    tolerance: Mapping[str, float]
    drive: SixStepDrive
    insides: Mapping[str, Any]


def holds_drive(data: Mapping[str, Any]) -> bool:
    """Return whether a motor file has a table of a six-step drive."""
    virtual = data.get("virtual")
    return isinstance(virtual, Mapping) and any(name in virtual for name in _TABLES)


def drive_file_of(data: Mapping[str, Any], source: str, procedures: "Procedures | None" = None) -> ReadDriveFile:
    """Return what a BLDC drive's file holds, its type values being of parameters of the table and of `procedures`.

    Raises InputError naming key, value and allowed range.
    """
    virtual = data.get("virtual")
    missing = [name for name in _TABLES if not isinstance(virtual, Mapping) or name not in virtual]
    if missing:
        tables = " and ".join(f"[virtual.{name}]" for name in missing)
        raise FileError(
            text(
                "{source}: no six-step drive is described: {tables} missing; see {example} for an example",
                source=source,
                tables=tables,
                example=EXAMPLE,
            )
        )
    file = validate(with_type_values(DriveFile, data, procedures), data, source)
    plate, truth = file.nameplate.pole_pairs, file.virtual.pole_pairs
    if plate is not None and plate != truth:
        raise FileError(
            text(
                "{source}: nameplate.pole_pairs = {plate} and virtual.pole_pairs = {truth}; give the same number",
                source=source,
                plate=plate,
                truth=truth,
            )
        )
    try:
        return ReadDriveFile(
            file.nameplate, file.expected, file.tolerance, file.six_step_drive(), file.virtual.insides()
        )
    except SixStepError as error:
        raise FileError(at(f"{source}: virtual", simulation_error(error))) from None


def load_drive(reference: str) -> SixStepDrive:
    """Return a drive by its motor file, or by its name for one that comes with the program.

    Raises InputError for a file that cannot be read or is not right, naming key, value and allowed range.
    """
    source, _, data = motor_content(reference)
    return drive_file_of(data, source).drive
