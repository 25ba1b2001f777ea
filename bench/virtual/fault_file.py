"""Faults to inject on a virtual bench: a TOML file of `[[faults]]`, or one a flag."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bench.files.toml_file import nearest, read, validate
from bench.i18n.errors import FileError, at
from bench.plugins.catalogues import installed
from bench.virtual.fault_phrase import parse_phrase
from drivers.interfaces.text import text
from procedures.core.bench import Role
from procedures.core.procedure import Procedure
from sim_instruments.faults.catalogue import kinds
from sim_instruments.faults.description import Description

_TABLE = "faults"
Procedures = Mapping[str, type[Procedure[Any]]]


@dataclass(frozen=True)
class GivenFault:
    """A fault, and where it was given: the file and the table, or the flag."""

    described: Description
    source: str


def given_faults(
    file: Path | None, phrases: Sequence[str] = (), procedures: Procedures | None = None
) -> tuple[GivenFault, ...]:
    """Return the faults of a file and of flags; `procedures` are those there are, usually the installed ones.

    Raises InputError with file, key and what is allowed for a bad one.
    """
    known = installed().procedures if procedures is None else procedures
    faults = [] if file is None else load_faults(file, known)
    return (*faults, *(_fault(parse_phrase(phrase), f'--fault "{phrase}"', "", known) for phrase in phrases))


def load_faults(path: Path, procedures: Procedures | None = None) -> list[GivenFault]:
    """Return the faults of a file, as `given_faults` does. Raises InputError with file, key and what is allowed."""
    known_procedures = installed().procedures if procedures is None else procedures
    _, data = read(path, text("fault file"))
    name = str(path)
    for key in data:
        if key != _TABLE:
            raise FileError(text("{name}: unknown key {key}; {hint}", name=name, key=key, hint=nearest(key, [_TABLE])))
    tables = data.get(_TABLE, [])
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables) or not tables:
        raise FileError(text("{name}: give at least one table [[{table}]]", name=name, table=_TABLE))
    return [_fault(table, name, f"{_TABLE}[{number}]", known_procedures) for number, table in enumerate(tables)]


def _fault(data: Mapping[str, Any], name: str, prefix: str, procedures: Procedures) -> GivenFault:
    source = f"{name}: {prefix}" if prefix else name
    known = kinds()
    kind = data.get("fault")
    if not isinstance(kind, str) or kind not in known:
        key = f"{prefix}." if prefix else ""
        if kind is None:
            raise FileError(
                text("{name}: {key}fault is missing; known are: {names}", name=name, key=key, names=sorted(known))
            )
        hint = nearest(str(kind), list(known))
        raise FileError(
            text("{name}: {key}fault {kind} is not known; {hint}", name=name, key=key, kind=repr(kind), hint=hint)
        )
    _check_role(data.get("role"), source)
    described = validate(known[kind], data, name, prefix)
    _check_step(described, source, procedures)
    return GivenFault(described, source)


def _check_role(role: object, source: str) -> None:
    """Raise FileError for an instrument that no bench has, before anything is said of what may be asked of it."""
    roles = [each.value for each in Role]
    if isinstance(role, str) and role not in roles:
        raise FileError(
            at(source, text("there is no instrument {role!r}; {hint}", role=role, hint=nearest(role, roles)))
        )


def _check_step(described: Description, source: str, procedures: Procedures) -> None:
    """Raise InputError for a step or a procedure that does not exist."""
    if described.step is None:
        return
    if described.procedure is not None and described.procedure not in procedures:
        raise FileError(
            text(
                "{source}: there is no procedure {procedure!r}; {hint}",
                source=source,
                procedure=described.procedure,
                hint=nearest(described.procedure, list(procedures)),
            )
        )
    owners = procedures if described.procedure is None else [described.procedure]
    steps = [step.identifier for owner in owners for step in procedures[owner].steps()]
    if described.step not in steps:
        # Of all procedures together there are more than anyone reads.
        far = None if described.procedure else text("motorbench procedures lists them")
        hint = nearest(described.step, list(dict.fromkeys(steps)), far)
        if described.procedure:
            message = text(
                "{name} has no step {step!r}; {hint}", name=described.procedure, step=described.step, hint=hint
            )
        else:
            message = text("there is no step {step!r}; {hint}", step=described.step, hint=hint)
        raise FileError(at(source, message))
