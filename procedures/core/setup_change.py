"""Changes of the setup as data and in words: a line for each piece of hand work, in the order in which it is done."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from itertools import groupby

from drivers.interfaces import Role
from drivers.interfaces.text import Text, text, word
from procedures.core.places import NODE_NAMES, Node, Socket, Terminal
from procedures.core.setup import VOLTMETER_HIGH, VOLTMETER_LOW, BenchSetup

_LEADS: Mapping[str, Text] = {
    Socket.SUPPLY_POSITIVE.value: text("the supply's plus"),
    Socket.SUPPLY_NEGATIVE.value: text("the supply's minus"),
    Socket.METER_HIGH.value: text("the LCR meter's high"),
    Socket.METER_LOW.value: text("the LCR meter's low"),
    Socket.INVERTER_U.value: text("the inverter's U"),
    Socket.INVERTER_V.value: text("the inverter's V"),
    Socket.INVERTER_W.value: text("the inverter's W"),
    Socket.DRIVE_1.value: text("the six-step drive's leg 1"),
    Socket.DRIVE_2.value: text("the six-step drive's leg 2"),
    Socket.DRIVE_3.value: text("the six-step drive's leg 3"),
    Socket.INSULATION_HIGH.value: text("the insulation tester's high (its low is on the frame)"),
    Socket.LINK.value: text("the shorting link"),
    VOLTMETER_HIGH: text("the voltmeter's high"),
    VOLTMETER_LOW: text("the voltmeter's low"),
}
#: Where the other one of a voltmeter's leads goes that measures beside the supply.
_ON_SUPPLY = {Node.SUPPLY_POSITIVE.value, Node.SUPPLY_NEGATIVE.value}


class ChangeKind(Enum):
    """Kind of change to a lead or to the shaft."""

    STAND_STILL = "stand still"
    CLEAR = "clear"
    TAKE_OFF = "take off"
    TAKE_APART = "take apart"
    CLIP_TOGETHER = "clip together"
    MOVE = "move"
    PUT_ON = "put on"
    UNCOUPLE = "uncouple"
    FREE = "free"
    COUPLE = "couple"
    LOCK = "lock"


@dataclass(frozen=True)
class Change:
    """One lead taken off a place, put on one or moved there from its `origin`; or what is done to the shaft, `lead` and `place` empty.

    `number` is that of the line that says it, from 1.
    """

    kind: ChangeKind
    role: Role | None = None
    lead: str = ""
    place: str = ""
    origin: str = ""
    number: int = 0

    def numbered(self, number: int) -> "Change":
        """Return it with the number of its line."""
        return replace(self, number=number)


@dataclass(frozen=True)
class ChangeSetup:
    """Change the bench from one setup to another, step by step; nothing is energised while a lead is touched."""

    changes: tuple[Change, ...]
    before: BenchSetup
    after: BenchSetup

    @property
    def at_shaft(self) -> bool:
        """True if only the shaft is locked or freed, which is allowed while current holds the rotor."""
        return all(change.kind in (ChangeKind.LOCK, ChangeKind.FREE) for change in self.changes)

    def lines(self, colours: Mapping[str, str]) -> list[Text]:
        """Say it: one line by itself, or a heading and the numbered lines in their order; `colours` are the terminals' wires."""
        said = list(self.numbered_lines(colours).values())
        return said if len(said) == 1 else [self._heading(), *said]

    def numbered_lines(self, colours: Mapping[str, str]) -> dict[int, Text]:
        """Return each line by the number that its changes carry."""
        by_number = groupby(self.changes, lambda change: change.number)
        return {number: self._line(list(found), colours) for number, found in by_number}

    def _heading(self) -> Text:
        if any(change.kind in (ChangeKind.PUT_ON, ChangeKind.MOVE) for change in self.changes):
            return text("Connect, in this order:")
        return text("At the motor, in this order:")

    def _line(self, changes: Sequence[Change], colours: Mapping[str, str]) -> Text:
        first = changes[0]
        match first.kind:
            case ChangeKind.TAKE_OFF:
                return _taken_off(changes, colours)
            case ChangeKind.MOVE if len(changes) > 1:
                tip, reference = (_place(change.place, colours) for change in changes)
                return text(
                    "Channel {channel}: move the tip to {tip}, the reference to {reference}",
                    channel=_channel(first.lead),
                    tip=tip,
                    reference=reference,
                )
            case ChangeKind.MOVE:
                origin, place = _place(first.origin, colours), _place(first.place, colours)
                return text("Move {lead} from {origin} to {place}", lead=_lead(first.lead), origin=origin, place=place)
            case ChangeKind.PUT_ON:
                return self._put_on(changes, colours)
        return _PLAIN[first.kind]

    def _put_on(self, changes: Sequence[Change], colours: Mapping[str, str]) -> Text:
        first, places = changes[0], [_place(change.place, colours) for change in changes]
        if first.role is Role.VOLTMETER and len(changes) > 1:
            if {change.place for change in changes} <= _ON_SUPPLY:
                return text("Put the voltmeter on the supply's output: high on plus, low on minus")
            values: dict[str, object] = {"positive": places[0], "negative": places[1]}
            if self.after.source is Role.SUPPLY:
                return text(
                    "Put the voltmeter on, nearer to the motor than the supply's clamps: high on {positive}, low on {negative}",
                    **values,
                )
            return text("Put the voltmeter on: high on {positive}, low on {negative}", **values)
        if first.role is Role.OSCILLOSCOPE:
            channel = _channel(first.lead)
            if first.lead.endswith("~"):
                return text(
                    "Channel {channel}: current probe round the wire of {place}, arrow towards the motor",
                    channel=channel,
                    place=places[0],
                )
            if len(changes) > 1:
                return text(
                    "Channel {channel}: tip on {tip}, reference on {reference}",
                    channel=channel,
                    tip=places[0],
                    reference=places[1],
                )
        return text("Put {lead} on {places}", lead=_lead(first.lead), places=_listed(places))


#: What is said of the shaft, and of all leads at once.
_PLAIN: Mapping[ChangeKind, Text] = {
    ChangeKind.STAND_STILL: text("Wait until the shaft stands still"),
    ChangeKind.CLEAR: text("Take every lead and probe off the motor that is still on it"),
    ChangeKind.TAKE_APART: text("Take the LCR meter's leads apart again"),
    ChangeKind.CLIP_TOGETHER: text("Clip the LCR meter's leads together, off the motor"),
    ChangeKind.UNCOUPLE: text("Take the motor's shaft off the dynamometer"),
    ChangeKind.FREE: text("Unlock the shaft and turn it a little by hand: it moves freely"),
    ChangeKind.COUPLE: text("Couple the motor's shaft to the dynamometer"),
    ChangeKind.LOCK: text("Lock the shaft where it stands, without turning it"),
}


def _taken_off(changes: Sequence[Change], colours: Mapping[str, str]) -> Text:
    role, leads = changes[0].role, {change.lead for change in changes}
    if role is Role.OSCILLOSCOPE:
        channels = sorted({_channel(change.lead) for change in changes})
        return text(
            "Take the oscilloscope's probes off: channel {channels}",
            channels=_listed([word(each) for each in channels]),
        )
    if role is Role.VOLTMETER and {change.place for change in changes} <= _ON_SUPPLY:
        return text("Take the voltmeter off the supply's output")
    places = _listed([_place(place, colours) for place in sorted({change.place for change in changes})])
    if len(leads) > 1 and role is not None:
        return text("Take the {instrument} off {places}", instrument=_IN_SENTENCE[role], places=places)
    return text("Take {lead} off {places}", lead=_lead(changes[0].lead), places=places)


def contact_lines(setup: BenchSetup) -> list[Text]:
    """Return what is connected where, one line each."""
    return [
        text("{lead} on {place}", lead=_lead(contact.lead), place=_place(contact.place, {}))
        for contact in setup.contacts
    ]


def _listed(places: Sequence[Text]) -> Text:
    match places:
        case [one]:
            return one
        case [one, other]:
            return text("{one} and {other}", one=one, other=other)
    return text("{places} and {last}", places=places[:-1], last=places[-1])


#: Instruments inside a sentence.
_IN_SENTENCE: Mapping[Role, Text] = {
    Role.SUPPLY: text("supply"),
    Role.LCR_METER: text("LCR meter"),
    Role.INVERTER: text("inverter"),
    Role.DRIVE: text("six-step drive"),
    Role.INSULATION_TESTER: text("insulation tester"),
    Role.VOLTMETER: text("voltmeter"),
}


def _lead(lead: str) -> Text:
    if (known := _LEADS.get(lead)) is not None:
        return known
    channel = _channel(lead)
    named = {
        "+": text("the tip of channel {channel}", channel=channel),
        "-": text("the reference of channel {channel}", channel=channel),
        "~": text("the current probe of channel {channel}", channel=channel),
    }
    return named[lead[-1]]


def _channel(lead: str) -> str:
    return lead.removeprefix("channel").rstrip("+-~")


def _place(place: str, colours: Mapping[str, str]) -> Text:
    if place not in [terminal.value for terminal in Terminal]:
        return NODE_NAMES[Node(place)]
    if colour := colours.get(place):
        return text("{terminal} ({colour})", terminal=place, colour=text(colour))
    return Text("{terminal}", {"terminal": place})
