"""Drives as their makers' data sheets describe them: which objects they have, what they leave to the station, what they refuse."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

import can
import pytest
from canopen.objectdictionary import INTEGER16, INTEGER32, UNSIGNED8, UNSIGNED16, UNSIGNED32
from canopen.sdo.exceptions import SdoAbortedError

from drivers.catalogue import Surroundings
from drivers.cia402.inverter import Cia402Inverter
from drivers.cia402.options import Cia402Options
from drivers.cia402.power_state import PowerState
from drivers.interfaces import InstrumentError, MeasurementError, ReportedError
from tests.drivers.can_bus.conftest import CHANNEL, STATED, Node

NODE = 5
ADDRESS = f"can://virtual/{CHANNEL}?node={NODE}"
#: Objects beside those that every node of these tests has: type and default, 0 where none is stated. None is left out.
ELMO_GOLD = {
    0x605A: (INTEGER16, 2), 0x6072: (UNSIGNED16, 50_000), 0x6073: (UNSIGNED16, 50_000), 0x6075: (UNSIGNED32, 0),
    0x6076: (UNSIGNED32, 0), 0x6078: (INTEGER16, 0), 0x607E: (UNSIGNED8, 0), 0x607F: (UNSIGNED32, 2_000_000_000),
    0x6080: (UNSIGNED32, 0xFFFFFFFF), 0x6083: (UNSIGNED32, 2_000_000_000), 0x6084: (UNSIGNED32, 2_000_000_000),
    0x6087: (UNSIGNED32, 10_000_000), 0x6502: (UNSIGNED32, 0b11_1110_1101),
}  # fmt: skip
ELMO_GROUP = {0x608F: [2, 1, 1], 0x6091: [2, 1, 1], 0x6092: [2, 1, 1], 0x6096: [2, 1, 1]}
YIYOU = {
    0x605A: (INTEGER16, 1), 0x6072: (INTEGER16, 1000), 0x6075: None, 0x607F: (UNSIGNED32, 4_369_066),
    0x6083: (UNSIGNED32, 0), 0x6084: (UNSIGNED32, 0), 0x6087: (INTEGER32, 0), 0x6502: (UNSIGNED32, 0x03CD),
}  # fmt: skip
YIYOU_GROUP = {0x6091: [2, 5_308_416, 5_308_416]}


class Sold(Node):
    """A drive with a data sheet's objects; what is commanded is there at once."""

    def __init__(self, objects: dict[int, Any], group: dict[int, list[int]]) -> None:
        self.objects, self.group = objects, group
        self.fails_at = -1  # the how many-th request from now on is aborted
        super().__init__(NODE)
        self.values |= {(index, 0): stated[1] for index, stated in objects.items() if stated is not None}

    def dictionary(self) -> Any:
        for index, stated in self.objects.items():
            self.types.pop(index, None)
            if stated is not None:
                self.types[index] = stated[0]
        dictionary = super().dictionary()
        for index, values in self.group.items():
            self.add_array(dictionary, index, values)
        return dictionary

    def count(self) -> None:
        self.fails_at -= 1
        if self.fails_at == 0:
            raise SdoAbortedError(0x08000022)

    def read(self, *, index: int, subindex: int, od: Any) -> Any:
        self.count()
        return super().read(index=index, subindex=subindex, od=od)

    def written(self, *, index: int, subindex: int, od: Any, data: bytes) -> None:
        self.count()
        super().written(index=index, subindex=subindex, od=od, data=data)
        on = self.state is PowerState.OPERATION_ENABLED
        for actual, target in ((0x606C, 0x60FF), (0x6077, 0x6071), (0x6078, 0x6071)):
            if (actual, 0) in self.values:
                self.values[actual, 0] = self.values[target, 0] if on else 0


@pytest.fixture
def sold() -> Iterator[Callable[..., Sold]]:
    made: list[Sold] = []

    def make(objects: dict[int, Any], group: dict[int, list[int]]) -> Sold:
        made.append(Sold(objects, group))
        return made[-1]

    yield make
    for node in made:
        node.network.disconnect()


def opened(clock: Any, **stated: Any) -> Cia402Inverter:
    options = Cia402Options(**{"maximum_current": 15.0, "maximum_frequency": 400.0, "heartbeat_time": 0.0, **stated})
    return Cia402Inverter.open(ADDRESS, options, Surroundings(clock), "inverter")


def test_what_an_elmo_gold_leaves_open_is_asked_for_key_by_key(sold: Any, clock: Any) -> None:
    node = sold(ELMO_GOLD, ELMO_GROUP)
    stated: dict[str, Any] = {}
    for said, settle in (
        ("State current_scale", {"current_scale": 2**0.5}),
        (r"rated current \(0x6075\) is 0", (0x6075, 10_000)),
        (r"rated torque \(0x6076\) is 0", (0x6076, 2_000)),
        ("State velocity_unit", {"velocity_unit": "counts/s"}),
        ("Set increments_per_turn", {"increments_per_turn": 65_536}),
        ("State pole_pairs", {"pole_pairs": 5}),
    ):
        with pytest.raises(ReportedError, match=said):
            opened(clock, **stated)
        if isinstance(settle, dict):
            stated |= settle
        else:
            node.values[settle[0], 0] = settle[1]
    assert node.words == []
    inverter = opened(clock, **stated)
    with inverter.driving_current(-7.0711):
        assert node.writes[-1] == (0x6071, (-500).to_bytes(2, "little", signed=True))
        assert inverter.measure_current().value == pytest.approx(-7.0711, abs=1e-4)
    with (
        pytest.raises(InstrumentError, match=r"the current that its load takes.*State field_current"),
        inverter.driving_frequency(10.0, 1.0),
    ):
        pass
    inverter.close()
    assert node.values[0x6060, 0] == 0


def test_a_yiyou_servo_by_what_its_station_states(sold: Any, clock: Any) -> None:
    node = sold(YIYOU, YIYOU_GROUP)
    stated = {"current_scale": 1.0, "pole_pairs": 10, "velocity_unit": "counts/s", "increments_per_turn": 65_536}
    with pytest.raises(ReportedError, match=r"does not say the motor's rated current \(0x6075\)\. State rated_current"):
        opened(clock, **stated)
    inverter = opened(clock, **stated, rated_current=10.0, field_current=STATED["field_current"])
    with inverter.driving_frequency(-20.0, 2.0):
        # Two turns a second of 65536 counts: fffe0000h.
        assert node.writes[-1] == (0x60FF, bytes.fromhex("00 00 fe ff"))
        assert inverter.measure_frequency().value == -20.0
    # Above 6072h (1000 ‰) and above 607Fh (4369066 counts a second are 666.7 Hz).
    with pytest.raises(ReportedError, match=r"0x6072 is 1000 ‰ of rated \(10 A\)"), inverter.driving_current(10.1):
        pass
    node.values[0x607F, 0] = 1000
    with pytest.raises(ReportedError, match=r"0x607F is 1000 \(0\.152588 Hz\)"), inverter.driving_frequency(10.0, 1.0):
        pass
    inverter.close()


@pytest.mark.parametrize(
    ("modes", "turns", "drives"), [(1 << 1, True, False), (1 << 3, False, True), (1 << 2 | 1 << 9, True, True)]
)
def test_modes_are_the_drives(sold: Any, clock: Any, modes: int, turns: bool, drives: bool) -> None:
    own = {
        0x6502: (UNSIGNED32, modes),
        0x6042: (INTEGER16, 0),
        0x6044: (INTEGER16, 0),
        0x60A9: (UNSIGNED32, 0x00B44700),
    }
    node = sold(own, {})
    inverter = opened(clock, current_scale=1.0, pole_pairs=4, field_current=STATED["field_current"])
    if turns and modes == 1 << 1:
        # The velocity mode: 16 bits of rpm, 300 rpm of 4 pole pairs.
        node.values[0x6044, 0] = 300
        with inverter.driving_frequency(20.0, 1.0):
            assert (0x6060, b"\x02") in node.writes
            assert node.writes[-1] == (0x6042, b"\x2c\x01")
            assert inverter.measure_frequency().value == 20.0
    elif not turns:
        with (
            pytest.raises(InstrumentError, match="cannot turn at a commanded frequency"),
            inverter.driving_frequency(20.0, 1.0),
        ):
            pass
    else:
        with inverter.driving_frequency(20.0, 1.0):
            assert (0x6060, b"\x03") in node.writes
        # No profile torque: cyclic synchronous torque in its place.
        with inverter.driving_current(1.0):
            assert (0x6060, b"\x0a") in node.writes
    if not drives:
        with pytest.raises(InstrumentError, match="no mode that regulates its torque"), inverter.driving_current(1.0):
            pass
    inverter.command_zero()
    inverter.close()


def test_what_the_last_user_left_is_set_told_and_given_back(sold: Any, clock: Any) -> None:
    own = ELMO_GOLD | {0x60B1: (INTEGER32, -5), 0x60B2: (INTEGER16, 7), 0x607E: (UNSIGNED8, 0xC0)}
    node = sold(own | {0x6075: (UNSIGNED32, 10_000), 0x6076: (UNSIGNED32, 2_000)}, {})
    node.values[0x6060, 0] = node.values[0x6061, 0] = 8
    inverter = opened(clock, **STATED)
    found = {one.query[:6]: one for one in inverter.found_state}
    assert (found["0x607E"].found, found["0x607E"].changed) == ("192", True)
    assert (found["0x60B1"].found, found["0x60B2"].found) == ("-5", "7")
    assert (found["0x6072"].found, found["0x6072"].wanted) == ("50000", "")
    assert inverter.found_state[0].found == "unknown"
    assert [node.values[index, 0] for index in (0x607E, 0x60B1, 0x60B2)] == [0, 0, 0]
    with inverter.driving_current(1.0):
        assert node.values[0x6061, 0] == 4
    inverter.close()
    assert [node.values[index, 0] for index in (0x607E, 0x60B1, 0x60B2, 0x6060)] == [0xC0, -5, 7, 8]


def test_a_drive_that_is_refused_is_left_as_it_was_found(sold: Any, clock: Any) -> None:
    own = ELMO_GOLD | {0x607E: (UNSIGNED8, 0xC0), 0x60B2: (INTEGER16, 7)}
    node = sold(own | {0x6075: (UNSIGNED32, 10_000), 0x6076: (UNSIGNED32, 2_000)}, {})
    with pytest.raises(ReportedError, match="State velocity_unit"):
        opened(clock, current_scale=1.0)
    assert [value for index, value in node.writes if index == 0x607E] == [b"\x00", b"\xc0"]
    assert [node.values[index, 0] for index in (0x607E, 0x60B2)] == [0xC0, 7]


def test_a_contradicted_rating_and_two_motors_ratings(sold: Any, clock: Any) -> None:
    node = sold(ELMO_GOLD | {0x6075: (UNSIGNED32, 10_000), 0x6076: (UNSIGNED32, 2_000)}, {})
    with pytest.raises(ReportedError, match=r"0x6075\) is 10 A, the station file says 12 A"):
        opened(clock, **STATED, rated_current=12.0)
    inverter = opened(clock, **STATED)
    node.types.pop(0x6078)
    real, node.node._read_callbacks[:] = node.read, []

    def another(*, index: int, subindex: int, od: Any) -> Any:
        value = real(index=index, subindex=subindex, od=od)
        return value // 2 if index == 0x6078 else value

    node.node.add_read_callback(another)
    with (
        pytest.raises(MeasurementError, match=r"0x6077, 900 ‰\) and current \(0x6078, 450 ‰\) differ"),
        inverter.driving_current(9.0),
    ):
        pass
    assert node.state is PowerState.SWITCH_ON_DISABLED
    inverter.close()


def test_a_drive_that_leaves_operation_is_told_at_once(sold: Any, clock: Any) -> None:
    node = sold(ELMO_GOLD | {0x6075: (UNSIGNED32, 10_000), 0x6076: (UNSIGNED32, 2_000)}, {})
    inverter = opened(clock, **STATED)
    clock.on_sleep = lambda: node.values.update({(0x6041, 0): 0x217})
    real = node.written

    def stuck(**request: Any) -> None:
        real(**request)
        node.values[0x6077, 0] = 0

    node.node._write_callbacks[:] = [stuck]
    with (
        pytest.raises(ReportedError, match="left operation by itself: Quick stop active"),
        inverter.driving_current(5.0),
    ):
        pass
    assert clock.now() < 1.0
    assert node.state is PowerState.SWITCH_ON_DISABLED
    inverter.close()


def test_no_voltage_and_no_control_are_told(sold: Any, clock: Any) -> None:
    node = sold(ELMO_GOLD | {0x6075: (UNSIGNED32, 10_000), 0x6076: (UNSIGNED32, 2_000)}, {})
    inverter = opened(clock, **STATED)
    for word, said in ((0x40, "bit 9 of 0x6041 is 0"), (0x240, "bit 4 of 0x6041 is 0")):
        node.values[0x6041, 0] = word
        node.deaf.add(0x06)
        with pytest.raises(ReportedError, match=said), inverter.driving_current(1.0):
            pass
        node.values[0x6041, 0] = 0x240
    inverter.close()


@pytest.mark.parametrize("step", range(1, 22))
def test_an_abort_at_any_step_leaves_torque_off(sold: Any, clock: Any, step: int) -> None:
    node = sold(ELMO_GOLD | {0x6075: (UNSIGNED32, 10_000), 0x6076: (UNSIGNED32, 2_000)}, {})
    inverter = opened(clock, **STATED)
    node.fails_at = step + 1
    with suppress(ReportedError), inverter.driving_current(1.0):
        inverter.set_current(2.0)
    assert node.fails_at <= 0, "the step was never reached"
    assert node.state is PowerState.SWITCH_ON_DISABLED
    assert node.values[0x6041, 0] & 0x07 == 0
    inverter.close()


def test_an_emergency_is_part_of_the_error(sold: Any, clock: Any) -> None:
    node = sold(ELMO_GOLD | {0x6075: (UNSIGNED32, 10_000), 0x6076: (UNSIGNED32, 2_000)}, {})
    inverter = opened(clock, **STATED)
    with can.Bus(interface="virtual", channel=CHANNEL) as bus:
        bus.send(
            can.Message(arbitration_id=0x80 + NODE, data=bytes.fromhex("10 32 05 01 02 03 04 05"), is_extended_id=False)
        )
        node.fail(0x3210)
        with pytest.raises(
            ReportedError,
            match=r"in fault 0x3210 \(DC link over-voltage\); it sent the emergency 0x3210 \(DC link over-voltage\), "
            r"0x1001 = 05 \(generic, voltage\), 01 02 03 04 05",
        ):
            inverter.make_safe()
        inverter.make_safe()
        # Malformed ones are passed over.
        bus.send(can.Message(arbitration_id=0x80 + NODE, data=b"\x10", is_extended_id=False))
        node.fail(0x2310)
        with pytest.raises(ReportedError, match=r"0x2310 \(continuous over-current\)\. Remove"):
            inverter.make_safe()
    inverter.close()


def test_a_node_that_tells_its_state_is_started_and_given_back(sold: Any, clock: Any) -> None:
    node = sold(ELMO_GOLD | {0x6075: (UNSIGNED32, 10_000), 0x6076: (UNSIGNED32, 2_000)}, {})
    node.node.nmt._state = 127
    with can.Bus(interface="virtual", channel=CHANNEL) as bus:
        node.network.notifier.add_listener(Guarded(node.network))
        inverter = opened(clock, **STATED)
        said = list(iter(lambda: bus.recv(0.0), None))
        assert [(one.arbitration_id, one.dlc) for one in said if one.is_remote_frame] == [(0x705, 1)]
        assert [bytes(one.data) for one in said if one.arbitration_id == 0] == [b"\x01\x05"]
        assert (inverter.found_state[0].found, inverter.found_state[0].changed) == ("pre-operational", True)
        inverter.close()
        assert commands(bus) == [b"\x80\x05"]


def test_a_stopped_node_that_says_so_is_woken_and_stopped_again(sold: Any, clock: Any) -> None:
    node = sold(ELMO_GOLD | {0x6075: (UNSIGNED32, 10_000), 0x6076: (UNSIGNED32, 2_000)}, {})
    respond = node.node.sdo.send_response

    def answer(data: bytes) -> None:
        if node.node.nmt.state != "STOPPED":
            respond(data)
        else:
            # No answer, but its next heartbeat.
            node.network.send_message(0x700 + NODE, b"\x04")

    node.node.sdo.send_response = answer
    node.node.nmt._state = 4
    with can.Bus(interface="virtual", channel=CHANNEL) as bus:
        inverter = opened(clock, **STATED)
        assert (inverter.found_state[0].found, inverter.found_state[0].changed) == ("stopped", True)
        inverter.close()
        assert commands(bus) == [b"\x80\x05", b"\x01\x05", b"\x02\x05"]


def commands(bus: can.BusABC) -> list[bytes]:
    """Return what was sent to network management meanwhile."""
    return [bytes(frame.data) for frame in iter(lambda: bus.recv(0.0), None) if frame.arbitration_id == 0]


class Guarded(can.Listener):
    """Answers node guarding with pre-operational."""

    def __init__(self, network: Any) -> None:
        self.network = network

    def on_message_received(self, msg: can.Message) -> None:
        if msg.is_remote_frame:
            self.network.send_message(0x700 + NODE, b"\x7f")

    def stop(self) -> None:
        """Hold nothing."""
