"""Nodes that are spoken to by frames of CAN FD, on a bus or behind an fdcanusb that a person named for that: one question to all.

A node of classic CAN takes a frame of CAN FD for an error: nothing is asked where nobody said that the bus has it.
"""

from collections.abc import Collection, Mapping
from functools import partial
from time import monotonic

from bench.discovery.can_nodes import ALL_NODES, node_address
from bench.discovery.findings import DriverMatch, FoundInstrument
from bench.discovery.inquiry import Inquiry, shown
from drivers.catalogue import Driver
from drivers.interfaces import Identity
from drivers.interfaces.text import text
from drivers.recognition import CanFdTalk
from drivers.transport.can.addresses import parse_bus
from drivers.transport.can.buses import CanBuses
from drivers.transport.can.fd_frames import FrameLine
from drivers.transport.can.fdcanusb import FdcanusbNode, is_fdcanusb
from drivers.transport.parameters import flag

#: What stands for all nodes where one is named; how long (s) answers are waited for, and an adapter may take to be opened.
_EVERY = 127
_ANSWER_TIME, _OPENING_TIME = 0.5, 5.0


def speaks_fd(address: str) -> bool:
    """Tell whether a person said that a bus has CAN FD: by `fd=true`, or as what is behind an fdcanusb."""
    if is_fdcanusb(address):
        return True
    settings = dict(parse_bus(address, address).settings)
    return flag({"fd": settings["fd"]}, "fd") if "fd" in settings else False


def fd_talk_of(driver: Driver) -> tuple[CanFdTalk, ...]:
    """Return what a driver's nodes answer by CAN FD; nothing for those that do not speak it."""
    return tuple(kind for kind in driver.recognised_by if isinstance(kind, CanFdTalk))


def ask_fd_bus(
    inquiry: Inquiry, bus: str, nodes: Collection[int] = ALL_NODES, used_by: Mapping[int, tuple[str, ...]] | None = None
) -> None:
    """Ask all nodes of a bus who they are, and put down those of `nodes` that answer; `used_by` are a station's roles by node."""
    inquiry.take(*(node_address(bus, node) for node in nodes))
    for driver, kind in inquiry.known.fd_nodes():
        what = text("a frame of CAN FD to all nodes, for {driver}", driver=driver.name)
        found = inquiry.ask(bus, what, partial(_answers, bus, kind), _ANSWER_TIME + _OPENING_TIME) or {}
        for node, data in sorted(found.items()):
            identity = inquiry.known.judged(driver.name, kind.identity_of, data)
            if node in nodes and identity is not None:
                _put_down(inquiry, node_address(bus, node), driver, identity, (used_by or {}).get(node, ()))


def _put_down(inquiry: Inquiry, address: str, driver: Driver, identity: Identity, used_by: tuple[str, ...]) -> None:
    message = text(
        "{maker}, {model}, {serial_number}, firmware {firmware}",
        maker=shown(identity.manufacturer),
        model=shown(identity.model),
        serial_number=shown(identity.serial_number),
        firmware=shown(identity.firmware),
    )
    inquiry.add(FoundInstrument((address,), message, identity, (DriverMatch(driver),), (), used_by))


def _answers(bus: str, kind: CanFdTalk) -> dict[int, bytes] | None:
    address = node_address(bus, _EVERY)
    line: FrameLine = FdcanusbNode(address, bus) if is_fdcanusb(bus) else CanBuses().fd_node(address, bus, kind.bitrate)
    found: dict[int, bytes] = {}
    try:
        line.listen(kind.replies)
        line.send(kind.request, kind.question)
        end = monotonic() + _ANSWER_TIME
        while (heard := line.receive(max(0.0, end - monotonic()))) is not None:
            found.setdefault(kind.replies.index(heard[0]) + 1, heard[1])
    finally:
        line.disconnect()
    return found or None
