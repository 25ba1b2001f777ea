"""The shutdown sequence as data: what is done to which instrument, in which order; `[[way_down]]` of a station file."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from pydantic import Field

from bench.files.toml_file import Section
from bench.i18n.errors import FileError, at
from drivers.interfaces import Role
from drivers.interfaces.declarations import declarations
from drivers.interfaces.role import ROLES
from drivers.interfaces.text import text, text_of


class ShutdownAction(StrEnum):
    """The action of an item, as a station file writes it."""

    COMMAND_ZERO = "command_zero"
    DISABLE = "disable"
    OUTPUT_OFF = "output_off"
    BRAKE = "brake"
    SILENCE = "silence"
    VOLTAGE_DECAYED = "voltage_decayed"
    CURRENT_ZERO = "current_zero"
    SPEED_ZERO = "speed_zero"
    OPEN = "open"


_MEASURING: Mapping[ShutdownAction, tuple[Role, ...]] = {
    ShutdownAction.VOLTAGE_DECAYED: (Role.SUPPLY, Role.VOLTMETER),
    ShutdownAction.CURRENT_ZERO: (Role.SUPPLY,),
    ShutdownAction.SPEED_ZERO: (Role.DYNAMOMETER, Role.DRIVE, Role.INVERTER, Role.TACHOMETER),
}


def method_of(do: ShutdownAction, role: Role) -> str:
    """Return the method that does a commanding item to the instrument of a role, nothing where it cannot be done."""
    own = next((name for name, one in declarations(role.interface).items() if one.item == do.value), "")
    return own or ("make_safe" if ROLES[role].off_by == do.value else "")


#: Roles that each item can be done to.
ROLES_OF: Mapping[ShutdownAction, tuple[Role, ...]] = {
    do: _MEASURING.get(do) or tuple(role for role in ROLES if method_of(do, role)) for do in ShutdownAction
}
#: What takes the energy away from each role that can feed some.
OFF_BY: Mapping[Role, ShutdownAction] = {
    role: ShutdownAction(spec.off_by) for role, spec in ROLES.items() if role.feeds
}
#: What the measuring items ask for unless the station says otherwise: below (V; A; rad/s) and within (s).
# Through a few milliohms tens of amperes flow below a volt, so that an output that stays on shows in the current alone.
BELOW: Mapping[ShutdownAction, float] = {
    ShutdownAction.VOLTAGE_DECAYED: 1.0,
    ShutdownAction.CURRENT_ZERO: 0.05,
    ShutdownAction.SPEED_ZERO: 1.0,
}
WITHIN: Mapping[ShutdownAction, float] = {
    ShutdownAction.VOLTAGE_DECAYED: 5.0,
    ShutdownAction.CURRENT_ZERO: 5.0,
    ShutdownAction.SPEED_ZERO: 60.0,
}


@dataclass(frozen=True)
class Item:
    """One item; `below` (V; A; rad/s, electrical where a drive measures it) and `within` (s) are 0 but for those that measure."""

    do: ShutdownAction
    role: Role
    below: float = 0.0
    within: float = 0.0

    @property
    def measures(self) -> bool:
        """True if it waits for a measurement instead of commanding."""
        return self.do in BELOW


def item(do: ShutdownAction, role: Role, below: float | None = None, within: float | None = None) -> Item:
    """Return an item with what is not given filled in. Raises ValueError where the role cannot do it."""
    if role not in ROLES_OF[do]:
        allowed = ", ".join(one.value for one in ROLES_OF[do])
        raise ValueError(
            text("{do} is not possible for {role}; allowed is {allowed}", do=do.value, role=role.value, allowed=allowed)
        )
    if do not in BELOW:
        if below is not None or within is not None:
            raise ValueError(text("{do} measures nothing; leave below and within out", do=do.value))
        return Item(do, role)
    return Item(do, role, BELOW[do] if below is None else below, WITHIN[do] if within is None else within)


def default_items(by_hand: Iterable[Role] = ()) -> tuple[Item, ...]:
    """Return the list of a station that gives none; a person (`by_hand`) is asked for one thing an instrument."""
    manual = set(by_hand)
    commands = [
        item(ShutdownAction.COMMAND_ZERO, role) for role in ROLES_OF[ShutdownAction.COMMAND_ZERO] if role not in manual
    ]
    high_voltage = item(ShutdownAction.OUTPUT_OFF, Role.INSULATION_TESTER)
    off = [item(ShutdownAction.DISABLE, role) for role in ROLES_OF[ShutdownAction.DISABLE]]
    quiet = [item(ShutdownAction.SILENCE, role) for role in ROLES_OF[ShutdownAction.SILENCE]]
    measured = [
        item(do, role)
        for do, role in (
            (ShutdownAction.VOLTAGE_DECAYED, Role.SUPPLY),
            (ShutdownAction.CURRENT_ZERO, Role.SUPPLY),
            (ShutdownAction.SPEED_ZERO, Role.DYNAMOMETER),
            (ShutdownAction.SPEED_ZERO, Role.DRIVE),
            # Of a drive that is on and says it is not, the shaft tells.
            (ShutdownAction.SPEED_ZERO, Role.TACHOMETER),
        )
        if role not in manual
    ]
    # Contacts that part under current burn, so they are the last, whatever became of the rest.
    relays = item(ShutdownAction.OPEN, Role.SWITCH_MATRIX)
    return (high_voltage, *commands, *off, item(ShutdownAction.OUTPUT_OFF, Role.SUPPLY), *quiet, *measured, relays)


@dataclass(frozen=True)
class ShutdownSequence:
    """The list of a station; a person does what concerns the roles in `by_hand`."""

    items: tuple[Item, ...] = field(default_factory=default_items)
    by_hand: frozenset[Role] = frozenset()


class ShutdownSection(Section):
    """One item of the list."""

    do: ShutdownAction
    role: Role
    below: float | None = Field(default=None, gt=0.0, description="V, A or rad/s, for an item that measures")
    within: float | None = Field(
        default=None, ge=0.0, le=3600.0, json_schema_extra={"unit": "s"}, description="for an item that measures"
    )


def shutdown_sequence_of(given: Iterable[ShutdownSection], roles: Mapping[Role, bool], source: str) -> ShutdownSequence:
    """Return a station's list, the usual one where it gives none; `roles` says of each whether a person does it.

    Raises InputError for an item that cannot be done, and for a list that leaves something energised.
    """
    by_hand = frozenset(role for role, manual in roles.items() if manual)
    items = []
    for number, one in enumerate(given):
        key = f"{source}: way_down[{number}]"
        if one.role not in roles:
            raise FileError(
                text("{key}.role = {role!r}: the station has no [instruments.{role}]", key=key, role=one.role.value)
            )
        try:
            items.append(item(one.do, one.role, one.below, one.within))
        except ValueError as error:
            raise FileError(at(key, text_of(error))) from error
    if not items:
        return ShutdownSequence(default_items(by_hand), by_hand)
    present = {(one.do, one.role) for one in items}
    for role, off in OFF_BY.items():
        if role in roles and (off, role) not in present:
            raise FileError(
                text(
                    "{source}: [[way_down]] leaves [instruments.{role}] energised; "
                    'add an item with do = "{off}" and role = "{role}", or leave the whole list out',
                    source=source,
                    role=role.value,
                    off=off.value,
                )
            )
    return ShutdownSequence(tuple(items), by_hand)
