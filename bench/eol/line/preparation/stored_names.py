"""Names that every record of a batch carries: what no database would take is refused before the first motor."""

import re
from collections.abc import Iterator

from sqlalchemy import Column, String

from bench.eol.line.preparation.line_file import ProductionLine
from bench.eol.plan import Plan
from bench.eol.store.schema import MOTOR
from bench.i18n.errors import FileError, UsageError
from bench.motor.motor_file import MotorFile
from drivers.interfaces.text import Text, text

_BATCH_NAME = re.compile(r"[\w][\w.-]{0,99}")
_ALLOWED = text("allowed are up to 100 letters, digits, dots, hyphens and underscores")


def check_names(plan: Plan, motor: MotorFile, line: ProductionLine) -> None:
    """Raise InputError for a name of the plan, the motor's type, the line or a socket that no database keeps."""
    for source, key, name, column in _names(plan, motor, line):
        if fault := _fault(name, column):
            raise FileError(text("{source}: {key} = {name!r}: {fault}", source=source, key=key, name=name, fault=fault))


def check_batch_name(given: str, plan: Plan) -> None:
    """Raise UsageError for a batch's name, given or else its plan's, that is no folder's."""
    if not given:
        if fault := plan_name_fault(plan):
            raise UsageError(fault)
    elif not _BATCH_NAME.fullmatch(given):
        raise UsageError(text("--batch {name!r}: {allowed}", name=given, allowed=_ALLOWED))


def plan_name_fault(plan: Plan) -> Text | None:
    """Return why a plan's name can be no batch's, None where it can."""
    if _BATCH_NAME.fullmatch(plan.name):
        return None
    return text(
        "{source}: plan.name = {name!r} cannot be the batch's name, too: {allowed}; give --batch NAME",
        source=plan.source,
        name=plan.name,
        allowed=_ALLOWED,
    )


def check_person(person: str) -> None:
    """Raise UsageError for a person's name that no database keeps."""
    if fault := _fault(person or "-", MOTOR.c.person):
        raise UsageError(text("--person {person!r}: {fault}", person=person, fault=fault))


def _names(plan: Plan, motor: MotorFile, line: ProductionLine) -> Iterator[tuple[str, str, str, Column[str]]]:
    yield plan.source, "plan.name", plan.name, MOTOR.c.plan
    yield motor.source, "nameplate.name", motor.nameplate.name, MOTOR.c.model
    yield line.source, "line.name" if line.is_virtual else "station.name", line.name, MOTOR.c.station
    for socket in line.sockets:
        yield line.source, "sockets", socket.name, MOTOR.c.socket


def _fault(name: str, column: Column[str]) -> Text | None:
    """Return why a name cannot be kept in a column, None where it can."""
    kind = column.type
    most = (kind.length if isinstance(kind, String) else None) or 0
    if len(name) <= most and name.isprintable() and name.strip():
        return None
    return text("allowed are 1 to {most} printable characters", most=most)
