"""Six-step drive against a canopen node on a virtual bus; two nodes on one bus; the watch over the process."""

from collections.abc import Iterator
from typing import Any

import can
import canopen
import pytest
from can.interfaces import virtual
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

from drivers.can_bus.buses import CanBuses
from drivers.can_bus.cia402_inverter import open_cia402_inverter
from drivers.can_bus.cia402_six_step import Cia402SixStep, open_cia402_six_step
from drivers.can_bus.options import Cia402Options, Cia402SixStepOptions
from drivers.can_bus.power_state import PowerState, decode_state
from drivers.interfaces import (
    Accuracy,
    CommunicationError,
    IdentityError,
    MeasurementError,
    ReportedError,
    SetpointError,
)

CHANNEL = "six-step"
ADDRESS = f"can://virtual/{CHANNEL}?node=6"
INVERTER = f"can://virtual/{CHANNEL}?node=5"
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


class Node:
    """A drive's side: the power state machine behind the controlword, and a heartbeat consumer where it has one."""

    def __init__(self, number: int = 6, *, consumer: dict[int, int] | None = None, abort_option: int | None = None):
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
        self.deaf: set[int] = set()  # controlwords that change nothing
        self.follows_mode = True
        self.lost = 0  # how many replies never come
        self.network = canopen.Network()
        self.network.NOTIFIER_CYCLE = 0.02
        self.network.connect(interface="virtual", channel=CHANNEL)
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
        return self.values.get((index, subindex))

    def written(self, *, index: int, subindex: int, od: Any, data: bytes) -> None:
        if index in self.abort:
            raise SdoAbortedError(self.abort[index])
        self.writes.append((index, bytes(data)))
        value = int.from_bytes(data, "little", signed=od.data_type in SIGNED)
        self.values[index, subindex] = value
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
    def state(self) -> PowerState:
        return decode_state(self.values[0x6041, 0])

    def entry(self, subindex: int) -> int:
        return self.values[0x1016, subindex]


@pytest.fixture
def node() -> Iterator[Node]:
    made = Node()
    yield made
    made.network.disconnect()


OPTIONS = Cia402SixStepOptions()


@pytest.fixture
def drive(node: Node, clock: Any) -> Iterator[Cia402SixStep]:
    made = open_cia402_six_step(ADDRESS, clock, OPTIONS)
    yield made
    made.close()
    made.close()


def test_identity(drive: Cia402SixStep) -> None:
    assert drive.identity.model == "Bench drive"
    assert drive.identity.serial_number == "815"


def test_payloads_of_a_run(drive: Cia402SixStep, node: Node) -> None:
    with drive.running():
        assert node.state is PowerState.OPERATION_ENABLED
        assert node.values[0x6061, 0] == -1
    assert node.writes == [
        (0x6060, b"\xff"),
        (0x6040, b"\x06\x00"),
        (0x6040, b"\x07\x00"),
        (0x6040, b"\x0f\x00"),
        (0x6040, b"\x00\x00"),
        (0x6040, b"\x00\x00"),
    ]
    assert node.state is PowerState.SWITCH_ON_DISABLED


def test_the_frames_of_the_readings(drive: Cia402SixStep, node: Node, clock: Any) -> None:
    node.values |= {(0x6079, 0): 24_018, (0x2010, 0): -1250, (0x606C, 0): -12_345, (0x2011, 0): 0b101}
    clock.time = 3.0
    with can.Bus(interface="virtual", channel=CHANNEL) as bus:
        readings = [drive.measure_bus_voltage(), drive.measure_bus_current(), drive.measure_frequency()]
        assert drive.hall_state() == (True, False, True)
        frames = []
        while (message := bus.recv(0)) is not None:
            frames.append((message.arbitration_id, bytes(message.data).hex(" ")))
    assert [(reading.value, reading.unit, reading.time) for reading in readings] == [
        (24.018, "V", 3.0),
        (-1.25, "A", 3.0),
        (-123.45, "Hz", 3.0),
    ]
    state = [(0x606, "40 41 60 00 00 00 00 00"), (0x586, "4b 41 60 00 40 02 00 00")]
    assert frames == [
        *state,
        (0x606, "40 79 60 00 00 00 00 00"),
        (0x586, "43 79 60 00 d2 5d 00 00"),
        *state,
        (0x606, "40 10 20 00 00 00 00 00"),
        (0x586, "43 10 20 00 1e fb ff ff"),
        *state,
        (0x606, "40 6c 60 00 00 00 00 00"),
        (0x586, "43 6c 60 00 c7 cf ff ff"),
        (0x606, "40 11 20 00 00 00 00 00"),
        (0x586, "4f 11 20 00 05 00 00 00"),
    ]


@pytest.mark.parametrize("bits", range(8))
def test_hall_states(drive: Cia402SixStep, node: Node, bits: int) -> None:
    node.values[0x2011, 0] = bits
    assert drive.hall_state() == (bool(bits & 1), bool(bits & 2), bool(bits & 4))


def test_accuracies_that_are_assumed_say_so_and_a_calibration_replaces_them(
    drive: Cia402SixStep, node: Node, clock: Any
) -> None:
    assert drive.measure_bus_voltage().accuracy.source.startswith("assumed, 1 % of reading")
    assert drive.measure_bus_current().accuracy.source.startswith("assumed, 2 % of reading + 20 mA")
    assert drive.measure_frequency().accuracy.resolution == 0.01
    drive.close()
    stated = [Accuracy(gain=share, source="certificate") for share in (1e-3, 2e-3, 3e-3)]
    other = open_cia402_six_step(ADDRESS, clock, Cia402SixStepOptions(*stated))
    readings = (other.measure_bus_voltage(), other.measure_bus_current(), other.measure_frequency())
    assert [reading.accuracy for reading in readings] == stated
    other.close()


class AccidentError(Exception):
    """Anything that may go wrong inside a block."""


@pytest.mark.parametrize("error", [AccidentError, KeyboardInterrupt, SystemExit, MemoryError])
def test_off_after_an_exception(drive: Cia402SixStep, node: Node, error: type[BaseException]) -> None:
    with pytest.raises(error), drive.running():
        raise error
    assert node.state is PowerState.SWITCH_ON_DISABLED
    assert node.writes[-1] == (0x6040, b"\x00\x00")


def test_a_bridge_that_stays_on_is_reported(drive: Cia402SixStep, node: Node) -> None:
    with pytest.raises(ReportedError, match="stays in Operation enabled"), drive.running():
        node.deaf.add(0x00)


def test_a_bridge_that_stays_on_does_not_hide_the_first_error(drive: Cia402SixStep, node: Node) -> None:
    def block() -> None:
        with drive.running():
            node.deaf.add(0x00)
            raise AccidentError

    with pytest.raises(AccidentError) as caught:
        block()
    assert "stays in Operation enabled" in caught.value.__notes__[0]


def test_a_fault_inside_the_block_is_named_and_reset(drive: Cia402SixStep, node: Node) -> None:
    def block() -> None:
        with drive.running():
            node.fail(0x7300)
            drive.measure_bus_current()

    with pytest.raises(ReportedError, match=r"in fault 0x7300 \(sensor\)"):
        block()
    assert node.state is PowerState.SWITCH_ON_DISABLED


def test_a_fault_that_nobody_asked_about_is_not_lost(drive: Cia402SixStep, node: Node) -> None:
    with pytest.raises(ReportedError, match=r"0x2310 \(continuous over-current\)"), drive.running():
        node.fail(0x2310)
    assert node.state is PowerState.SWITCH_ON_DISABLED


def test_a_fault_before_the_start_prevents_it(drive: Cia402SixStep, node: Node) -> None:
    node.fail(0x3220)
    with pytest.raises(ReportedError, match="0x3220"), drive.running():
        pass
    assert (0x6040, b"\x0f\x00") not in node.writes


def test_operation_that_is_not_reached(drive: Cia402SixStep, node: Node) -> None:
    node.deaf.add(0x07)
    with (
        pytest.raises(
            MeasurementError, match=r"after '0x6040 = 7': does not reach operation: stays in Ready to switch"
        ),
        drive.running(),
    ):
        pass
    assert node.state is PowerState.SWITCH_ON_DISABLED


def test_a_mode_that_is_not_shown(drive: Cia402SixStep, node: Node) -> None:
    node.follows_mode = False
    with pytest.raises(MeasurementError, match=r"stays in mode 0 \(0x6061\)"), drive.running():
        pass
    assert (0x6040, b"\x0f\x00") not in node.writes


def test_a_bridge_found_on_is_switched_off_before_the_mode_changes(drive: Cia402SixStep, node: Node) -> None:
    node.values[0x6041, 0] = 0x237
    with drive.running():
        pass
    assert [index for index, _ in node.writes[:3]] == [0x6040, 0x6040, 0x6060]
    assert node.writes[0] == (0x6040, b"\x00\x00")


@pytest.mark.parametrize(
    ("index", "code", "message"),
    [
        (0x6060, 0x06090030, r"write -1 to 0x6060:00'.*Value range of parameter exceeded"),
        (0x6079, 0x08000022, r"read 0x6079:00'.*SDO abort"),
    ],
)
def test_sdo_aborts_are_named(drive: Cia402SixStep, node: Node, index: int, code: int, message: str) -> None:
    node.abort[index] = code
    with pytest.raises(ReportedError, match=message), drive.running():
        drive.measure_bus_voltage()
    assert node.state is PowerState.SWITCH_ON_DISABLED


def test_another_unit_is_refused(node: Node, clock: Any) -> None:
    with pytest.raises(IdentityError, match="serial number 815 answers, expected 1"):
        open_cia402_six_step(ADDRESS, clock, Cia402SixStepOptions(serial_number="1"))


def test_off_although_a_confirmation_on_the_way_down_is_lost(drive: Cia402SixStep, node: Node, clock: Any) -> None:
    with drive.running():
        node.lost = 1
    assert node.state is PowerState.SWITCH_ON_DISABLED
    assert sum(clock.slept) < 0.3


@pytest.mark.parametrize("found", [0x240, 0x231, 0x233, 0x237])
def test_make_safe_waits_no_longer_than_the_bridge_takes(
    drive: Cia402SixStep, node: Node, clock: Any, found: int
) -> None:
    node.values[0x6041, 0] = found
    node.deaf.add(0x00)

    def turn_off_after_a_while() -> None:
        if clock.now() >= 0.1:
            node.values[0x6041, 0] = 0x240

    clock.on_sleep = turn_off_after_a_while
    drive.make_safe()
    assert node.state is PowerState.SWITCH_ON_DISABLED
    assert sum(clock.slept) < 0.12


def test_off_although_the_bus_went_down(drive: Cia402SixStep, node: Node) -> None:
    with drive.running():
        drive._node._connection._bus.disconnect()
    assert node.state is PowerState.SWITCH_ON_DISABLED


def test_a_bus_that_stays_down_is_reported_and_found_again_later(
    drive: Cia402SixStep, node: Node, monkeypatch: pytest.MonkeyPatch
) -> None:
    node.values[0x6041, 0] = 0x237
    bus = drive._node._connection._bus
    bus.disconnect()
    with monkeypatch.context() as patch:
        patch.setattr(can, "Bus", lambda **_: (_ for _ in ()).throw(OSError("No such device")))
        for _ in range(2):
            with pytest.raises(CommunicationError, match="cannot be opened at can://virtual/six-step"):
                drive.make_safe()
    drive.make_safe()
    assert node.state is PowerState.SWITCH_ON_DISABLED


# Two nodes on one bus -----------------------------------------------------------------------------------------------


@pytest.fixture
def other() -> Iterator[Node]:
    made = Node(5)
    yield made
    made.network.disconnect()


LIMITS = Cia402Options(maximum_current=15.0, maximum_frequency=400.0)


@pytest.mark.parametrize("shared", [True, False])
@pytest.mark.parametrize("first", ["drive", "inverter"])
def test_inverter_and_drive_on_one_bus_close_in_any_order(
    node: Node, other: Node, clock: Any, shared: bool, first: str
) -> None:
    buses = CanBuses()
    drive = open_cia402_six_step(ADDRESS, clock, OPTIONS, buses=buses)
    inverter = open_cia402_inverter(INVERTER, clock, LIMITS, buses=buses if shared else None)
    with drive.running():
        assert (node.state, other.state) == (PowerState.OPERATION_ENABLED, PowerState.SWITCH_ON_DISABLED)
        assert inverter.measure_frequency().value == 0.0
    assert len(virtual.channels[CHANNEL]) == 2 + (1 if shared else 2)  # the two nodes' own, and ours
    for instrument in (drive, inverter) if first == "drive" else (inverter, drive):
        instrument.make_safe()
        instrument.close()
    again = open_cia402_six_step(ADDRESS, clock, OPTIONS, buses=buses)
    assert again.hall_state() == (False, False, False)
    again.close()


def test_what_fails_to_open_leaves_the_bus_to_the_other(node: Node, clock: Any) -> None:
    buses = CanBuses()
    drive = open_cia402_six_step(ADDRESS, clock, OPTIONS, buses=buses)
    with pytest.raises(CommunicationError, match="no usable reply"):
        open_cia402_inverter(INVERTER, clock, LIMITS, buses=buses)
    with pytest.raises(CommunicationError, match=r"node 6 .* is in use"):
        open_cia402_six_step(ADDRESS, clock, OPTIONS, buses=buses)
    with pytest.raises(CommunicationError, match="open with 500000 bit/s already"):
        open_cia402_inverter(f"{INVERTER}&bitrate=250000", clock, LIMITS, buses=buses)
    assert drive.hall_state() == (False, False, False)
    drive.close()


def test_a_bus_opened_anew_serves_both_nodes(node: Node, other: Node, clock: Any) -> None:
    buses = CanBuses()
    drive = open_cia402_six_step(ADDRESS, clock, OPTIONS, buses=buses)
    inverter = open_cia402_inverter(INVERTER, clock, LIMITS, buses=buses)
    drive._node._connection._bus.disconnect()
    inverter.make_safe()
    drive.make_safe()
    assert (node.writes[-1], other.writes[-1]) == ((0x6040, b"\x00\x00"),) * 2
    inverter.close()
    drive.close()


# The watch over the process -----------------------------------------------------------------------------------------


WATCHED = Cia402SixStepOptions(heartbeat_time=0.15, heartbeat_node=0x7E)


def heartbeats(bus: can.BusABC, count: int) -> list[bytes]:
    found: list[bytes] = []
    while len(found) < count:
        message = bus.recv(2.0)
        assert message is not None, "no heartbeat"
        if message.arbitration_id == 0x77E:
            found.append(bytes(message.data))
    return found


@pytest.mark.parametrize("with_option", [True, False])
def test_a_consumer_heartbeat_is_armed_fed_and_put_back(clock: Any, with_option: bool) -> None:
    node = Node(consumer={1: 0x00100064, 2: 0}, abort_option=1 if with_option else None)
    with can.Bus(interface="virtual", channel=CHANNEL) as bus:
        drive = open_cia402_six_step(ADDRESS, clock, WATCHED)
        assert node.entry(1) == 0x00100064  # another's entry
        assert node.entry(2) == 0x7E << 16 | 150
        assert heartbeats(bus, 3) == [b"\x05"] * 3
    armed = [(0x6007, b"\x02\x00")] if with_option else []
    assert node.writes == [*armed, (0x1016, bytes.fromhex("96 00 7e 00"))]
    drive.close()
    assert node.entry(2) == 0
    assert node.values.get((0x6007, 0)) == (1 if with_option else None)
    node.network.disconnect()


def test_the_entry_of_a_process_that_died_is_taken_over_and_cleared(clock: Any) -> None:
    node = Node(consumer={1: 0, 2: 0x7E << 16 | 500})
    drive = open_cia402_six_step(ADDRESS, clock, WATCHED)
    assert (node.entry(1), node.entry(2)) == (0, 0x7E << 16 | 150)
    drive.close()
    assert node.entry(2) == 0
    node.network.disconnect()


def test_a_drive_without_a_watch_stays_as_it_is(node: Node, clock: Any) -> None:
    traffic: list[tuple[str, str]] = []
    drive = open_cia402_six_step(
        ADDRESS, clock, WATCHED, traffic=lambda direction, text: traffic.append((direction, text))
    )
    drive.close()
    assert node.writes == []
    assert ("read", "no such object") in traffic


def test_nothing_is_asked_where_no_watch_is_wanted(clock: Any) -> None:
    node = Node(consumer={1: 0}, abort_option=1)
    drive = open_cia402_six_step(ADDRESS, clock, OPTIONS)
    drive.close()
    assert node.writes == []
    node.network.disconnect()


def test_a_heartbeat_goes_on_over_a_bus_opened_anew_and_ends_with_the_drive(clock: Any) -> None:
    node = Node(consumer={1: 0})
    drive = open_cia402_six_step(ADDRESS, clock, WATCHED)
    drive._node._connection.reopen()
    with can.Bus(interface="virtual", channel=CHANNEL) as bus:
        assert heartbeats(bus, 2)
    node.network.disconnect()  # the drive is gone: closing must not depend on it
    drive.close()


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"heartbeat_time": 0.01}, SetpointError, r"heartbeat_time = 0\.01 s is outside 0\.05 … 65\.535 s"),
        ({"heartbeat_time": 1.0, "heartbeat_node": 0}, SetpointError, "heartbeat_node = 0"),
        ({"heartbeat_time": 1.0}, ReportedError, r"all 1 entries .* are taken.*heartbeat_time = 0"),
    ],
)
def test_a_watch_that_cannot_be_armed_is_refused(
    clock: Any, options: dict[str, Any], error: type[Exception], message: str
) -> None:
    node = Node(consumer={1: 0x00100064}, abort_option=1)
    with pytest.raises(error, match=message):
        open_cia402_six_step(ADDRESS, clock, Cia402SixStepOptions(**options))
    assert node.writes == []
    node.network.disconnect()


def test_an_abort_other_than_absence_is_not_passed_over(clock: Any) -> None:
    node = Node(consumer={1: 0})
    node.abort[0x1016] = 0x08000022
    with pytest.raises(ReportedError, match=r"read 0x1016:00'.*SDO abort"):
        open_cia402_six_step(ADDRESS, clock, WATCHED)
    node.network.disconnect()
