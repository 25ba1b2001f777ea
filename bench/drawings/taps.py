"""Places of measuring instruments above and below the rails: their columns and boxes."""

from collections.abc import Collection, Iterable
from dataclasses import dataclass

from bench.drawings.difference import SOURCES
from bench.drawings.leads import ARTIFICIAL_NEUTRAL, JOINT, Lead, LeadKind
from bench.drawings.lettering import width_of
from bench.drawings.sheet import PHASES, SLOT, DrawingSheet
from drivers.interfaces.role import ROLES
from drivers.interfaces.text import Text, text
from procedures.core.bench import Role

#: Columns begin so far behind the terminals.
_BEGIN = 94.0
_LEAST = 150.0
#: Between two boxes.
_BETWEEN = 14.0


@dataclass(frozen=True)
class LeadColumn:
    """A straight lead from an instrument to a node at u; grounds of several channels on one node are one."""

    u: float
    leads: tuple[Lead, ...]

    @property
    def node(self) -> str:
        """The node that it ends on."""
        return self.leads[0].node

    @property
    def kind(self) -> LeadKind:
        """The kind of its ends."""
        return self.leads[0].kind


@dataclass(frozen=True)
class Group:
    """The columns of one instrument and its box, from u to u; `gone` for one that comes off."""

    role: Role
    gone: bool
    below: bool
    columns: tuple[LeadColumn, ...]
    first: float
    last: float


@dataclass(frozen=True)
class Taps:
    """All columns, and where the artificial neutral's resistors hang, by terminal."""

    groups: tuple[Group, ...]
    resistors: dict[str, float]


def place_taps(sheet: DrawingSheet) -> Taps:
    """Return where the columns stand, and set the motor's left edge on the sheet behind them."""
    wide = 0.0 if sheet.upright else max(sheet.half_terminal(node) for node in PHASES) - 29.0
    begin = sheet.strip + wide + _BEGIN
    below, above = begin, begin + SLOT / 2.0
    groups = list[Group]()
    resistors = dict[str, float]()
    for role, leads in _by_role(sheet.difference.gone):
        groups.append(_group(sheet, role, leads, above, gone=True))
        above = groups[-1].last + _BETWEEN + SLOT / 2.0
    if sheet.upright and groups:
        # One side for all: nothing stands among the ghosts.
        below = above
    if ARTIFICIAL_NEUTRAL in sheet.v:
        resistors = {node: below + SLOT * number for number, node in enumerate(PHASES)}
        below = resistors[PHASES[-1]] + SLOT
    free = max(above, below) if groups else below
    for role, leads in _by_role(lead for lead in sheet.difference.leads if lead.role not in SOURCES):
        groups.append(_group(sheet, role, leads, free, gone=False))
        free = groups[-1].last + _BETWEEN + SLOT / 2.0
    last = max((column.u for group in groups for column in group.columns), default=sheet.strip)
    sheet.end = max(sheet.end, sheet.strip + _LEAST, last + SLOT, *(u + SLOT for u in resistors.values()))
    return Taps(tuple(groups), resistors)


def _by_role(leads: Iterable[Lead]) -> list[tuple[Role, list[Lead]]]:
    found: dict[Role, list[Lead]] = {}
    for lead in leads:
        found.setdefault(lead.role, []).append(lead)
    # The voltmeter stands above: it comes first, the oscilloscope below after it.
    return sorted(found.items(), key=lambda item: item[0] is Role.OSCILLOSCOPE)


def _group(sheet: DrawingSheet, role: Role, leads: list[Lead], first: float, *, gone: bool) -> Group:
    """Return an instrument's columns from u on; its box is wide enough for its name."""
    found: dict[object, list[Lead]] = {}
    for lead in leads:
        reference = lead.kind is LeadKind.REFERENCE
        key = ("reference", lead.node) if reference else (lead.role, lead.socket, lead.node, lead.kind)
        found.setdefault(key, []).append(lead)
    order = sorted(
        found.values(),
        key=lambda same: not (same[0].kind is LeadKind.REFERENCE and same[0].node == ARTIFICIAL_NEUTRAL),
    )
    name = max(
        width_of(sheet.say(ROLES[role].label), 18, bold=True),
        width_of(sheet.say(what_to_do(sheet, role, leads)), 16, bold=True) if gone else 0.0,
    )
    wide = max(len(order) * SLOT, 64.0 if sheet.upright else name + 24.0)
    start = first + (wide - len(order) * SLOT) / 2.0
    columns = tuple(LeadColumn(start + SLOT * number, tuple(same)) for number, same in enumerate(order))
    left = start - SLOT / 2.0 - (wide - len(order) * SLOT) / 2.0
    return Group(role, gone, role is Role.OSCILLOSCOPE and not gone, columns, left, left + wide)


def what_to_do(sheet: DrawingSheet, role: Role, gone: Collection[Lead]) -> Text:
    """Say what is done with leads that do not stay where they are."""
    if all(lead.node == JOINT for lead in gone):
        return text("take apart")
    again = {(lead.socket, lead.kind) for lead in sheet.difference.new if lead.role is role}
    return text("move") if all((lead.socket, lead.kind) in again for lead in gone) else text("take off")
