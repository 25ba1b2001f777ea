"""A drive's node on a virtual bus."""

from collections.abc import Callable, Iterator
from typing import Any

import can
import canopen
import pytest
from canopen.objectdictionary import (
    INTEGER8,
    INTEGER16,
    INTEGER32,
    UNSIGNED8,
    UNSIGNED16,
    UNSIGNED32,
    VISIBLE_STRING,
    ODArray,
    ODVariable,
)
from canopen.sdo.exceptions import SdoAbortedError

from drivers.cia402.power_state import PowerState, decode_state
from drivers.cia402.stated_objects import StatedObject

CHANNEL = "six-step"
#: What a station states of drives that do not say it themselves, as this node is one.
STATED: dict[str, Any] = {
    "maximum_current": 15.0,
    "maximum_frequency": 400.0,
    "current_scale": 1.0,
    "velocity_unit": "0.01 Hz",
    "field_current": StatedObject("0x2000:00", "u32", 1e-3),
}
SIX_STEP: dict[str, Any] = {
    "mode": -1,
    "velocity_unit": "0.01 Hz",
    "bus_current": StatedObject("0x2010:00", "i32", 1e-3),
    "hall_state": StatedObject("0x2011:00", "u8"),
}
OBJECTS = {
    0x1000: UNSIGNED32,
    0x2000: UNSIGNED32,
    0x2010: INTEGER32,
    0x2011: UNSIGNED8,
    0x603F: UNSIGNED16,
    0x6040: UNSIGNED16,
    0x6041: UNSIGNED16,
    0x6060: INTEGER8,
    0x6061: INTEGER8,
    0x606C: INTEGER32,
    0x6071: INTEGER16,
    0x6075: UNSIGNED32,
    0x6077: INTEGER16,
    0x6079: UNSIGNED32,
    0x60FF: INTEGER32,
}
SIGNED = (INTEGER8, INTEGER16, INTEGER32)
STATES = {0x00: 0x240, 0x06: 0x231, 0x07: 0x233, 0x0F: 0x237}


def paired(bus: can.BusABC) -> list[tuple[int, str]]:
    """Return what was sent meanwhile (identifier, bytes), each answer behind its request.

    Every answer is sent by another thread, which may reach a third listener before the request does.
    """
    requests: list[tuple[int, str]] = []
    answers: list[tuple[int, str]] = []
    while (message := bus.recv(1.0 if len(answers) < len(requests) else 0.0)) is not None:
        side = requests if message.arbitration_id >= 0x600 else answers
        side.append((message.arbitration_id, bytes(message.data).hex(" ")))
    return [frame for pair in zip(requests, answers, strict=True) for frame in pair]


class Node:
    """A drive's side: the power state machine behind the controlword, and a heartbeat consumer where it has one."""

    def __init__(
        self,
        number: int = 6,
        *,
        interface: str = "virtual",
        channel: str = CHANNEL,
        consumer: dict[int, int] | None = None,
        abort_option: int | None = None,
    ) -> None:
        self.values = {(index, 0): 0 for index in OBJECTS} | {
            (0x1000, 0): 0x00020192,
            (0x6041, 0): 0x240,
            (0x6075, 0): 20_000,
        }
        self.consumer = dict(consumer or {})
        self.types = dict(OBJECTS)
        if abort_option is not None:
            self.types[0x6007] = INTEGER16
            self.values[0x6007, 0] = abort_option
        self.writes: list[tuple[int, bytes]] = []
        self.abort: dict[int, int] = {}
        self.missing: set[tuple[int, int]] = set()  # subindices that the node does not have
        self.keeps: dict[int, int] = {}  # objects that acknowledge a write and stay what they are
        self.deaf: set[int] = set()  # controlwords that change nothing
        self.follows_mode = True
        self.lost = 0  # how many replies never come
        self.network = canopen.Network()
        self.network.NOTIFIER_CYCLE = 0.02
        self.network.connect(interface=interface, channel=channel)
        self.node = self.network.create_node(number, self.dictionary())
        self.send, self.node.sdo.send_response = self.node.sdo.send_response, self.respond
        self.node.add_read_callback(self.read)
        self.node.add_write_callback(self.written)

    def dictionary(self) -> canopen.ObjectDictionary:
        dictionary = canopen.ObjectDictionary()
        for index, kind in self.types.items():
            variable = ODVariable(f"object {index:X}", index)
            variable.data_type = kind
            dictionary.add_object(variable)
        name = ODVariable("name", 0x1008)
        name.data_type, name.value = VISIBLE_STRING, "Bench drive"
        dictionary.add_object(name)
        self.add_array(dictionary, 0x1018, [4, 0x2A, 0x6, 0x10, 815])
        if self.consumer:
            self.add_array(dictionary, 0x1016, [len(self.consumer), *self.consumer.values()])
        return dictionary

    def add_array(self, dictionary: canopen.ObjectDictionary, index: int, values: list[int]) -> None:
        array = ODArray(f"array {index:X}", index)
        for subindex, value in enumerate(values):
            member = ODVariable(f"member {subindex}", index, subindex)
            member.data_type = UNSIGNED8 if subindex == 0 else UNSIGNED32
            array.add_member(member)
            self.values[index, subindex] = value
        dictionary.add_object(array)

    def read(self, *, index: int, subindex: int, od: Any) -> Any:
        if index in self.abort:
            raise SdoAbortedError(self.abort[index])
        if (index, subindex) in self.missing:
            raise SdoAbortedError(0x06090011)
        return self.values.get((index, subindex))

    def written(self, *, index: int, subindex: int, od: Any, data: bytes) -> None:
        if index in self.abort:
            raise SdoAbortedError(self.abort[index])
        self.writes.append((index, bytes(data)))
        value = int.from_bytes(data, "little", signed=od.data_type in SIGNED)
        self.values[index, subindex] = self.keeps.get(index, value)
        if index == 0x6040 and value not in self.deaf:
            self.command(value)
        if index == 0x6060 and self.follows_mode:
            self.values[0x6061, 0] = value

    def respond(self, response: bytes) -> None:
        if self.lost:
            self.lost -= 1
            return
        self.send(response)

    def command(self, word: int) -> None:
        faulty = self.values[0x6041, 0] & 0x4F == 0x08
        if faulty and word == 0x80:
            self.values[0x6041, 0], self.values[0x603F, 0] = 0x240, 0
        elif not faulty and word in STATES:
            self.values[0x6041, 0] = STATES[word]

    def fail(self, code: int) -> None:
        self.values[0x6041, 0], self.values[0x603F, 0] = 0x218, code

    @property
    def words(self) -> list[int]:
        """The controlwords that were written, in order."""
        return [int.from_bytes(data, "little") for index, data in self.writes if index == 0x6040]

    @property
    def state(self) -> PowerState:
        return decode_state(self.values[0x6041, 0])

    def entry(self, subindex: int) -> int:
        return self.values[0x1016, subindex]


@pytest.fixture(autouse=True)
def quickly_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every test leaves a bus, which otherwise takes as long as its thread listens."""
    monkeypatch.setattr("drivers.transport.can.buses.LISTENING_TIME", 0.01)


@pytest.fixture
def make_node() -> Iterator[Callable[..., Node]]:
    made: list[Node] = []

    def make(*given: Any, **settings: Any) -> Node:
        made.append(Node(*given, **settings))
        return made[-1]

    yield make
    for node in made:
        node.network.disconnect()


@pytest.fixture
def node(make_node: Callable[..., Node]) -> Node:
    return make_node()
