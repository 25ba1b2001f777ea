"""Addresses of nodes on a CAN bus."""

from typing import Any

import pytest

from drivers.interfaces import CommunicationError
from drivers.transport.can.addresses import BusAddress, parse_address


@pytest.mark.parametrize(
    ("address", "parts"),
    [
        ("can://socketcan/can0?node=5", (BusAddress("socketcan", "can0", 500_000), 5)),
        (
            "can://udp_multicast/239.74.163.2?node=127&bitrate=1000000",
            (BusAddress("udp_multicast", "239.74.163.2", 10**6), 127),
        ),
        (
            "can://slcan/socket://127.0.0.1:3333?node=5&bitrate=250000",
            (BusAddress("slcan", "socket://127.0.0.1:3333", 250_000), 5),
        ),
        ("can://slcan//dev/ttyACM0?node=5", (BusAddress("slcan", "/dev/ttyACM0"), 5)),
    ],
)
def test_addresses(address: str, parts: Any) -> None:
    assert parse_address(address, "inverter") == parts


@pytest.mark.parametrize(
    "address", ["can://virtual/a", "can://virtual?node=1", "can://virtual/a?node=200", "tcp://a/b", "can://[/a?node=1"]
)
def test_addresses_that_are_none(address: str) -> None:
    with pytest.raises(CommunicationError, match="is no CAN address"):
        parse_address(address, "inverter")
