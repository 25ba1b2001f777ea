"""`[[way_down]]`: the ordered list by which a station becomes harmless."""

from collections.abc import Iterable, Mapping

from pydantic import Field

from bench.i18n.errors import InputError, at, said_by
from bench.files.toml_file import Section
from bench.safety.shutdown_sequence import WayDown
from bench.station.shutdown_items import (OFF_BY, Do, default_items, item)
from procedures.core.bench import Role
from drivers.interfaces.text import text


class WayDownSection(Section):
    """One item of the list."""

    do: Do
    role: Role
    below: float | None = Field(default=None, gt=0.0, description="V, A or rad/s, for an item that measures")
    within: float | None = Field(
        default=None, ge=0.0, le=3600.0, json_schema_extra={"unit": "s"}, description="for an item that measures"
    )


def way_down_of(given: Iterable[WayDownSection], roles: Mapping[Role, bool], source: str) -> WayDown:
    """Return a station's list, the usual one where it gives none; `roles` says of each whether a person does it.

    Raises InputError for an item that cannot be done, and for a list that leaves something energised.
    """
    by_hand = frozenset(role for role, manual in roles.items() if manual)
    items = []
    for number, one in enumerate(given):
        key = f"{source}: way_down[{number}]"
        if one.role not in roles:
            raise InputError(
                text("{key}.role = {role!r}: the station has no [instruments.{role}]", key=key, role=one.role.value)
            )
        try:
            items.append(item(one.do, one.role, one.below, one.within))
        except ValueError as error:
            raise InputError(at(key, said_by(error))) from error
    if not items:
        return WayDown(default_items(by_hand), by_hand)
    present = {(one.do, one.role) for one in items}
    for role, off in OFF_BY.items():
        if role in roles and (off, role) not in present:
            raise InputError(
                text(
                    "{source}: [[way_down]] leaves [instruments.{role}] energised; "
                    'add an item with do = "{off}" and role = "{role}", or leave the whole list out',
                    source=source,
                    role=role.value,
                    off=off.value,
                )
            )
    return WayDown(tuple(items), by_hand)
