"""The setup of the bench: what is connected where, and what holds the shaft."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from drivers.interfaces import Role
from procedures.core.places import CurrentProbe, Node, Socket, Terminal, VoltageProbe

#: The leads of the voltmeter, and how those of the oscilloscope begin.
VOLTMETER_HIGH, VOLTMETER_LOW, _CHANNEL = "voltmeter+", "voltmeter-", "channel"
_VOLTAGE_PROBE = re.compile(r"channel(\d+)\+")
_CURRENT_PROBE = re.compile(r"channel(\d+)~")
_ROLES: Mapping[str, Role] = {
    "supply": Role.SUPPLY,
    "lcr": Role.LCR_METER,
    "inverter": Role.INVERTER,
    "drive": Role.DRIVE,
    "insulation": Role.INSULATION_TESTER,
    # A link belongs to no instrument; it does what a relay does where there are relays.
    "link": Role.SWITCH_MATRIX,
    "voltmeter": Role.VOLTMETER,
    _CHANNEL: Role.OSCILLOSCOPE,
}


def role_of_lead(lead: str) -> Role:
    """Return the role whose instrument a lead belongs to; raises KeyError for none."""
    begin = re.match(r"[a-z]*", lead)
    return _ROLES[begin.group() if begin else ""]


@dataclass(frozen=True, order=True)
class LeadContact:
    """A lead on a place: `lead` is a `Socket`'s value, `voltmeter+`, `channel1-` or `channel4~` (a current probe), `place` a `Node`'s."""

    lead: str
    place: str

    @property
    def name(self) -> str:
        """Its name as a crosspoint of a switch matrix."""
        return f"{self.place}:{self.lead}"

    @property
    def role(self) -> Role:
        """The role whose instrument the lead belongs to."""
        return role_of_lead(self.lead)

    @property
    def is_socket(self) -> bool:
        """True if a terminal's own wire goes there, and not a lead beside it."""
        return self.role not in (Role.VOLTMETER, Role.OSCILLOSCOPE)


@dataclass(frozen=True)
class BenchSetup:
    """Contacts in order, the LCR meter's leads, and the shaft.

    `known` is false as long as something else may be on the motor, `rotor_locked` and `coupled` are None as long as nobody knows.
    """

    contacts: tuple[LeadContact, ...] = ()
    known: bool = False
    leads_shorted: bool = False
    rotor_locked: bool | None = None
    coupled: bool | None = None

    def having(self, contacts: Iterable[LeadContact]) -> "BenchSetup":
        """Return it with these contacts and no others."""
        return replace(self, contacts=tuple(sorted(contacts)), known=True)

    @property
    def roles(self) -> frozenset[Role]:
        """The roles that have a lead anywhere."""
        return frozenset(contact.role for contact in self.contacts)

    @property
    def source(self) -> Role | None:
        """The role that the terminals' wires go to, None where they are open."""
        return next((contact.role for contact in self.contacts if contact.is_socket), None)

    @property
    def terminals(self) -> dict[Terminal, Socket]:
        """The socket of all three terminals."""
        wired = {Terminal(c.place): Socket(c.lead) for c in self.contacts if c.is_socket}
        return {terminal: wired.get(terminal, Socket.OPEN) for terminal in Terminal}

    @property
    def probes(self) -> tuple[VoltageProbe | CurrentProbe, ...]:
        """The oscilloscope's probes that are fitted with all their leads, by channel."""
        places = {contact.lead: contact.place for contact in self.contacts}
        found: list[VoltageProbe | CurrentProbe] = []
        for lead, place in places.items():
            if (voltage := _VOLTAGE_PROBE.fullmatch(lead)) and (reference := places.get(f"{lead[:-1]}-")):
                found.append(VoltageProbe(int(voltage.group(1)), Node(place), Node(reference)))
            elif current := _CURRENT_PROBE.fullmatch(lead):
                found.append(CurrentProbe(int(current.group(1)), Terminal(place)))
        return tuple(sorted(found, key=lambda probe: probe.channel))

    @property
    def voltmeter(self) -> tuple[Node, Node] | None:
        """The places of the voltmeter's high and low leads, None unless both are connected."""
        places = {contact.lead: contact.place for contact in self.contacts}
        if VOLTMETER_HIGH not in places or VOLTMETER_LOW not in places:
            return None
        return Node(places[VOLTMETER_HIGH]), Node(places[VOLTMETER_LOW])


def wired(terminals: Mapping[Terminal, Socket]) -> set[LeadContact]:
    """Return the contacts of the terminals' wires."""
    return {LeadContact(s.value, t.value) for t, s in terminals.items() if s is not Socket.OPEN}


def probed(probes: Iterable[VoltageProbe | CurrentProbe]) -> set[LeadContact]:
    """Return the contacts of the oscilloscope's probes."""
    result = set[LeadContact]()
    for probe in probes:
        if isinstance(probe, CurrentProbe):
            result.add(LeadContact(f"{_CHANNEL}{probe.channel}~", probe.terminal.value))
        else:
            result.add(LeadContact(f"{_CHANNEL}{probe.channel}+", probe.positive.value))
            result.add(LeadContact(f"{_CHANNEL}{probe.channel}-", probe.negative.value))
    return result


def metered(high: Node | Terminal, low: Node | Terminal) -> set[LeadContact]:
    """Return the contacts of the voltmeter's leads."""
    return {LeadContact(VOLTMETER_HIGH, high.value), LeadContact(VOLTMETER_LOW, low.value)}
