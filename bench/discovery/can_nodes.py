"""CANopen nodes on a bus that a person named, found by SDO uploads of 0x1000 and 0x1018 alone."""

from collections.abc import Collection, Mapping
from functools import partial

from canopen import ObjectDictionary

from bench.discovery.findings import FoundInstrument
from bench.discovery.inquiry import Inquiry, shown
from drivers.interfaces import Identity, InstrumentError
from drivers.interfaces.text import text
from drivers.transport.can.addresses import parse_bus, with_flexible_data_rate
from drivers.transport.can.buses import SharedBus
from drivers.transport.can.fdcanusb import is_fdcanusb
from drivers.transport.can.objects import NodeObjects
from drivers.transport.canonical_address import is_serial_line

ALL_NODES = range(1, 128)
#: The first SDO of a node: request and reply (CiA 301), and an upload of 0x1000:00 as it stands in a frame.
_REQUEST, _REPLY = 0x600, 0x580
_UPLOAD_DEVICE_TYPE = bytes((0x40, 0x00, 0x10, 0x00, 0, 0, 0, 0))
#: Between two requests (s): an adapter's queue is short; and how long (s) the last node may take.
_PAUSE, _ANSWER_TIME = 0.002, 0.5
_LOOK = 0.01
#: How long (s) asking one node for its identity may take: five uploads, each tried twice at 0.3 s.
_NODE_TIME = 3.5
_OPENING_TIME = 5.0


def bus_address(given: str) -> str:
    """Return `can://interface/channel` for what a person typed, with or without `can://`; an fdcanusb's address as it is."""
    return given if given.startswith("can://") or is_fdcanusb(given) else f"can://{given}"


def bus_and_nodes(address: str) -> tuple[str, Collection[int]]:
    """Return the bus of an address and the node that it names, all nodes where it names none."""
    address, _, query = address.partition("?")
    keys = [key for key in query.split("&") if key]
    named = [key.removeprefix("node=") for key in keys if key.startswith("node=")]
    rest = "&".join(key for key in keys if not key.startswith("node="))
    nodes = tuple(int(number) for number in named if number.isdecimal() and int(number) in ALL_NODES)
    return f"{address}?{rest}" if rest else address, nodes or ALL_NODES


def node_address(bus: str, node: int) -> str:
    """Return the address of a node on a bus."""
    return f"{bus}{'&' if '?' in bus else '?'}node={node}"


def ask_bus(
    inquiry: Inquiry, bus: str, nodes: Collection[int] = ALL_NODES, used_by: Mapping[int, tuple[str, ...]] | None = None
) -> None:
    """Ask nodes for their device type, and those that answer for their identity; `used_by` are a station's roles by node."""
    addresses = {node: node_address(bus, node) for node in nodes}
    if any(is_serial_line(address) for address in addresses.values()):
        # An adapter's line is one as a whole.
        free = list(nodes) if inquiry.take(*addresses.values()) else []
    else:
        free = [node for node, address in addresses.items() if inquiry.take(address)]
    if not free:
        return
    what = text("nodes {first} to {last}, object 0x1000 by SDO upload", first=min(free), last=max(free))
    opened: list[SharedBus] = []

    def answering() -> list[int] | None:
        named = parse_bus(bus, bus)
        opened.append(SharedBus(with_flexible_data_rate(named) if "fd" in dict(named.settings) else named, bus))
        return _answering(inquiry, opened[0], free) or None

    try:
        for node in inquiry.ask(bus, what, answering, len(free) * _PAUSE + _ANSWER_TIME + _OPENING_TIME) or ():
            address, objects = node_address(bus, node), text("0x1000, 0x1008 and 0x1018")
            reply = inquiry.ask(address, objects, partial(_identity, opened[0], node, bus), _NODE_TIME)
            if reply is not None:
                _judge(inquiry, address, *reply, (used_by or {}).get(node, ()))
    finally:
        for one in opened:
            one.disconnect()


def _judge(inquiry: Inquiry, address: str, device_type: int, identity: Identity, used_by: tuple[str, ...]) -> None:
    message = text(
        "device type 0x{device_type:08X}, {maker}, {model}",
        device_type=device_type,
        maker=shown(identity.manufacturer) or "–",
        model=shown(identity.model) or "–",
    )
    inquiry.add(FoundInstrument((address,), message, identity, inquiry.known.can_open(device_type), (), used_by))


def _answering(inquiry: Inquiry, bus: SharedBus, nodes: Collection[int]) -> list[int]:
    heard: set[int] = set()
    for node in nodes:
        bus.network.subscribe(_REPLY + node, lambda identifier, *_: heard.add(identifier - _REPLY))
    try:
        for node in nodes:
            bus.network.send_message(_REQUEST + node, _UPLOAD_DEVICE_TYPE)
            inquiry.clock.sleep(_PAUSE)
        end = inquiry.clock.now() + _ANSWER_TIME
        while len(heard) < len(nodes) and inquiry.clock.now() < end:
            inquiry.clock.sleep(_LOOK)
    finally:
        for node in nodes:
            bus.network.unsubscribe(_REPLY + node)
    return sorted(heard)


def _identity(bus: SharedBus, node: int, name: str) -> tuple[int, Identity]:
    client = bus.network.add_node(node, ObjectDictionary()).sdo  # type: ignore[no-untyped-call]
    objects = NodeObjects(client, name)
    device_type = objects.read(0x1000, 0, 4)
    told: dict[int, int | None] = {}
    for sub in (1, 2, 3, 4):
        try:
            told[sub] = objects.read(0x1018, sub, 4)
        except InstrumentError:
            # Vendor alone is mandatory (CiA 301).
            told[sub] = None
    try:
        model = objects.read_text(0x1008, 0)
    except InstrumentError:
        model = ""
    vendor = f"vendor 0x{told[1]:08X}" if told[1] is not None else ""
    product = f"product 0x{told[2]:08X}" if told[2] is not None else ""
    return device_type, Identity(
        vendor, model or product, str(told[4] or ""), "" if told[3] is None else f"{told[3]:X}"
    )
