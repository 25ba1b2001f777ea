"""The motor file: the nameplate data and, for a virtual motor, its true values."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.files.photo import Photo, photo_beside
from bench.files.toml_file import parse, validate
from bench.i18n.errors import FileError, at
from bench.i18n.hidden_signs import hidden_sign
from bench.i18n.simulated import simulation_error
from bench.motor.motor_sections import NameplateSection, TypedMotor, with_type_values
from bench.motor.shipped_motors import folder_of, motor_content
from bench.motor.six_step_file import drive_file_of, holds_drive
from bench.motor.virtual_section import MappedSection, VirtualSection
from drivers.interfaces.text import reason_of, text
from procedures.core.nameplate import Nameplate
from procedures.core.parameters import PARAMETERS
from sim_instruments.physics.motor.flux_map import FluxMap
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.six_step.drive import SixStepDrive
from sim_instruments.six_step.machine import virtual_motor

if TYPE_CHECKING:
    from procedures.known_parameters import Procedures


class _File(TypedMotor):
    nameplate: NameplateSection
    virtual: VirtualSection | None = None


class _MappedFile(TypedMotor):
    nameplate: NameplateSection
    virtual: MappedSection


#: As in a plan and at the command line (characters).
_LONGEST_SERIAL = 64


@dataclass(frozen=True)
class MotorFile:
    """A motor file that was read: its nameplate, the true values of a virtual motor if it contains one, and its identity.

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
            raise FileError(
                text(
                    "{source}: the virtual bench needs the motor's true values, but the file has none; add a "
                    "table [virtual] with phase_resistance, d_axis_inductance, q_axis_inductance, flux_linkage, "
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
    read = _motor(content, data, source, procedures, folder_of(reference))
    _refuse_hidden(read)
    return replace(read, photo=photo_beside(source, "nameplate.photo", data["nameplate"].get("photo", "")))


def _refuse_hidden(motor: MotorFile) -> None:
    """Raise FileError for a name or a serial number that cannot be read: it stands on screens, in reports and on labels.

    A run that has one is opened all the same.
    """
    for key, words in (("name", motor.nameplate.name), ("serial_number", motor.nameplate.serial_number)):
        hidden = hidden_sign(words)
        if hidden:
            raise FileError(
                text(
                    "{source}: nameplate.{key} = {words!r} contains the sign {sign}, which cannot be read; allowed are printable "
                    "characters on one line",
                    source=motor.source,
                    key=key,
                    words=words,
                    sign=hidden,
                )
            )
    if len(motor.nameplate.serial_number) > _LONGEST_SERIAL:
        raise FileError(
            text(
                "{source}: nameplate.serial_number has {count} characters; up to {longest} are allowed",
                source=motor.source,
                count=len(motor.nameplate.serial_number),
                longest=_LONGEST_SERIAL,
            )
        )


def recorded_motor(content: str, source: str) -> MotorFile:
    """Return the motor of a file's text as a run's journal keeps it. Raises InputError where it is not right.

    Type values of parameters that the table has not are taken as they stand: the plug-in that defined them may be gone. A virtual
    motor on a flux map has none here: its table stood beside the file.
    """
    raw = content.encode("utf-8")
    data = parse(raw, source)
    if _is_mapped(data):
        data = {name: table for name, table in data.items() if name != "virtual"}
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


def _is_mapped(data: Mapping[str, Any]) -> bool:
    virtual = data.get("virtual")
    return isinstance(virtual, Mapping) and "flux_map" in virtual


def _motor(
    content: bytes,
    data: Mapping[str, Any],
    source: str,
    procedures: "Procedures | None",
    folder: Path | None = None,
) -> MotorFile:
    """Return the motor; a flux map is looked for from a folder on."""
    if holds_drive(data):
        drive_file = drive_file_of(data, source, procedures)
        drive = drive_file.drive
        nameplate = drive_file.nameplate.nameplate(drive_file.expected, drive_file.tolerance)
        return _made(content, source, nameplate, replace(virtual_motor(drive), **drive_file.insides), drive)
    motor: VirtualMotor | None
    if _is_mapped(data):
        mapped = validate(with_type_values(_MappedFile, data, procedures), data, source)
        plate, motor = mapped.nameplate.nameplate(mapped.expected, mapped.tolerance), _on_map(mapped, source, folder)
        return _made(content, source, plate, motor, None)
    file = validate(with_type_values(_File, data, procedures), data, source)
    try:
        motor = file.virtual.motor(file.nameplate.connection) if file.virtual else None
    except ValueError as error:
        raise FileError(at(f"{source}: virtual", simulation_error(error))) from None
    return _made(content, source, file.nameplate.nameplate(file.expected, file.tolerance), motor, None)


def _on_map(file: _MappedFile, source: str, folder: Path | None) -> VirtualMotor:
    """Return the virtual motor on the map that its file names."""
    name = file.virtual.flux_map.file
    place = text("{source}: virtual.flux_map.file = {name!r}", source=source, name=name)
    try:
        flux_map = FluxMap.from_csv((folder or Path()) / name)
    except OSError as error:
        raise FileError(at(place, reason_of(error))) from None
    except ValueError as error:
        raise FileError(at(place, simulation_error(error))) from None
    try:
        return file.virtual.motor(file.nameplate.connection, flux_map)
    except ValueError as error:
        raise FileError(at(f"{source}: virtual", simulation_error(error))) from None


def _made(
    content: bytes,
    source: str,
    nameplate: Nameplate,
    virtual: VirtualMotor | None,
    six_step: SixStepDrive | None,
) -> MotorFile:
    if virtual is not None and nameplate.hall_sensors is None:
        nameplate = replace(nameplate, hall_sensors=virtual.halls is not None)
    return MotorFile(
        source=source,
        content=content.decode("utf-8"),
        sha256=hashlib.sha256(content).hexdigest(),
        nameplate=nameplate,
        virtual=virtual,
        six_step=six_step,
    )
