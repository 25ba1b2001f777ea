"""Whatever bytes a Modbus line delivers, and whatever stands as an address: instrument errors come out, or values."""

import contextlib
import math
import string
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymodbus import FramerType
from pymodbus.client import ModbusTcpClient
from pymodbus.framer.rtu import FramerRTU

from drivers.delta.dyn200 import Dyn200
from drivers.interfaces import InstrumentError
from drivers.transport.modbus.line import ModbusLine, client_for

RPM = 2 * math.pi / 60


class OddClient(ModbusTcpClient):
    """A client whose line delivers arbitrary bytes."""

    def __init__(self, data: bytes) -> None:
        super().__init__("nowhere", retries=0, timeout=0.001)
        self.data = data

    def connect(self) -> bool:
        return True

    def send(self, request: bytes, addr: Any = None) -> int:
        self.request = request
        return len(request)

    def recv(self, size: int | None) -> bytes:
        # Bytes that pass the header's checks reach the decoder; every other one stops at the header.
        return self.request[:2] + b"\0\0" + len(self.data).to_bytes(2, "big") + self.data


@given(st.binary(max_size=30).map(lambda data: b"\x02" + data) | st.binary(max_size=5))
def test_whatever_arrives_only_instrument_errors_come_out(data: bytes) -> None:
    line = ModbusLine(OddClient(data), "dynamometer")
    for action in (
        lambda: line.read(2, 0, 6, "torque, speed, power"),
        lambda: line.write(2, 0, 1, "command"),
        lambda: line.write_block(2, 0, [0, 0], "zero"),
    ):
        with contextlib.suppress(InstrumentError):
            action()


def with_check_sum(data: bytes) -> bytes:
    return data + FramerRTU.compute_CRC(data).to_bytes(2, "big")


class OddLine(ModbusTcpClient):
    """A client in RTU framing, every request of which is answered as `answer` says."""

    def __init__(self, answer: Callable[[bytes], bytes]) -> None:
        super().__init__("nowhere", framer=FramerType.RTU, retries=0, timeout=0.001)
        self.answer = answer
        self.left = b""

    def connect(self) -> bool:
        return True

    def send(self, request: bytes, addr: Any = None) -> int:
        self.left = self.answer(request)
        return len(request)

    def recv(self, size: int | None) -> bytes:
        taken, self.left = self.left, b""
        return taken


@given(
    st.binary(max_size=20) | st.binary(max_size=20).map(lambda data: b"\x02\x03\x0c" + data.ljust(12, b"\0")),
    st.booleans(),
)
def test_whatever_arrives_on_a_serial_line_only_instrument_errors_come_out(data: bytes, checked: bool) -> None:
    for action in (
        lambda line: line.read(2, 0, 6, "torque, speed, power"),
        lambda line: line.write(2, 0, 1, "command"),
        lambda line: line.write_block(2, 0, [0, 0], "zero"),
    ):
        with contextlib.suppress(InstrumentError):
            reply = with_check_sum(data) if checked else data
            action(ModbusLine(OddLine(lambda _, reply=reply: reply), "dynamometer"))


@given(st.lists(st.binary(min_size=12, max_size=12), min_size=3, max_size=3))
def test_whatever_a_transducer_holds_is_a_number_or_an_instrument_error(blocks: list[bytes]) -> None:
    left = list(blocks)

    def answer(request: bytes) -> bytes:
        size = 2 * int.from_bytes(request[4:6], "big")
        return with_check_sum(bytes([2, 3, size]) + left.pop(0)[-size:])

    with contextlib.suppress(InstrumentError):
        reading = Dyn200(ModbusLine(OddLine(answer), "dynamometer"), 2).read()
        assert all(math.isfinite(value) for value in (reading.torque, reading.speed, reading.power_counts))


def test_a_transducer_in_rtu_frames() -> None:
    left = [b"\0\0\0\x03", b"\0\0\0\x02", bytes.fromhex("ff ff fb 2e 00 01 86 a0 00 00 00 7b")]

    def answer(request: bytes) -> bytes:
        data = left.pop(0)
        return with_check_sum(bytes([2, 3, len(data)]) + data)

    reading = Dyn200(ModbusLine(OddLine(answer), "dynamometer"), 2).read()
    assert reading.torque == -1.234
    assert reading.speed == pytest.approx(1000.0 * RPM)
    assert reading.power_counts == 123


@given(st.text(string.printable, max_size=30), st.sampled_from(["", "tcp://", "rtu:///dev/", "rtu:///dev/x?baudrate="]))
def test_whatever_stands_as_an_address(text: str, start: str) -> None:
    # Made, not connected: only what a station file may say is refused, and as ValueError.
    with contextlib.suppress(ValueError):
        client_for(start + text, 1.0).close()


class Watch:
    """A clock that a request of 2 ms moves too."""

    def __init__(self) -> None:
        self.time = 5.0
        self.slept: list[float] = []

    def now(self) -> float:
        return self.time

    def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)
        self.time += seconds


def test_frames_of_a_serial_line_are_more_than_10_ms_apart_whoever_answered() -> None:
    watch = Watch()

    def answer(request: bytes) -> bytes:
        watch.time += 0.002
        data = bytes(2 * int.from_bytes(request[4:6], "big"))
        return with_check_sum(bytes([request[0], 3, len(data)]) + data)

    line = ModbusLine(OddLine(answer), "dynamometer", clock=watch)
    line.read(2, 0, 6, "torque")
    assert watch.slept == []
    line.read(2, 0, 6, "torque")
    assert watch.slept == [pytest.approx(0.011)]
    watch.time += 0.004
    line.read(2, 0, 6, "torque")
    assert watch.slept[1:] == [pytest.approx(0.007)]
    watch.time += 1.0
    line.read(2, 0, 6, "torque")
    assert len(watch.slept) == 2
