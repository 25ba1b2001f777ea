"""The parameters that are known: those of the table, and those that the catalogue's procedures define of their own."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from procedures.catalogue import catalogue
from procedures.core.parameter_definition import ParameterDefinition, ParameterTable
from procedures.core.parameters import PARAMETERS

if TYPE_CHECKING:
    from procedures.core.procedure import Procedure

Procedures = Mapping[str, "type[Procedure[Any]]"]


def known_parameters(procedures: Procedures | None = None) -> ParameterTable:
    """Return every definition of some procedures, the installed ones where none are given; a name's first definition counts."""
    rows = dict(PARAMETERS)
    for procedure in (catalogue() if procedures is None else procedures).values():
        for name, definition in procedure.parameters.items():
            rows.setdefault(name, definition)
    return ParameterTable(rows.values())


def definition_of(name: str) -> ParameterDefinition | None:
    """Return the table's definition of a parameter, else that of an installed procedure; None where there is neither."""
    # Only a parameter that is not in the table needs the procedures, whose import takes long.
    return PARAMETERS[name] if name in PARAMETERS else known_parameters().get(name)


def givers(procedures: Procedures | None = None) -> Mapping[str, Sequence[str]]:
    """Return the names of the procedures, usually the installed ones, that give each parameter."""
    result: dict[str, list[str]] = {}
    for name, procedure in (catalogue() if procedures is None else procedures).items():
        for parameter in procedure.parameters:
            result.setdefault(parameter, []).append(name)
    return result
