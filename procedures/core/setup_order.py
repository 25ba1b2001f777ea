"""The safe order of changes from one setup of the bench to another.

What comes off comes off first, sources before meters, for nothing is put on where something else still is; then the shaft,
while nothing but what stays is on the terminals; then what goes on, meters before sources.
"""

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby

from drivers.interfaces import Role
from drivers.interfaces.role import ROLES
from procedures.core.setup import BenchSetup, LeadContact
from procedures.core.setup_change import Change, ChangeKind

#: Sources first, as a shutdown takes them.
_RANK = {role: number for number, role in enumerate(ROLES)}
_Line = list[Change]


def ordered_changes(before: BenchSetup, after: BenchSetup, *, turned: bool = False) -> tuple[Change, ...]:
    """Return the manual changes in order, numbered by the line that states them; empty if there is nothing to do.

    `turned` says that something has driven the shaft, which may still turn.
    """
    held, wanted = set(before.contacts), set(after.contacts)
    if after.known and not before.known:
        # What is not known to be there is taken off with all the rest.
        held = set()
    moves, parted, joined = _moves(held - wanted, wanted - held, held & wanted)
    lines: list[_Line] = []
    if after.known and not before.known:
        lines.append([Change(ChangeKind.CLEAR)])
    lines += _taken_off(parted, after.roles)
    if before.leads_shorted and not after.leads_shorted:
        lines.append([Change(ChangeKind.TAKE_APART, role=Role.LCR_METER)])
    lines += [[Change(kind)] for kind in _of_shaft(before, after)]
    if after.leads_shorted and not before.leads_shorted:
        lines.append([Change(ChangeKind.CLIP_TOGETHER, role=Role.LCR_METER)])
    lines += _put_on(moves, joined)
    if turned and lines:
        lines.insert(0, [Change(ChangeKind.STAND_STILL)])
    return tuple(change.numbered(number) for number, line in enumerate(lines, 1) for change in line)


def _of_shaft(before: BenchSetup, after: BenchSetup) -> Iterator[ChangeKind]:
    if after.coupled is False and before.coupled is not False:
        yield ChangeKind.UNCOUPLE
    if after.rotor_locked is False and before.rotor_locked is not False:
        yield ChangeKind.FREE
    if after.coupled and not before.coupled:
        yield ChangeKind.COUPLE
    if after.rotor_locked and not before.rotor_locked:
        yield ChangeKind.LOCK


def _moves(
    gone: set[LeadContact], new: set[LeadContact], kept: set[LeadContact]
) -> tuple[list[Change], list[LeadContact], list[LeadContact]]:
    """Return what only moves, each to a place that is free by then; what is taken off before, and what is put on."""
    parted, joined, open_moves = sorted(gone), sorted(new), list[tuple[LeadContact, LeadContact]]()
    for contact in sorted(gone):
        target = next((other for other in joined if other.lead == contact.lead), None)
        if target is not None:
            open_moves.append((contact, target))
            parted.remove(contact)
            joined.remove(target)
    moves: list[Change] = []
    while open_moves:
        there = kept | {origin for origin, _ in open_moves}
        free = next((pair for pair in open_moves if not _in_the_way(pair[1], there - {pair[0]})), None)
        if free is None:
            # In a ring of leads that wait for each other one is taken off first.
            origin, target = open_moves.pop(0)
            parted.append(origin)
            joined.append(target)
            continue
        open_moves.remove(free)
        origin, target = free
        moves.append(Change(ChangeKind.MOVE, target.role, target.lead, target.place, origin.place))
        kept = kept | {target}
    return moves, sorted(parted), sorted(joined)


def _in_the_way(contact: LeadContact, others: Iterable[LeadContact]) -> bool:
    """Tell whether another lead of the same instrument is where this one is to go; probes may meet."""
    probe = contact.role is Role.OSCILLOSCOPE
    return not probe and any(other.place == contact.place and other.role is contact.role for other in others)


def _taken_off(contacts: Sequence[LeadContact], staying: frozenset[Role]) -> Iterator[_Line]:
    """Give a line for each instrument that goes, and for each lead of one that stays."""
    for role in sorted({contact.role for contact in contacts}, key=_RANK.__getitem__):
        found = [contact for contact in contacts if contact.role is role]
        changes = [Change(ChangeKind.TAKE_OFF, role, contact.lead, contact.place) for contact in found]
        if role not in staying or role is Role.OSCILLOSCOPE:
            yield changes
            continue
        for _, leads in groupby(changes, _together):
            yield list(leads)


def _put_on(moves: Sequence[Change], contacts: Sequence[LeadContact]) -> Iterator[_Line]:
    new = [Change(ChangeKind.PUT_ON, contact.role, contact.lead, contact.place) for contact in contacts]
    roles = sorted({change.role for change in (*moves, *new) if change.role}, key=lambda role: -_RANK[role])
    for role in roles:
        here = [move for move in moves if move.role is role]
        if role is Role.OSCILLOSCOPE:
            yield from (list(found) for _, found in groupby(sorted(here, key=lambda move: move.lead), _together))
        else:
            yield from ([move] for move in here)
        for _, found in groupby([change for change in new if change.role is role], _together):
            yield list(found)


def _together(change: Change) -> str:
    """Return what the leads have in common that one line puts on or takes off: the voltmeter, a probe, or one socket."""
    if change.role is Role.VOLTMETER:
        return "voltmeter"
    return change.lead.rstrip("+-~") if change.role is Role.OSCILLOSCOPE else change.lead
