"""The leads that connections are made of: each from an instrument's socket to a node."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import Enum

from bench.drawings.layout import Layout
from procedures.core.actions import Node, Socket, Terminal, VoltageProbe
from procedures.core.bench import Role

#: Terminals and pins in the order of their rails.
A, B, C = "A", "B", "C"
STAR_POINT = Node.STAR_POINT.value
ARTIFICIAL_NEUTRAL = Node.ARTIFICIAL_STAR.value
HALL_PINS = tuple(node.value for node in (Node.HALL_1, Node.HALL_2, Node.HALL_3, Node.HALL_GROUND))
SUPPLY_OUTPUT = {Node.SUPPLY_POSITIVE.value: "+", Node.SUPPLY_NEGATIVE.value: "−"}
FRAME = "frame"
#: Where a meter's leads meet that are clipped together.
JOINT = "joint"
NODES = (A, B, C, STAR_POINT, *HALL_PINS, *SUPPLY_OUTPUT, FRAME, ARTIFICIAL_NEUTRAL, JOINT)

#: The instrument and the mark of each socket.
SOCKETS: Mapping[Socket, tuple[Role, str]] = {
    Socket.SUPPLY_POSITIVE: (Role.SUPPLY, "+"),
    Socket.SUPPLY_NEGATIVE: (Role.SUPPLY, "−"),
    Socket.METER_HIGH: (Role.LCR_METER, "H"),
    Socket.METER_LOW: (Role.LCR_METER, "L"),
    Socket.INVERTER_U: (Role.INVERTER, "U"),
    Socket.INVERTER_V: (Role.INVERTER, "V"),
    Socket.INVERTER_W: (Role.INVERTER, "W"),
    Socket.DRIVE_1: (Role.DRIVE, "1"),
    Socket.DRIVE_2: (Role.DRIVE, "2"),
    Socket.DRIVE_3: (Role.DRIVE, "3"),
    Socket.INSULATION_HIGH: (Role.INSULATION_TESTER, "H"),
    Socket.LINK: (Role.SWITCH_MATRIX, "≡"),
}


class LeadKind(Enum):
    """The end of a lead."""

    CLIP = "clip"
    REFERENCE = "reference"
    CLAMP = "clamp"


@dataclass(frozen=True)
class Lead:
    """A lead from a socket of a role's instrument to a node; a probe's tip and its reference are two."""

    role: Role
    socket: str
    node: str
    kind: LeadKind = LeadKind.CLIP


def leads_of(layout: Layout) -> tuple[Lead, ...]:
    """Return every lead of a layout once, in the order of terminals and channels."""
    return tuple(dict.fromkeys(_leads(layout)))


def _leads(layout: Layout) -> Iterator[Lead]:
    for terminal in Terminal:
        socket = (layout.terminals or {}).get(terminal, Socket.OPEN)
        if socket is Socket.OPEN:
            continue
        yield Lead(*SOCKETS[socket], terminal.value)
        if socket is Socket.INSULATION_HIGH:
            yield Lead(Role.INSULATION_TESTER, "L", FRAME)
    if layout.leads_shorted:
        yield Lead(Role.LCR_METER, "H", JOINT)
        yield Lead(Role.LCR_METER, "L", JOINT)
    if layout.voltmeter is not None:
        positive, negative = layout.voltmeter
        yield Lead(Role.VOLTMETER, "HI", positive.value)
        yield Lead(Role.VOLTMETER, "LO", negative.value)
    elif layout.voltmeter_on_supply:
        yield Lead(Role.VOLTMETER, "HI", Node.SUPPLY_POSITIVE.value)
        yield Lead(Role.VOLTMETER, "LO", Node.SUPPLY_NEGATIVE.value)
    for probe in layout.probes:
        if isinstance(probe, VoltageProbe):
            yield Lead(Role.OSCILLOSCOPE, str(probe.channel), probe.positive.value)
            yield Lead(Role.OSCILLOSCOPE, str(probe.channel), probe.negative.value, LeadKind.REFERENCE)
        else:
            yield Lead(Role.OSCILLOSCOPE, str(probe.channel), probe.terminal.value, LeadKind.CLAMP)
