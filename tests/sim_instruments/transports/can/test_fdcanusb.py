"""Lines of an fdcanusb adapter, byte by byte."""

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st
from moteus.fdcanusb_device import _compute_crc8

from sim_instruments.transports.can.fdcanusb import FdcanusbAdapter, checksum


def replies(*lines: str) -> list[bytes]:
    """What a fresh adapter says to lines."""
    adapter = FdcanusbAdapter()
    return [answer.reply for line in lines for answer in adapter.feed(f"{line}\n".encode())]


def frame_of(line: str) -> can.Message | None:
    """The frame that a line sends."""
    (answer,) = FdcanusbAdapter().feed(f"{line}\n".encode())
    return answer.frame


@pytest.mark.parametrize(
    ("line", "identifier", "data", "extended", "fd", "switched"),
    [
        # The documentation's own.
        (
            "can send 8001 01000a07206000200150ff140400130d", 0x8001,
            "01000a07206000200150ff140400130d", True, True, True,
        ),
        ("can send 0105 1100 bf", 0x105, "1100", False, False, False),
        ("can std 105 1100 b", 0x105, "1100", False, True, False),
        ("can ext 105 1100 B F", 0x105, "1100", True, True, True),
        ("can send 8001 " + "11" * 9, 0x8001, "11" * 9 + "50" * 3, True, True, True),
        ("can send 8001 ", 0x8001, "", True, True, True),
    ],
)  # fmt: skip
def test_what_is_sent(line: str, identifier: int, data: str, extended: bool, fd: bool, switched: bool) -> None:
    frame = frame_of(line)
    assert frame is not None
    assert (frame.arbitration_id, frame.data.hex(), frame.is_extended_id) == (identifier, data, extended)
    assert (frame.is_fd, frame.bitrate_switch) == (fd, switched)


@pytest.mark.parametrize(
    ("line", "reply"),
    [
        ("can on", b"OK\r\n"),
        ("can off", b"OK\r\n"),
        ("can status", b"mode:BUSON\r\nOK\r\n"),
        ("can send 8001 1100", b"OK\r\n"),
        ("can send 8001 110", b"ERR unknown command\r\n"),
        ("can send 80g1 11", b"ERR unknown command\r\n"),
        ("can std 8001 11", b"ERR invalid frame\r\n"),
        ("can send 20000000 11", b"ERR invalid frame\r\n"),
        ("can send 8001 " + "00" * 65, b"ERR invalid frame\r\n"),
        ("conf get can.prefix", b"ERR unknown command\r\n"),
        ("\xff\x00", b"ERR unknown command\r\n"),
    ],
)
def test_what_is_answered(line: str, reply: bytes) -> None:
    assert replies(line) == [reply]


def test_a_received_frame_is_told() -> None:
    adapter = FdcanusbAdapter()
    frame = can.Message(
        arbitration_id=0x500, is_extended_id=False, is_fd=True, bitrate_switch=True, data=b"\x21\x00\x0a"
    )
    assert adapter.line_of(frame) == b"rcv 500 21000a e B F\r\n"
    long = can.Message(arbitration_id=0x30500, data=b"\x01")
    assert adapter.line_of(long) == b"rcv 30500 01 E b f\r\n"


@given(st.binary(max_size=40))
def test_the_checksum_is_the_packages(data: bytes) -> None:
    assert checksum(data) == _compute_crc8(data)


def test_after_the_first_right_checksum_every_line_has_one() -> None:
    good = b"can on "
    line = f"{good.decode()}*{checksum(good):02X}"
    said = replies("can on", line, "can on", f"{line[:-2]}00")
    ok = b"OK *%02X\r\n" % checksum(b"OK ")
    refused = b"ERR checksum *%02X\r\n" % checksum(b"ERR checksum ")
    assert said == [b"OK\r\n", ok, refused, refused]


def test_lines_come_in_pieces_and_long_ones_are_dropped() -> None:
    adapter = FdcanusbAdapter()
    assert adapter.feed(b"can o") == []
    assert [one.reply for one in adapter.feed(b"n\r\n\ncan off\r")] == [b"OK\r\n"] * 2
    assert adapter.feed(b"x" * 300) == []
    assert [one.reply for one in adapter.feed(b"can on\n")] == [b"OK\r\n"]
