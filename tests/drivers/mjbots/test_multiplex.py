"""The multiplex protocol to the byte, by the maker's own examples and by values worked out by hand."""

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.mjbots.multiplex import (
    FLOAT,
    INT8,
    INT32,
    parse,
    read,
    reply_identifier,
    request_identifier,
    stream_poll,
    stream_write,
    write,
)
from drivers.transport.can.fd_frames import candump, padded


def test_subframes_to_the_byte() -> None:
    assert write(0x000, (9,), INT8).hex() == "010009"
    # q is 1.5 A and d is -2 A.
    assert write(0x01C, (1.5, -2.0), FLOAT).hex() == "0e1c0000c03f000000c0"
    assert read(0x00D, 3, INT8).hex() == "130d"
    assert read(0x000, 4, INT32).hex() == "180400"
    # A number above 127 takes two bytes.
    assert read(0x101, 1, INT32).hex() == "198102"
    assert read(0x120, 3, INT32).hex() == "1ba002"
    assert stream_write(b"tel stop\n").hex() == "400109" + b"tel stop\n".hex()
    assert stream_poll().hex() == "420130"


def test_identifiers() -> None:
    # The maker's example: from 0 to 1 with a reply asked for, and the reply.
    assert request_identifier(0, 0, 1) == 0x8001
    assert reply_identifier(0, 0, 1) == 0x100
    assert request_identifier(0x123, 0x10, 5) == 0x1239005
    assert reply_identifier(0x123, 0x10, 5) == 0x1230510


def test_the_makers_example_of_a_reply() -> None:
    found = parse(bytes.fromhex("2404000a005000000170ff230d181400"))
    assert found.values == {0: 10, 1: 80, 2: 256, 3: -144, 0x0D: 24, 0x0E: 20, 0x0F: 0}
    assert not found.refused
    assert found.stream is None


def test_a_number_that_is_none_is_nan_and_padding_is_passed_over() -> None:
    assert math.isnan(parse(bytes.fromhex("210080505050")).values[0])
    assert math.isnan(parse(bytes.fromhex("250d0080")).values[0x0D])
    assert math.isnan(parse(bytes.fromhex("290100000080")).values[1])
    assert parse(bytes.fromhex("29010100008050")).values[1] == -(2**31) + 1


def test_what_is_refused_is_told() -> None:
    assert parse(bytes.fromhex("31820201300901")).refused == ["0x102 (1)", "0x009 (1)"]


def test_the_stream_of_another_channel_is_left_out() -> None:
    assert parse(bytes.fromhex("4101024f4b")).stream == b"OK"
    assert parse(bytes.fromhex("410100")).stream == b""
    assert parse(bytes.fromhex("4102024f4b")).stream is None


@pytest.mark.parametrize("data", ["2d04", "24", "41010a00", "0100", "60", "2dffffffffffff01"])
def test_what_is_no_reply_is_refused(data: str) -> None:
    with pytest.raises(ValueError, match=r"bytes|subframe"):
        parse(bytes.fromhex(data))


@given(st.binary(max_size=64))
def test_any_bytes_are_a_reply_or_a_value_error(data: bytes) -> None:
    try:
        parse(data)
    except ValueError:
        return


@given(st.integers(0, 1 << 14), st.lists(st.floats(width=32), min_size=1, max_size=12))
def test_floats_come_back_as_they_were_sent(register: int, values: list[float]) -> None:
    data = bytearray(write(register, values, FLOAT))
    data[0] |= 0x20
    read_back = parse(padded(bytes(data), 0x50)).values
    assert [struct.pack("<f", read_back[register + place]) for place in range(len(values))] == [
        struct.pack("<f", one) for one in values
    ]


def test_frames_are_filled_up_to_sizes_of_can_fd() -> None:
    sizes = [len(padded(bytes(count), 0x50)) for count in range(65)]
    assert sorted(set(sizes)) == [*range(9), 12, 16, 20, 24, 32, 48, 64]
    assert all(size >= count for count, size in enumerate(sizes))
    assert padded(bytes(13), 0x50)[13:] == b"PPP"


def test_frames_as_candump_writes_them() -> None:
    assert candump(0x110, b"\x21\x00\x09") == b"110##1210009"
    assert candump(0x9001, b"") == b"00009001##1"
