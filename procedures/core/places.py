"""The places that leads connect: motor terminals, instrument sockets, and the points that a probe may touch."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

from drivers.interfaces.text import Text, text


class Terminal(Enum):
    """A motor terminal."""

    A = "A"
    B = "B"
    C = "C"


class Socket(Enum):
    """A place where a motor terminal may be connected."""

    OPEN = "open"
    SUPPLY_POSITIVE = "supply+"
    SUPPLY_NEGATIVE = "supply-"
    METER_HIGH = "lcr_high"
    METER_LOW = "lcr_low"
    INVERTER_U = "inverter_u"
    INVERTER_V = "inverter_v"
    INVERTER_W = "inverter_w"
    DRIVE_1 = "drive_1"
    DRIVE_2 = "drive_2"
    DRIVE_3 = "drive_3"
    INSULATION_HIGH = "insulation_high"
    #: What joins terminals with each other and with nothing else: a link put on by hand, a contactor.
    LINK = "link"


class Node(Enum):
    """A point that a voltage probe may touch."""

    A = "A"
    B = "B"
    C = "C"
    STAR_POINT = "N"
    ARTIFICIAL_STAR = "star"
    HALL_1 = "H1"
    HALL_2 = "H2"
    HALL_3 = "H3"
    HALL_GROUND = "H0"
    SUPPLY_POSITIVE = "S+"
    SUPPLY_NEGATIVE = "S-"


SOCKET_NAMES: Mapping[Socket, Text] = {
    Socket.OPEN: text("nothing (leave it open)"),
    Socket.SUPPLY_POSITIVE: text("supply, plus"),
    Socket.SUPPLY_NEGATIVE: text("supply, minus"),
    Socket.METER_HIGH: text("LCR meter, high"),
    Socket.METER_LOW: text("LCR meter, low"),
    Socket.INVERTER_U: text("inverter, U"),
    Socket.INVERTER_V: text("inverter, V"),
    Socket.INVERTER_W: text("inverter, W"),
    Socket.DRIVE_1: text("six-step drive, leg 1"),
    Socket.DRIVE_2: text("six-step drive, leg 2"),
    Socket.DRIVE_3: text("six-step drive, leg 3"),
    Socket.INSULATION_HIGH: text("insulation tester, high (its low is on the frame)"),
    Socket.LINK: text("the shorting link"),
}

NODE_NAMES: Mapping[Node, Text] = {
    Node.A: text("terminal A"),
    Node.B: text("terminal B"),
    Node.C: text("terminal C"),
    Node.STAR_POINT: text("the motor's star point"),
    Node.ARTIFICIAL_STAR: text("the artificial star point (three equal resistors, 20 kΩ)"),
    Node.HALL_1: text("Hall sensor 1"),
    Node.HALL_2: text("Hall sensor 2"),
    Node.HALL_3: text("Hall sensor 3"),
    Node.HALL_GROUND: text("the Hall sensors' ground"),
    Node.SUPPLY_POSITIVE: text("the supply's plus"),
    Node.SUPPLY_NEGATIVE: text("the supply's minus"),
}


@dataclass(frozen=True)
class VoltageProbe:
    """A voltage probe of a scope channel between two nodes."""

    channel: int
    positive: Node
    negative: Node


@dataclass(frozen=True)
class CurrentProbe:
    """A current probe of a scope channel round one terminal's wire; positive into the motor."""

    channel: int
    terminal: Terminal
