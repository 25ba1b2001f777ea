"""Can this computer reach what a station file names? Judged without opening anything."""

import os
import re
import stat
from collections.abc import Callable, Iterator
from urllib.parse import urlsplit

from bench.station.computer import Computer, UsbDevice
from bench.station.station_file import Station
from drivers.catalogue import Driver
from drivers.interfaces import CommunicationError
from drivers.interfaces.text import Text, text, text_of
from drivers.recognition import CanFdTalk
from drivers.transport.can.addresses import parse_bus, with_flexible_data_rate
from drivers.transport.can.fdcanusb import is_fdcanusb
from drivers.transport.in_process import IN_PROCESS, is_in_process
from drivers.transport.modbus.line import client_for
from drivers.transport.parameters import parameters_of, refuse_unknown
from drivers.transport.serial.line_settings import LINE_KEYS, line_settings

#: Modules with the distribution of each, and the extra that brings them, by what they are for.
_PACKAGES = {
    "usb": ("usb", {"usb": "pyusb", "libusb_package": "libusb-package"}),
    "gpib": ("gpib", {"gpib_ctypes": "gpib-ctypes"}),
    "mdns": ("discovery", {"zeroconf": "zeroconf"}),
    "vxi11": ("discovery", {"psutil": "psutil"}),
}
#: What a GPIB adapter's own library is called: linux-gpib's, National Instruments'.
_GPIB_LIBRARIES = ("gpib", "gpib-32", "ni4882")
#: How much faster the data of a frame of CAN FD go than the rest of it.
_FASTER = 5


def problems(station: Station, computer: Computer) -> Iterator[tuple[str, str, tuple[Text, ...]]]:
    """Give each instrument, relay and contact of a station with its address and what stands in the way of opening it."""
    places = [(entry.role.value, entry.address, _fd_bitrate(entry.driver)) for entry in station.entries.values()]
    places += [(f"interlocks.{entry.name}", entry.address, 0) for entry in station.interlocks]
    places += [(f"watchdog_relays.{entry.name}", entry.address, 0) for entry in station.watchdog_relays]
    for name, address, fd_bitrate in places:
        if address:
            yield name, address, tuple(_judged(address, station.visa_library, computer, fd_bitrate))


def _fd_bitrate(driver: Driver) -> int:
    """Return the rate of the slow phase (bit/s) of a driver that speaks CAN FD, 0 for others."""
    return next((kind.bitrate for kind in driver.recognised_by if isinstance(kind, CanFdTalk)), 0)


def _judged(address: str, visa_library: str, computer: Computer, fd_bitrate: int) -> Iterator[Text]:
    scheme = address.partition("://")[0].casefold() if "://" in address else ""
    if is_in_process(address) or f"://{IN_PROCESS}/" in address:
        yield text("only the virtual bench has such an address; give the address of the instrument")
    elif scheme == "can":
        yield from _can(address, computer, fd_bitrate)
    elif is_fdcanusb(address):
        path, _, query = address.partition("://")[2].partition("?")
        yield from _refused(
            lambda: _line_keys("&".join(key for key in query.split("&") if not key.startswith("node=")))
        )
        yield from _serial(path, computer)
    elif scheme in ("rtu", "tcp"):
        yield from _refused(lambda: client_for(address, 1.0))
        if scheme == "rtu":
            yield from _serial(urlsplit(address).path, computer)
    elif "::" in address:
        yield from _visa(address, visa_library, computer)
    elif not scheme:
        path, _, query = address.partition("?")
        yield from _refused(lambda: _line_keys(query))
        yield from _serial(path, computer)


def _visa(address: str, visa_library: str, computer: Computer) -> Iterator[Text]:
    kind = re.match("[A-Z]*", address.upper())
    own = visa_library in ("", "@py")
    match kind[0] if kind else "":
        case "USB":
            if own:
                yield from lacking("usb", computer)
            yield from _usb(address, computer)
        case "GPIB" if own:
            yield from lacking("gpib", computer)
        case "ASRL":
            path = address[4:].partition("::")[0]
            if path.startswith("/"):
                yield from _serial(path, computer)


def lacking(way: str, computer: Computer) -> Iterator[Text]:
    """Give what is not installed of `usb`, `gpib`, `mdns` (instruments that announce themselves) or `vxi11` (on every network)."""
    extra, modules = _PACKAGES[way]
    if missing := computer.missing(modules):
        yield text(
            "{missing} not installed; run uv sync --extra {extra}, or pip install 'motorbench[{extra}]'",
            missing=", ".join(missing),
            extra=extra,
        )
    if way == "gpib" and not computer.has_library(*_GPIB_LIBRARIES):
        yield text("the GPIB adapter's own library is not installed; install linux-gpib or its maker's driver")


def _usb(address: str, computer: Computer) -> Iterator[Text]:
    fields = address.split("::")[1:]
    try:
        vendor, product = (int(field, 0) for field in fields[:2])
    except ValueError:
        yield text("a USB address is USB0::0x2A8D::0x1202::SERIAL::0::INSTR")
        return
    devices = computer.usb_devices()
    matching = [device for device in devices if (device.vendor, device.product) == (vendor, product)]
    if len(fields) > 2 and fields[2].upper() != "INSTR":
        matching = [device for device in matching if device.serial.casefold() == fields[2].casefold()]
    if not matching:
        there = [f"0x{device.vendor:04X}::0x{device.product:04X}::{device.serial}" for device in devices]
        yield text("it is not connected; on the USB there are {devices}", devices=", ".join(there) or text("none"))
    elif not any(device.usable for device in matching):
        yield no_permission(matching[0])


def no_permission(device: UsbDevice) -> Text:
    """Say how a USB device is made usable."""
    return text(
        "you have no permission to use {node}; copy docs/examples/udev/60-motorbench.rules to /etc/udev/rules.d "
        "and plug the device in again",
        node=str(device.node),
    )


def _serial(path: str, computer: Computer) -> Iterator[Text]:
    if not os.path.exists(path):
        there = list(computer.serial_ports())
        yield text("{path} does not exist; the ports are {ports}", path=path, ports=", ".join(there) or text("none"))
    elif not os.access(path, os.R_OK | os.W_OK):
        yield text(
            "you have no permission to use {path}; add yourself to its group (often dialout) and log in again",
            path=path,
        )
    elif not stat.S_ISCHR(os.stat(path).st_mode):
        there = list(computer.serial_ports())
        yield text(
            "{path} is not a serial port; the serial ports are {ports}",
            path=path,
            ports=", ".join(there) or text("none"),
        )


def _can(address: str, computer: Computer, fd_bitrate: int) -> Iterator[Text]:
    try:
        bus = parse_bus(address, "")
        (with_flexible_data_rate(bus) if fd_bitrate else bus).arguments(1.0)
    except (CommunicationError, ValueError, OSError, ImportError) as error:
        yield error.what if isinstance(error, CommunicationError) else text_of(error)
        return
    if bus.interface != "socketcan":
        path = bus.channel.partition("@")[0]
        if path.startswith("/"):
            yield from _serial(path, computer)
        return
    interfaces = computer.can_interfaces()
    rates = f"bitrate {fd_bitrate} dbitrate {_FASTER * fd_bitrate} fd on" if fd_bitrate else f"bitrate {bus.bitrate}"
    up = f"sudo ip link set {bus.channel} up type can {rates}"
    if bus.channel not in interfaces:
        yield text(
            "no CAN interface {channel} was found; the interfaces are {interfaces}",
            channel=bus.channel,
            interfaces=", ".join(interfaces) or text("none"),
        )
    elif not interfaces[bus.channel]:
        yield text("{channel} is down; the bit rate of socketcan is set by: {command}", channel=bus.channel, command=up)


def _line_keys(query: str) -> None:
    parameters = parameters_of(query)
    refuse_unknown(parameters, LINE_KEYS)
    line_settings(parameters)


def _refused(attempt: Callable[[], object]) -> Iterator[Text]:
    try:
        attempt()
    except ValueError as error:
        yield text_of(error)
