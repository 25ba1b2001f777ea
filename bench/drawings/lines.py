"""An instruction's lines as the drawing numbers them."""

from collections.abc import Iterator

from bench.drawings.difference import ShaftWork, Work
from bench.drawings.leads import FRAME, JOINT, SOCKETS, Lead, LeadKind
from procedures.core.actions import Action
from procedures.core.bench import Role
from procedures.core.places import Socket
from procedures.core.setup import VOLTMETER_HIGH, VOLTMETER_LOW
from procedures.core.setup_change import Change, ChangeKind, ChangeSetup

_SHAFT = {
    ChangeKind.UNCOUPLE: ShaftWork.UNCOUPLE,
    ChangeKind.FREE: ShaftWork.FREE,
    ChangeKind.COUPLE: ShaftWork.COUPLE,
    ChangeKind.LOCK: ShaftWork.LOCK,
}
_ENDS = {"+": LeadKind.CLIP, "-": LeadKind.REFERENCE, "~": LeadKind.CLAMP}


def lines_of(action: Action | None) -> list[list[Work]]:
    """Return what each line of an instruction tells, in their order; nothing for one that changes no setup."""
    if not isinstance(action, ChangeSetup):
        return []
    lines: list[list[Work]] = [[] for _ in range(max((change.number for change in action.changes), default=0))]
    for change in action.changes:
        lines[change.number - 1] += _work(change)
    return lines


def _work(change: Change) -> Iterator[Work]:
    if change.kind in _SHAFT:
        yield _SHAFT[change.kind]
    elif change.kind in (ChangeKind.CLIP_TOGETHER, ChangeKind.TAKE_APART):
        yield from (Lead(Role.LCR_METER, socket, JOINT) for socket in ("H", "L"))
    elif change.lead:
        yield from (_lead(change.lead, place) for place in (change.place, change.origin) if place)
        if change.lead == Socket.INSULATION_HIGH.value:
            yield Lead(Role.INSULATION_TESTER, "L", FRAME)


def _lead(lead: str, place: str) -> Lead:
    if lead in (VOLTMETER_HIGH, VOLTMETER_LOW):
        return Lead(Role.VOLTMETER, "HI" if lead == VOLTMETER_HIGH else "LO", place)
    if lead.startswith("channel"):
        return Lead(Role.OSCILLOSCOPE, lead.removeprefix("channel")[:-1], place, _ENDS[lead[-1]])
    return Lead(*SOCKETS[Socket(lead)], place)
