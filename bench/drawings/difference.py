"""The changes by a step's manual work: the difference of two layouts, numbered as the instruction's lines are."""

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum

from bench.drawings.layout import Layout
from bench.drawings.leads import Lead, LeadKind, leads_of
from procedures.core.bench import Role

#: Those that feed or excite what they are on: they come last.
SOURCES = (Role.SUPPLY, Role.LCR_METER, Role.INVERTER, Role.DRIVE, Role.INSULATION_TESTER, Role.SWITCH_MATRIX)


class ShaftWork(Enum):
    """Hand work on the shaft."""

    FREE = "free"
    LOCK = "lock"
    COUPLE = "couple"
    UNCOUPLE = "uncouple"
    TURN = "turn"


#: What one line of the instruction tells; a line may tell several.
Work = Lead | ShaftWork


@dataclass(frozen=True)
class LayoutDifference:
    """The leads that stay or come and those that go, what is done to the shaft, and each one's number."""

    leads: tuple[Lead, ...]
    new: frozenset[Lead]
    gone: tuple[Lead, ...]
    shaft: frozenset[ShaftWork]
    numbers: dict[Work, int]


def difference_of(
    before: Layout | None, after: Layout, lines: Sequence[Collection[Work]] = (), *, by_hand: bool = False
) -> LayoutDifference:
    """Return what is to be done between two layouts; nothing where there is no `before`.

    `lines` gives the instruction's lines in their order, each with what it tells; what they leave out is numbered after them:
    what comes off first, then the shaft, then meters before sources. `by_hand` where the shaft is turned by hand now.
    """
    leads = leads_of(after)
    if before is None:
        return LayoutDifference(leads, frozenset(), (), frozenset(), {})
    earlier = leads_of(before)
    new = tuple(lead for lead in leads if lead not in earlier)
    gone = tuple(lead for lead in earlier if lead not in leads)
    shaft = _shaft(before, after, by_hand=by_hand)
    usual: list[Sequence[Work]] = [
        *_grouped(gone, lambda lead: lead.role),
        *([work] for work in shaft),
        *_grouped(sorted(new, key=lambda lead: lead.role in SOURCES), _one_line),
    ]
    return LayoutDifference(
        leads, frozenset(new), gone, frozenset(shaft), _numbers(lines, usual, {*new, *gone, *shaft})
    )


def _shaft(before: Layout, after: Layout, *, by_hand: bool) -> list[ShaftWork]:
    done = []
    if before.dynamometer_coupled and not after.dynamometer_coupled:
        done.append(ShaftWork.UNCOUPLE)
    if before.rotor_locked and not after.rotor_locked:
        done.append(ShaftWork.FREE)
    if after.dynamometer_coupled and not before.dynamometer_coupled:
        done.append(ShaftWork.COUPLE)
    if after.rotor_locked and not before.rotor_locked:
        done.append(ShaftWork.LOCK)
    if by_hand or (after.shaft_turned and not before.shaft_turned):
        done.append(ShaftWork.TURN)
    return done


def _one_line(lead: Lead) -> object:
    """Return what tells apart the lines of what is put on: the voltmeter's leads together, a channel's, a socket's."""
    if lead.role is Role.VOLTMETER:
        return lead.role
    return lead.role, lead.socket, lead.kind is LeadKind.CLAMP


def _grouped(leads: Iterable[Lead], key: Callable[[Lead], object]) -> list[list[Lead]]:
    groups: dict[object, list[Lead]] = {}
    for lead in leads:
        groups.setdefault(key(lead), []).append(lead)
    return list(groups.values())


def _numbers(
    lines: Sequence[Collection[Work]], usual: Iterable[Collection[Work]], asked: Collection[Work]
) -> dict[Work, int]:
    """Return the number of each work asked for: that of the line that tells it first, or one after them all."""
    numbers: dict[Work, int] = {}
    for number, line in enumerate(lines, 1):
        numbers = {**dict.fromkeys((work for work in line if work in asked), number), **numbers}
    number = len(lines)
    for group in usual:
        told = [work for work in group if work not in numbers]
        if told:
            number += 1
            numbers.update(dict.fromkeys(told, number))
    return numbers
