"""Dynamometer on Modbus: bytes on the wire, registers, settling, and a drive that is off at the end."""

import math
import os
import select
import socket
import threading
import tty
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.interfaces import (
    Accuracy,
    CommunicationError,
    MeasurementError,
    ReportedError,
    SetpointError,
)
from drivers.modbus.delta_c2000 import frequency_register
from drivers.modbus.delta_dyn200 import DeltaDyn200, open_delta_dyn200
from drivers.modbus.line import open_line, signed_16, signed_32
from drivers.modbus.options import DeltaDyn200Options

RPM = 2 * math.pi / 60


class Units:
    """Registers of the two units, with a machine that follows its command at once."""

    def __init__(self) -> None:
        self.registers: dict[tuple[int, int], int] = {
            **{(1, address): 0 for address in (0x2000, 0x2001, 0x2002, 0x2100, 0x2102, 0x2103, 0x2104)},
            **{(1, address): 0 for address in (0x000A, 0x0016, 0x0B22)},
            **{(2, address): 0 for address in range(0x24)},
            (2, 0x09): 4,
            (2, 0x21): 2,
        }
        self.writes: list[tuple[int, int, list[int]]] = []
        self.refuse: dict[tuple[int, int], int] = {}  # (unit, address) → exception
        self.stuck = False
        self.slip = 1.0

    def answer(self, unit: int, pdu: bytes) -> bytes | None:
        function, address, third = pdu[0], int.from_bytes(pdu[1:3], "big"), int.from_bytes(pdu[3:5], "big")
        if unit not in (1, 2):
            return None
        if code := self.refuse.get((unit, address)):
            return bytes([function | 0x80, code])
        if function == 3:
            wanted = [(unit, address + offset) for offset in range(third)]
            if any(key not in self.registers for key in wanted):
                return bytes([0x83, 2])
            data = b"".join(self.registers[key].to_bytes(2, "big") for key in wanted)
            return bytes([3, len(data)]) + data
        values = [third] if function == 6 else [int.from_bytes(pdu[i : i + 2], "big") for i in range(6, len(pdu), 2)]
        self.writes.append((unit, address, values))
        for offset, value in enumerate(values):
            self.registers[unit, address + offset] = value
        self.follow()
        return pdu[:5]

    def follow(self) -> None:
        if self.stuck:
            return
        command = self.registers[1, 0x2000]
        running, reverse = command & 3 == 2, command >> 4 & 3 == 2
        counts = self.registers[1, 0x2001] if running else 0
        self.registers[1, 0x2103] = counts
        if running and self.registers[1, 0x000A] == 0:
            self.set_speed(counts * 0.01 * 60 / 2 * self.slip, reverse)

    def set_speed(self, rpm: float, reverse: bool = False) -> None:
        self.set_32(0x02, round(rpm * 100))
        self.set_32(0x12, int(reverse))

    def set_32(self, address: int, value: int) -> None:
        self.registers[2, address], self.registers[2, address + 1] = value >> 16 & 0xFFFF, value & 0xFFFF

    @property
    def command(self) -> int:
        return self.registers[1, 0x2000]


class TcpServer:
    """Modbus TCP on loopback, keeping every request to the byte."""

    def __init__(self, units: Units) -> None:
        self.units = units
        self.requests: list[str] = []
        self.hang_up_on = 0  # how many requests are answered by closing the connection, unheard
        self.garble: Callable[[bytes], bytes] = lambda reply: reply
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"tcp://127.0.0.1:{self.listener.getsockname()[1]}"
        self.wake, self.woken = os.pipe()
        self.thread = threading.Thread(target=self.serve)
        self.thread.start()

    def serve(self) -> None:
        connections: list[socket.socket] = []
        while True:
            ready, _, _ = select.select([self.listener, self.wake, *connections], [], [])
            if self.wake in ready:
                break
            for source in ready:
                if source is self.listener:
                    connections.append(self.listener.accept()[0])
                    continue
                request = source.recv(300)
                if not request or self.hang_up_on:
                    self.hang_up_on -= bool(request)
                    connections.remove(source)
                    source.close()
                    continue
                self.requests.append(request.hex(" "))
                reply = self.units.answer(request[6], request[7:])
                if reply is not None:
                    head = request[:4] + (len(reply) + 1).to_bytes(2, "big") + request[6:7]
                    source.sendall(self.garble(head + reply))
        for source in connections:
            source.close()

    def close(self) -> None:
        os.write(self.woken, b"x")
        self.thread.join()
        self.listener.close()
        os.close(self.wake)
        os.close(self.woken)


@pytest.fixture
def units() -> Units:
    return Units()


@pytest.fixture
def server(units: Units) -> Iterator[TcpServer]:
    made = TcpServer(units)
    yield made
    made.close()


OPTIONS = DeltaDyn200Options(maximum_speed=200.0, settle_timeout=2.0)


@pytest.fixture
def dynamometer(server: TcpServer, clock: Any) -> Iterator[DeltaDyn200]:
    made = open_delta_dyn200(server.address, clock, OPTIONS)
    yield made
    made.close()
    made.close()


def test_bytes_of_one_measurement(dynamometer: DeltaDyn200, units: Units, server: TcpServer, clock: Any) -> None:
    units.set_32(0x00, -12345)
    units.set_speed(1500.25)
    units.set_32(0x04, 1939)
    server.requests.clear()
    clock.time = 4.0
    reading = dynamometer.measure()
    # One block of six registers, then the direction; transaction numbers are the client's.
    assert [request[6:] for request in server.requests] == [
        "00 00 00 06 02 03 00 00 00 06",
        "00 00 00 06 02 03 00 12 00 02",
    ]
    assert reading.torque == -1.2345
    assert reading.speed == pytest.approx(1500.25 * RPM)
    assert reading.power == -193.9
    assert reading.time == 4.0
    assert reading.torque_accuracy.offset == pytest.approx(0.005)
    assert "typical of its class" in reading.torque_accuracy.source
    assert reading.torque_accuracy.resolution == pytest.approx(1e-4)
    assert reading.speed_accuracy.resolution == pytest.approx(0.01 * RPM)


def test_reverse_is_negative(dynamometer: DeltaDyn200, units: Units) -> None:
    units.set_speed(600.0, reverse=True)
    assert dynamometer.measure().speed == pytest.approx(-600 * RPM)


def test_bytes_of_a_driving_block(dynamometer: DeltaDyn200, units: Units, server: TcpServer) -> None:
    units.registers[1, 0x000A] = 2
    server.requests.clear()
    with dynamometer.driving_speed(-100.0):
        assert units.command == 0x22
    writes = [request[18:] for request in server.requests if request[18:23] == "01 06"]
    # 100 rad/s with two pole pairs is 31.83 Hz = 3183 = 0x0C6F.
    assert writes == [
        "01 06 00 16 00 01",
        "01 06 00 0a 00 00",
        "01 06 20 01 0c 6f",
        "01 06 20 00 00 22",
        "01 06 20 00 00 01",
    ]
    assert units.command == 0x01


def test_bytes_of_a_constant_torque(dynamometer: DeltaDyn200, units: Units) -> None:
    with dynamometer.driving_torque(-1.25):
        assert units.registers[1, 0x0B22] == 0xFF06  # −250 per mille of 5 N·m
        assert units.registers[1, 0x000A] == 2
        assert units.command == 0x12
    assert units.command == 0x01
    assert units.registers[1, 0x0B22] == 0


def test_speed_changes_within_the_block(dynamometer: DeltaDyn200, units: Units) -> None:
    with dynamometer.driving_speed(50.0):
        dynamometer.set_speed(-80.0)
        assert dynamometer.measure().speed == pytest.approx(-80.0, rel=1e-3)


def test_slip_within_the_tolerance_is_settled(dynamometer: DeltaDyn200, units: Units) -> None:
    units.slip = 0.96
    with dynamometer.driving_speed(100.0):
        assert dynamometer.measure().speed == pytest.approx(96.0, rel=1e-3)


def test_a_speed_that_does_not_settle_ends_disabled(dynamometer: DeltaDyn200, units: Units, clock: Any) -> None:
    units.slip = 0.5
    with (
        pytest.raises(MeasurementError, match=r"50 rad/s 2 s after 100 rad/s was commanded"),
        dynamometer.driving_speed(100.0),
    ):
        pass
    assert units.command == 0x01
    assert clock.now() == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
@pytest.mark.parametrize("way", ["driving_speed", "driving_torque"])
def test_disabled_after_an_exception(
    dynamometer: DeltaDyn200, units: Units, way: str, error: type[BaseException]
) -> None:
    with pytest.raises(error), getattr(dynamometer, way)(2.0):
        raise error
    assert units.command == 0x01
    assert units.registers[1, 0x2103] == 0


def test_a_drive_that_does_not_stop_is_reported(dynamometer: DeltaDyn200, units: Units) -> None:
    with pytest.raises(ReportedError, match=r"still puts out 31\.83 Hz.*emergency"), dynamometer.driving_speed(100.0):
        units.stuck = True


def test_stop_brakes_waits_and_disables(dynamometer: DeltaDyn200, units: Units, clock: Any) -> None:
    units.set_speed(1000.0)
    units.stuck = True

    def slow_down() -> None:
        units.set_speed(max(0.0, dynamometer.measure().speed / RPM - 300.0))

    clock.on_sleep = slow_down
    dynamometer.stop()
    runs = [values for unit, address, values in units.writes if (unit, address) == (1, 0x2000)]
    assert runs == [[0x01], [0x12], [0x01]]
    assert clock.now() == pytest.approx(0.2)
    clock.on_sleep = None
    units.set_speed(1000.0)
    with pytest.raises(MeasurementError, match="still turns"):
        dynamometer.stop()
    assert units.command == 0x01


def test_zeroing_writes_zero_to_the_torque(dynamometer: DeltaDyn200, units: Units, server: TcpServer) -> None:
    server.requests.clear()
    dynamometer.zero_torque()
    assert server.requests[-1][18:] == "02 10 00 00 00 02 04 00 00 00 00"
    units.set_speed(100.0)
    with pytest.raises(MeasurementError, match="the shaft turns"):
        dynamometer.zero_torque()


def test_make_safe(dynamometer: DeltaDyn200, units: Units) -> None:
    dynamometer.make_safe()
    assert units.command == 0x01
    assert units.registers[1, 0x0016] == 1


def test_command_zero_in_the_midst_of_anything(dynamometer: DeltaDyn200, units: Units, server: TcpServer) -> None:
    with dynamometer.driving_torque(2.0):
        before = len(server.requests)
        server.hang_up_on = 1
        dynamometer.command_zero()
        assert (units.registers[1, 0x0B22], units.registers[1, 0x2001]) == (0, 0)
        assert [request[18:] for request in server.requests[before + 1 :]] == [
            "01 06 0b 22 00 00",
            "01 06 20 01 00 00",
        ]


@pytest.mark.parametrize("broken", [1, 2])
def test_make_safe_outlives_broken_connections(
    dynamometer: DeltaDyn200, units: Units, server: TcpServer, clock: Any, broken: int
) -> None:
    with dynamometer.driving_speed(50.0):
        server.hang_up_on = broken
        dynamometer.make_safe()
        assert units.command == 0x01
    assert sum(clock.slept) < 0.3


def test_disabled_although_the_connection_breaks_at_the_end_of_a_block(
    dynamometer: DeltaDyn200, units: Units, server: TcpServer
) -> None:
    with dynamometer.driving_torque(1.0):
        server.hang_up_on = 1
    assert units.command == 0x01
    assert units.registers[1, 0x0B22] == 0


def test_make_safe_waits_no_longer_than_the_drive_takes(dynamometer: DeltaDyn200, units: Units, clock: Any) -> None:
    units.registers[1, 0x2103] = 3000
    units.stuck = True

    def coast() -> None:
        if clock.now() >= 0.1:
            units.registers[1, 0x2103] = 0

    clock.on_sleep = coast
    dynamometer.make_safe()
    assert 0.1 <= sum(clock.slept) < 0.13


def test_a_dynamometer_that_is_gone_is_reported(units: Units, clock: Any) -> None:
    server = TcpServer(units)
    dynamometer = open_delta_dyn200(server.address, clock, OPTIONS)
    server.close()
    with pytest.raises(CommunicationError, match="cannot be opened again"):
        dynamometer.make_safe()
    dynamometer.close()


@pytest.mark.parametrize(
    ("way", "value", "message"),
    [
        ("driving_speed", 201.0, "speed = 201 rad/s is outside -200 … 200 rad/s, the limit of the station"),
        ("driving_speed", math.nan, "speed = nan"),
        ("driving_torque", -5.5, "torque = -5.5 N·m is outside -5 … 5 N·m, the limit of the model"),
    ],
)
def test_limits(dynamometer: DeltaDyn200, units: Units, way: str, value: float, message: str) -> None:
    with pytest.raises(SetpointError, match=message), getattr(dynamometer, way)(value):
        pass
    assert units.writes == []


def test_a_fault_of_the_drive_is_named(dynamometer: DeltaDyn200, units: Units) -> None:
    units.registers[1, 0x2100] = 0x0015
    with pytest.raises(ReportedError, match="the drive is in fault 21"), dynamometer.driving_speed(10.0):
        pass


def test_an_exception_names_register_and_meaning(dynamometer: DeltaDyn200, units: Units) -> None:
    units.refuse[1, 0x2001] = 3
    with (
        pytest.raises(
            ReportedError, match=r"2001H of unit 1 \(frequency command\)'.*3 \(illegal data value\) at 2001H"
        ),
        dynamometer.driving_speed(10.0),
    ):
        pass
    assert units.command == 0x01


@pytest.mark.parametrize("code", [10, 11])
def test_a_gateways_unit_that_is_not_there(units: Units, server: TcpServer, clock: Any, code: int) -> None:
    units.refuse[2, 0x08] = code
    with pytest.raises(CommunicationError, match="unit 2 does not answer"):
        open_delta_dyn200(server.address, clock, OPTIONS)


def test_a_wrong_unit_is_silent(server: TcpServer, clock: Any) -> None:
    line = open_line(server.address, "dynamometer", timeout=0.05)
    with pytest.raises(CommunicationError, match=r"unit 7 .*no usable reply"):
        DeltaDyn200(line, clock, DeltaDyn200Options(maximum_speed=1.0, drive_unit=7))
    assert len(server.requests) == 2  # a read is repeated once
    with pytest.raises(CommunicationError, match="write 0001 to 2000H of unit 7"):
        line.write(7, 0x2000, 1, "command")
    assert len(server.requests) == 3  # a write is not
    line.close()


def test_decimals_that_cannot_be(units: Units, server: TcpServer, clock: Any) -> None:
    units.registers[2, 0x09] = 9
    with pytest.raises(CommunicationError, match=r"torque decimals = 9 is outside 0 … 6.*DYN-200"):
        open_delta_dyn200(server.address, clock, OPTIONS)


def test_a_late_reply_is_not_taken_for_another(server: TcpServer) -> None:
    late: list[bytes] = []

    def hold_back(reply: bytes) -> bytes:
        if not late:
            late.append(reply)
            return b""
        return late[0] + reply

    line = open_line(server.address, "dynamometer", timeout=0.05)
    assert line.read(2, 0x20, 2, "speed decimals") == [0, 2]
    server.garble = hold_back
    assert line.read(2, 0x08, 2, "torque decimals") == [0, 4]
    assert line.read(2, 0x20, 2, "speed decimals") == [0, 2]
    line.close()


def test_fewer_registers_than_asked(server: TcpServer) -> None:
    line = open_line(server.address, "dynamometer", timeout=0.05)
    server.garble = lambda reply: reply[:4] + b"\0\x05" + reply[6:8] + b"\x02" + reply[9:11]
    with pytest.raises(CommunicationError, match="1 registers instead of 2"):
        line.read(2, 0x20, 2, "speed decimals")
    line.close()


@pytest.mark.parametrize(
    "address", ["udp://host:1", "tcp://", "rtu:", "tcp://host:port", "nonsense", "rtu:///dev/x?baudrate=0"]
)
def test_addresses_that_are_none(address: str) -> None:
    with pytest.raises(CommunicationError, match="is no Modbus address"):
        open_line(address, "dynamometer")


def test_nothing_at_the_address() -> None:
    with pytest.raises(CommunicationError, match="cannot be opened at rtu:///dev/nothing"):
        open_line("rtu:///dev/nothing?baudrate=19200", "dynamometer")


def test_rtu_frames_to_the_byte() -> None:
    """The request is the example of the drive's manual: two registers from 2102H of drive 1."""
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    requests: list[str] = []

    def serve() -> None:
        request = os.read(ours, 8)
        requests.append(request.hex(" "))
        os.write(ours, bytes.fromhex("01 03 04 17 70 00 00 fe 5c"))

    thread = threading.Thread(target=serve)
    thread.start()
    line = open_line(f"rtu://{os.ttyname(theirs)}?baudrate=115200", "dynamometer")
    registers = line.read(1, 0x2102, 2, "frequency command and output")
    thread.join()
    line.close()
    os.close(ours)
    os.close(theirs)
    assert requests == ["01 03 21 02 00 02 6f f7"]
    assert registers == [6000, 0]  # 60.00 Hz commanded, standing still


@given(st.integers(-(1 << 31), (1 << 31) - 1))
def test_signed_numbers_over_two_registers(number: int) -> None:
    raw = number & 0xFFFFFFFF
    assert signed_32(raw >> 16, raw & 0xFFFF) == number


@given(st.integers(-(1 << 15), (1 << 15) - 1))
def test_signed_registers(number: int) -> None:
    assert int.from_bytes(signed_16(number).to_bytes(2, "big"), "big", signed=False) == number % (1 << 16)


def test_a_number_that_fits_no_register() -> None:
    with pytest.raises(ValueError, match="40000 does not fit"):
        signed_16(40000)


@given(st.floats(-1000, 1000), st.integers(1, 6))
def test_frequency_command_is_within_half_a_step(speed: float, pole_pairs: int) -> None:
    frequency = frequency_register(speed, pole_pairs) * 0.01
    assert abs(frequency - abs(speed) * pole_pairs / (2 * math.pi)) <= 0.0050001


def test_options_replace_accuracy_and_direction(server: TcpServer, units: Units, clock: Any) -> None:
    accuracy = Accuracy(gain=2e-3, source="certificate")
    options = DeltaDyn200Options(
        maximum_speed=200.0, torque_accuracy=accuracy, speed_accuracy=accuracy, direction_from="command"
    )
    dynamometer = open_delta_dyn200(server.address, clock, options)
    with dynamometer.driving_speed(-20.0):
        units.set_32(0x12, 0)
        reading = dynamometer.measure()
    assert reading.speed == pytest.approx(-20.0, rel=1e-2)
    assert reading.torque_accuracy is reading.speed_accuracy is accuracy
    dynamometer.close()


WATCHED = {"maximum_speed": 300.0, "watchdog_time": 0.5}


def test_the_drive_watches_over_its_master(units: Units, server: TcpServer, clock: Any) -> None:
    units.registers |= {(1, 0x0902): 3, (1, 0x0903): 0, (1, 0x2101): 0}
    made = open_delta_dyn200(server.address, clock, DeltaDyn200Options(**WATCHED))
    assert units.writes == [(1, 0x0902, [2]), (1, 0x0903, [5])]
    fed = threading.Event()
    server.garble = lambda reply: fed.set() or reply if server.requests[-1].endswith("03 21 01 00 01") else reply
    with made.driving_speed(50.0):
        # Nobody asks anything here, and the drive is asked nevertheless.
        assert fed.wait(10.0)
    made.close()
    assert units.writes[-2:] == [(1, 0x0903, [0]), (1, 0x0902, [3])]
    before = len(units.writes)
    made.close()
    assert len(units.writes) == before


def test_parameters_that_are_so_already_are_not_written(units: Units, server: TcpServer, clock: Any) -> None:
    units.registers |= {(1, 0x0902): 2, (1, 0x0903): 5, (1, 0x2101): 0}
    made = open_delta_dyn200(server.address, clock, DeltaDyn200Options(**WATCHED))
    made.close()
    assert units.writes == []


def test_a_drive_without_such_a_watch_is_told_of(units: Units, server: TcpServer, clock: Any) -> None:
    with pytest.raises(ReportedError, match=r"0902H.*09-02"):
        open_delta_dyn200(server.address, clock, DeltaDyn200Options(**WATCHED))
    with pytest.raises(SetpointError, match=r"watchdog_time = 0.1 s is outside 0.5 … 100 s"):
        open_delta_dyn200(server.address, clock, DeltaDyn200Options(maximum_speed=300.0, watchdog_time=0.1))


def test_a_guarding_process_asks_nothing_before_it_must_act(units: Units, server: TcpServer, clock: Any) -> None:
    units.registers[1, 0x2100] = 49
    options = DeltaDyn200Options(**WATCHED)
    made = open_delta_dyn200(server.address, clock, options, guarding=True)
    assert server.requests == []
    made.command_zero()
    made.make_safe()
    assert units.command == 0x01
    assert made.measure().speed == 0.0
    made.close()
