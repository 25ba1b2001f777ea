"""Keys behind the `?` of an address: each reaches the library that opens the port, and a misspelt one is refused."""

import os
import pty
from typing import Any

import pytest
import serial
from pymodbus import FramerType
from serial.rs485 import RS485Settings

from drivers.interfaces import CommunicationError
from drivers.transport.can.addresses import parse_address, settings_of_interface
from drivers.transport.can.buses import CanBuses
from drivers.transport.canonical_address import canonical_addresses
from drivers.transport.modbus.line import client_for, open_line
from drivers.transport.serial.line_settings import open_port


@pytest.fixture
def terminal() -> Any:
    """A pseudo-terminal's path: a serial port without a wire."""
    ours, theirs = pty.openpty()
    yield os.ttyname(theirs)
    os.close(ours)
    os.close(theirs)


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("rtu:///dev/ttyUSB0?bautrate=19200", "unknown key bautrate; is baudrate meant"),
        ("rtu:///dev/ttyUSB0?parity=even", "parity=even; allowed is N, E, O, M, S"),
        ("rtu:///dev/ttyUSB0?stopbits=3", "stopbits=3; allowed is 1, 1.5, 2"),
        ("rtu:///dev/ttyUSB0?baudrate=0", "baudrate=0; allowed is a number from 1 on"),
        ("rtu:///dev/ttyUSB0?baudrate=9600.5", "baudrate=9600.5; allowed is a whole number"),
        ("rtu:///dev/ttyUSB0?rs485=maybe", "rs485=maybe; allowed is true"),
        ("rtu:///dev/ttyUSB0?parity=", "parity has no value"),
        ("rtu:///dev/ttyUSB0?parity=N&parity=E", "parity is given twice"),
        ("tcp://192.0.2.1?unit=3", "unknown key unit; there are framer"),
        ("tcp://192.0.2.1?framer=udp", "framer=udp; allowed is tcp, rtu, ascii"),
    ],
)
def test_a_modbus_address_that_says_what_cannot_be(address: str, said: str) -> None:
    with pytest.raises(CommunicationError, match=said):
        open_line(address, "drive")


def test_framing_reaches_pymodbus() -> None:
    client = client_for("rtu:///dev/ttyUSB0?baudrate=19200&parity=E&stopbits=2&bytesize=7&framer=ascii", 1.0)
    made = client.comm_params
    assert (made.baudrate, made.parity, made.stopbits, made.bytesize) == (19200, "E", 2, 7)
    assert client.framer.__class__.__name__ == "FramerAscii"
    assert client_for("tcp://192.0.2.1:4001?framer=rtu", 1.0).comm_params.port == 4001
    assert FramerType.RTU.value in str(type(client_for("tcp://192.0.2.1?framer=rtu", 1.0).framer)).lower()


class Port:
    """A port that keeps what is set on it."""

    def close(self) -> None:
        pass


def test_the_direction_of_an_rs485_transceiver_is_set_when_the_port_opens(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[Any] = []

    def port(*_: Any, **__: Any) -> Port:
        opened.append(Port())
        return opened[-1]

    monkeypatch.setattr(serial, "serial_for_url", port)
    client = client_for("rtu:///dev/ttyS1?delay_before_rx=0.002&rts_level_for_tx=off&rtscts=no", 1.0)
    for _ in range(2):
        assert client.connect()
        found = opened[-1].rs485_mode
        assert isinstance(found, RS485Settings)
        assert (found.rts_level_for_tx, found.rts_level_for_rx, found.delay_before_rx) == (False, False, 0.002)
        assert opened[-1].rtscts is False
        client.close()
    assert len(opened) == 2


def test_a_port_that_cannot_switch_its_direction_is_refused(terminal: str) -> None:
    with pytest.raises(CommunicationError, match="the port cannot be set so"):
        open_line(f"rtu://{terminal}?rs485=yes", "drive")


def test_a_serial_instrument_s_port(terminal: str) -> None:
    with open_port(f"{terminal}?parity=E&stopbits=2&xonxoff=yes", 9600, 0.1) as port:
        assert (port.baudrate, port.parity, port.stopbits, port.xonxoff) == (9600, "E", 2, True)
    with pytest.raises(ValueError, match="unknown key baud; is baudrate meant"):
        open_port(f"{terminal}?baud=4800", 9600, 0.1)
    assert canonical_addresses(f"{terminal}?parity=E") == canonical_addresses(terminal)


def test_a_can_interface_s_own_keys() -> None:
    assert {"bitrate", "tty_baudrate", "rtscts", "listen_only"} <= set(settings_of_interface("slcan"))
    bus, node = parse_address("can://slcan//dev/ttyACM0?node=5&tty_baudrate=1000000&listen_only=true", "drive")
    assert node == 5
    assert bus.arguments(0.1) == {
        "interface": "slcan",
        "channel": "/dev/ttyACM0",
        "bitrate": 500_000,
        "tty_baudrate": 1_000_000,
        "listen_only": True,
    }


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("can://virtual/a?node=5&bitrat=250000", "unknown key bitrat; is bitrate meant"),
        ("can://virtual/a?node=5&tty_baudrate=9600", "unknown key tty_baudrate"),
        ("can://nothing/a?node=5&fd=true", "interface nothing"),
    ],
)
def test_a_can_address_that_says_what_cannot_be(address: str, said: str) -> None:
    with pytest.raises(CommunicationError, match=said):
        CanBuses().node(address, "drive")


def test_nodes_of_one_bus_have_one_setting() -> None:
    buses = CanBuses()
    first = buses.node("can://virtual/keys?node=5&rx_queue_size=100", "inverter")
    try:
        with pytest.raises(CommunicationError, match="is open with other settings already"):
            buses.node("can://virtual/keys?node=6", "drive")
    finally:
        first.disconnect()
