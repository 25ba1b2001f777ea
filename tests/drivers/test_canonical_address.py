"""Two addresses of one instrument have a name in common, and those of two instruments have none."""

from pathlib import Path

import pytest
from pyvisa.rname import ResourceName

from drivers.cia402.options import CanInterlockOptions
from drivers.delta.options import ModbusInterlockOptions
from drivers.interlocks.catalogue import CAN, MODBUS
from drivers.transport.canonical_address import addresses_of, canonical_addresses, is_serial_line

HOSTS = {"scope.lab": ["192.0.2.7", "fe80::7"], "bridge": ["192.0.2.8"]}


def names(address: str, *units: int) -> set[str]:
    return set(canonical_addresses(address, units=units, resolve=lambda host: HOSTS.get(host, ())))


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("TCPIP0::192.0.2.7::inst0::INSTR", "tcpip::192.0.2.7::INSTR"),
        ("TCPIP0::192.0.2.7::inst0::INSTR", "TCPIP1::192.0.2.7::hislip0::INSTR"),
        ("TCPIP0::192.0.2.7::hislip0,4880::INSTR", "TCPIP::Scope.Lab.::inst0::instr"),
        ("TCPIP0::192.0.2.7::5025::SOCKET", "TCPIP0::scope.lab::hislip0::INSTR"),
        ("TCPIP0::127.0.0.1::hislip0,41234::INSTR", "TCPIP::127.0.0.1::HISLIP0,41234::INSTR"),
        ("TCPIP0::192.0.2.7::INSTR", "VICP::192.0.2.7::INSTR"),
        ("USB0::0x2A8D::0x0101::MY123::0::INSTR", "USB1::10893::257::my123::INSTR"),
        ("GPIB::5::INSTR", "gpib0::5::INSTR"),
        ("tcp://bridge", "tcp://192.0.2.8:502"),
        ("can://socketcan/can0?node=5&bitrate=500000", "can://socketcan/can0?bitrate=250000&node=05"),
        ("socket://192.0.2.9:4001", "rfc2217://192.0.2.9:4001"),
    ],
)
def test_one_instrument(one: str, other: str) -> None:
    assert names(one) & names(other), (names(one), names(other))


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("TCPIP0::192.0.2.7::inst0::INSTR", "TCPIP0::192.0.2.8::inst0::INSTR"),
        ("TCPIP0::192.0.2.7::gpib0,5::INSTR", "TCPIP0::192.0.2.7::gpib0,6::INSTR"),
        ("TCPIP0::127.0.0.1::40001::SOCKET", "TCPIP0::127.0.0.1::40002::SOCKET"),
        ("TCPIP0::127.0.0.1::hislip0,40001::INSTR", "TCPIP0::127.0.0.1::hislip0,40002::INSTR"),
        ("TCPIP0::127.0.0.1,40001::inst0::INSTR", "TCPIP0::127.0.0.1,40002::inst0::INSTR"),
        ("USB0::0x2A8D::0x0101::MY123::0::INSTR", "USB0::0x2A8D::0x0101::MY124::0::INSTR"),
        ("GPIB0::5::INSTR", "GPIB1::5::INSTR"),
        ("can://socketcan/can0?node=5", "can://socketcan/can0?node=6"),
        ("can://socketcan/can0?node=5", "can://socketcan/can1?node=5"),
    ],
)
def test_two_instruments(one: str, other: str) -> None:
    assert not names(one) & names(other)


def test_units_behind_a_gateway_are_instruments_of_their_own() -> None:
    assert names("tcp://192.0.2.8:502", 1, 2) & names("tcp://bridge", 2)
    assert not names("tcp://192.0.2.8:502", 1, 2) & names("tcp://192.0.2.8:502", 3)


def test_a_serial_port_is_the_device_that_its_path_leads_to(tmp_path: Path) -> None:
    device, link = tmp_path / "ttyUSB0", tmp_path / "by-id"
    device.touch()
    link.symlink_to(device)
    ways = [
        str(device),
        str(link),
        f"rtu://{link}?baudrate=9600",
        f"ASRL{link}::INSTR",
        f"can://slcan/{link}@115200?node=4",
    ]
    assert len({canonical_addresses(way, units=(1,)) for way in ways}) == 1
    assert all(is_serial_line(way) for way in ways)
    assert not is_serial_line("tcp://192.0.2.8:502")


@pytest.mark.parametrize("address", ["in-process://tachometer", "can://in-process/can0?node=5"])
def test_what_is_in_this_process_needs_no_name(address: str) -> None:
    assert not names(address)


@pytest.mark.parametrize(
    "address", ["", "http://[", "::", "TCPIP::", "can://", "MySupply", "tcp://h:99999", "USB::1::INSTR"]
)
def test_whatever_is_written_has_a_name_and_no_error(address: str) -> None:
    assert names(address) == names(f" {address} ")


def test_the_system_is_asked_for_hosts() -> None:
    assert "127.0.0.1" in addresses_of("localhost")
    assert not addresses_of("no-such-host.invalid")
    assert canonical_addresses("TCPIP::localhost::5555::SOCKET") == (
        *sorted(f"tcp {host}:5555" for host in {"localhost", *addresses_of("localhost")}),
    )


@pytest.mark.parametrize(
    "address",
    [
        "TCPIP::192.0.2.7::INSTR",
        "TCPIP::192.0.2.7::5025::SOCKET",
        "USB::0x2A8D::0x0101::MY123::INSTR",
        "GPIB::5::INSTR",
    ],
)
def test_names_agree_with_pyvisas_reading(address: str) -> None:
    assert names(str(ResourceName.from_string(address))) == names(address)


def test_contacts_have_names() -> None:
    stop = ModbusInterlockOptions(3)
    assert set(MODBUS.contact_names("tcp://192.0.2.9:502", stop)) == set(MODBUS.contact_names("tcp://192.0.2.9", stop))
    assert MODBUS.contact_names("tcp://192.0.2.9", stop) != MODBUS.contact_names(
        "tcp://192.0.2.9", ModbusInterlockOptions(4)
    )
    assert MODBUS.contact_names("rtu:///dev/none", stop) != MODBUS.contact_names(
        "rtu:///dev/none", ModbusInterlockOptions(3, unit=2)
    )
    door = CanInterlockOptions(0x1A0, 0, 1)
    assert CAN.contact_names("can://socketcan/can0", door) == CAN.contact_names(
        "can://socketcan/can0?bitrate=250000", door
    )
    assert CAN.contact_names("can://socketcan/can0", door) != CAN.contact_names(
        "can://socketcan/can0", CanInterlockOptions(0x1A0, 0, 2)
    )
