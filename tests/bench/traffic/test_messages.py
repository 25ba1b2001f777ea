"""Which messages count as the same."""

import pytest

from bench.traffic.messages import key_for, message_of
from drivers.transport.wire import Carrier

SAME: list[tuple[Carrier, bytes, bytes]] = [
    ("visa", b"VOLT 1.2,(@2)", b"VOLT 1.35E+00,(@2)"),
    ("visa", b":CHAN1:RANG 8", b":CHAN1:RANG .5"),
    ("modbus tcp", bytes.fromhex("01 06 20 01 0B B8"), bytes.fromhex("01 06 20 01 00 00")),
    (
        "modbus rtu",
        bytes.fromhex("01 10 20 00 00 02 04 00 01 00 02"),
        bytes.fromhex("01 10 20 00 00 02 04 00 03 00 04"),
    ),
    ("can", b"605#23FF600010270000", b"605#23FF6000FFFFFFFF"),
    ("can", b"605#0141424344454647", b"605#0161626364656667"),
]
OTHER: list[tuple[Carrier, bytes, bytes]] = [
    ("visa", b"VOLT 1.2,(@2)", b"VOLT 1.2,(@1)"),
    ("visa", b":CHAN1:RANG 8", b":CHAN2:RANG 8"),
    ("visa", b"VOLT 1", b"CURR 1"),
    ("modbus tcp", bytes.fromhex("01 06 20 01 0B B8"), bytes.fromhex("01 06 20 02 0B B8")),
    ("modbus tcp", bytes.fromhex("01 03 21 00 00 01"), bytes.fromhex("01 03 21 00 00 02")),
    ("can", b"605#23FF600010270000", b"605#2BFF600010270000"),
    ("can", b"605#40FF600000000000", b"605#40FE600000000000"),
    ("can", b"605#60", b"605#70"),
    ("serial", b"1", b"2"),
]


@pytest.mark.parametrize(("carrier", "one", "other"), SAME)
def test_the_same_up_to_numbers(carrier: Carrier, one: bytes, other: bytes) -> None:
    exact, tolerant = key_for(carrier, tolerant=False), key_for(carrier, tolerant=True)
    assert exact(one) != exact(other)
    assert tolerant(one) == tolerant(other)


@pytest.mark.parametrize(("carrier", "one", "other"), OTHER)
def test_not_the_same_even_then(carrier: Carrier, one: bytes, other: bytes) -> None:
    assert key_for(carrier, tolerant=True)(one) != key_for(carrier, tolerant=True)(other)


@pytest.mark.parametrize(
    ("carrier", "frame"),
    [
        ("modbus tcp", bytes.fromhex("00 2A 00 00 00 06 01 03 21 00 00 01")),
        ("modbus rtu", bytes.fromhex("01 03 21 00 00 01 8E 36")),
        ("modbus ascii", b":010321000001DA\r\n"),
    ],
)
def test_one_request_in_every_framing(carrier: Carrier, frame: bytes) -> None:
    assert message_of(carrier, frame) == bytes.fromhex("01 03 21 00 00 01")
    assert message_of(carrier, frame[:3]) == b""


def test_of_frames_that_came_late_the_last_one_counts() -> None:
    late, asked = bytes.fromhex("00 01 00 00 00 05 01 03 02 00 07"), bytes.fromhex("00 02 00 00 00 05 01 03 02 00 08")
    assert message_of("modbus tcp", late + asked) == bytes.fromhex("01 03 02 00 08")
    assert message_of("modbus tcp", late + asked[:9]) == bytes.fromhex("01 03 02")
