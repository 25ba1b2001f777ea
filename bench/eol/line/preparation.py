"""A plan's checks as runs take them, held against its limits and the line's instruments before anything is measured."""

from collections.abc import Iterable, Sequence

from bench.eol.line.line_file import Line
from bench.eol.plan import Check, Plan
from bench.files.toml_file import nearest, validate
from bench.i18n.errors import InputError
from bench.operators.fixture import ROLES as FIXTURE_ROLES
from bench.run.plan import Planned, check_roles
from bench.station.station_file import Station
from bench.virtual.virtual_station import virtual_roles
from drivers.interfaces.text import text
from procedures.catalogue import catalogue


def planned_of(checks: Iterable[Check], source: str) -> list[Planned]:
    """Return checks as a run takes them. Raises InputError for settings that their procedure does not allow."""
    known = catalogue()
    return [
        Planned(
            check.name,
            known[check.name],
            validate(known[check.name].settings_type(), check.settings, source, f"procedure {check.name}: settings"),
        )
        for check in checks
    ]


def operator_of(wished: str, station: Station | None) -> str:
    """Return who does the hand work at a socket: as wished, else its fixture where it has one, else the usual one."""
    if wished or station is None:
        return wished
    return "fixture" if FIXTURE_ROLES & station.entries.keys() else ""


def check_parameters(plan: Plan, planned: Sequence[Planned]) -> None:
    """Raise InputError for a limit on a parameter that none of the plan's procedures gives."""
    given = sorted({name for each in planned for name in each.procedure.gives})
    for parameter in sorted(plan.limited):
        if parameter in given:
            continue
        owners = [name for name, procedure in catalogue().items() if parameter in procedure.gives]
        hint = text("add the procedure {names}", names=" or ".join(owners)) if owners else nearest(parameter, given)
        raise InputError(
            text(
                "{source}: limit on {parameter}: no procedure of the plan gives it; {hint}",
                source=plan.source,
                parameter=parameter,
                hint=hint,
            )
        )


def check_station(line: Line, planned: Sequence[Planned]) -> None:
    """Raise InputError where a socket has not the instruments that a procedure needs."""
    for socket in line.sockets:
        if socket.station is not None:
            check_roles(planned, socket.station)
            continue
        there = virtual_roles()
        for each in planned:
            missing = sorted(role.value for role in each.procedure.roles if role.value not in there)
            if missing:
                raise InputError(
                    text(
                        "{name} needs {names}, which the virtual bench has not",
                        name=each.name,
                        names=", ".join(missing),
                    )
                )
