"""The line to Modbus units: addresses, frames, registers, and replies that are not what was asked for."""

import os
import threading
import tty
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.delta.dynamometer import DeltaDyn200
from drivers.delta.options import DeltaDyn200Options
from drivers.interfaces import CommunicationError
from drivers.transport.modbus.line import open_line, signed_16, signed_32
from tests.drivers.modbus.units import TcpServer


def test_a_wrong_unit_is_silent(server: TcpServer, clock: Any) -> None:
    line = open_line(server.address, "dynamometer", timeout=0.05)
    with pytest.raises(CommunicationError, match=r"unit 7 .*no usable reply"):
        DeltaDyn200(line, clock, DeltaDyn200Options(maximum_speed=1.0, drive_unit=7))
    assert len(server.requests) == 2  # a read is repeated once
    with pytest.raises(CommunicationError, match="write 0001 to 2000H of unit 7"):
        line.write(7, 0x2000, 1, "command")
    assert len(server.requests) == 3  # a write is not
    line.close()


def test_a_late_reply_is_not_taken_for_another(server: TcpServer) -> None:
    late: list[bytes] = []

    def hold_back(reply: bytes) -> bytes:
        if not late:
            late.append(reply)
            return b""
        return late[0] + reply

    line = open_line(server.address, "dynamometer", timeout=0.5)
    assert line.read(2, 0x20, 2, "speed decimals") == [0, 2]
    server.garble = hold_back
    assert line.read(2, 0x08, 2, "torque decimals") == [0, 4]
    assert line.read(2, 0x20, 2, "speed decimals") == [0, 2]
    line.close()


def test_fewer_registers_than_asked(server: TcpServer) -> None:
    line = open_line(server.address, "dynamometer", timeout=2.0)
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
