"""One scan: the places that a person named, those of a station file, and where instruments tell of themselves."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

from bench.discovery import announced, can_nodes, fd_nodes, modbus_line, scpi, serial_lines
from bench.discovery.findings import ScanReport
from bench.discovery.inquiry import Inquiry
from bench.discovery.matching import KnownInstruments
from bench.safety.ownership.owner import Ownership
from bench.station.computer import Computer
from bench.station.connections import lacking, no_permission
from bench.station.station_file import Entry, Station
from bench.station.visa_library import StationVisa
from drivers.catalogue import Driver
from drivers.interfaces import Clock
from drivers.interfaces.text import Text, text
from drivers.transport.can.fdcanusb import is_fdcanusb
from drivers.transport.in_process import IN_PROCESS


@dataclass(frozen=True)
class ScanRequest:
    """The places to scan, and the longest time (s).

    `hosts` are names or IP addresses with or without a port, `visa` VISA addresses; `serial`, `modbus` and `can` are ports, lines and
    buses that a person named.
    With `named_only` nothing else is asked.
    """

    hosts: tuple[tuple[str, int | None], ...] = ()
    visa: tuple[str, ...] = ()
    serial: tuple[str, ...] = ()
    modbus: tuple[str, ...] = ()
    can: tuple[str, ...] = ()
    units: tuple[int, ...] = tuple(modbus_line.USUAL_UNITS)
    named_only: bool = False
    within: float = 60.0


def scan(
    request: ScanRequest,
    drivers: Iterable[Driver],
    *,
    clock: Clock,
    owner: Ownership,
    visa: StationVisa,
    computer: Computer,
    station: Station | None = None,
    say: Callable[[Text], None],
) -> ScanReport:
    """Look, and return what was found; after Ctrl-C what was found so far.

    Nothing is set, energised or reset: *IDN?, Modbus function 3, SDO uploads, reads of registers by CAN FD and listening are all that is
    used.
    """
    inquiry = Inquiry(clock, request.within, KnownInstruments(drivers), owner, say)
    try:
        if station is not None:
            _ask_station(inquiry, visa, station)
        _ask_named(inquiry, visa, request)
        _look_around(inquiry, visa, computer, request)
    except KeyboardInterrupt:
        inquiry.report.interrupted = True
    for name, error in inquiry.known.faults.items():
        inquiry.skip(name, text("its driver could not evaluate a reply: {error}", error=error))
    report = inquiry.report
    return replace(report, found=scpi.joined(report.found))


def _by_address(station: Station) -> dict[str, list[Entry]]:
    """Return a station's instruments by address: one may fill several roles. What a person works has none."""
    result: dict[str, list[Entry]] = {}
    for entry in station.entries.values():
        if entry.address:
            result.setdefault(entry.address, []).append(entry)
    return result


def _ask_station(inquiry: Inquiry, visa: StationVisa, station: Station) -> None:
    """Ask each address; nodes of one bus together, which many adapters can be opened for but once."""
    buses: dict[tuple[str, bool], dict[int, tuple[str, ...]]] = {}
    for address, entries in _by_address(station).items():
        scheme, _, rest = address.partition("://")
        on_bus = scheme.casefold() == "can" and not rest.startswith(f"{IN_PROCESS}/")
        if on_bus or is_fdcanusb(address):
            bus, nodes = can_nodes.bus_and_nodes(address)
            fd = any(fd_nodes.fd_talk_of(one.driver) for one in entries)
            buses.setdefault((bus, fd), {}).update(dict.fromkeys(nodes, tuple(one.role.value for one in entries)))
        else:
            _ask_entry(inquiry, visa, entries)
    for (bus, fd), roles in buses.items():
        ask = fd_nodes.ask_fd_bus if fd else can_nodes.ask_bus
        ask(inquiry, bus, tuple(roles), roles)


def _ask_entry(inquiry: Inquiry, visa: StationVisa, entries: list[Entry]) -> None:
    entry, used_by = entries[0], tuple(one.role.value for one in entries)
    address = entry.address
    scheme = address.partition("://")[0].casefold() if "://" in address else ""
    if scheme == IN_PROCESS or f"://{IN_PROCESS}/" in address:
        inquiry.skip(address, text("only the virtual bench has such an address; give the address of the instrument"))
    elif "::" in address:
        scpi.ask_address(inquiry, visa, address, used_by, getattr(entry.options, "baud_rate", None))
    elif scheme in ("tcp", "rtu"):
        units = tuple(getattr(entry.options, "units", ())) or tuple(modbus_line.USUAL_UNITS)
        modbus_line.sweep(inquiry, address, units, used_by)
    elif not scheme:
        serial_lines.ask_port(inquiry, address, used_by)
    else:
        inquiry.skip(address, text("no query is known that would not change something there"))


def _ask_named(inquiry: Inquiry, visa: StationVisa, request: ScanRequest) -> None:
    for address in request.visa:
        scpi.ask_address(inquiry, visa, address)
    for host, port in request.hosts:
        scpi.ask_host(inquiry, visa, host, port)
    for port_name in request.serial:
        serial_lines.ask_port(inquiry, port_name)
    for line in request.modbus:
        modbus_line.sweep(inquiry, line, request.units)
    for bus in request.can:
        address, nodes = can_nodes.bus_and_nodes(can_nodes.bus_address(bus))
        if not is_fdcanusb(address):
            can_nodes.ask_bus(inquiry, address, nodes)
        if fd_nodes.speaks_fd(address):
            fd_nodes.ask_fd_bus(inquiry, address, nodes)


def _look_around(inquiry: Inquiry, visa: StationVisa, computer: Computer, request: ScanRequest) -> None:
    """Ask what VISA and mDNS tell of, and put down what nobody named."""
    if request.named_only:
        inquiry.skip("VISA, mDNS", text("--named-only was given"))
    else:
        for way in ("usb", "gpib", "vxi11"):
            for why in lacking(way, computer):
                inquiry.skip({"usb": "USB", "gpib": "GPIB", "vxi11": "VXI-11"}[way], why)
        for device in computer.usb_devices():
            if device.instrument and not device.usable:
                inquiry.skip(f"USB 0x{device.vendor:04X}::0x{device.product:04X}", no_permission(device))
        services = announced.announced(inquiry, computer)
        for host in dict.fromkeys(one.host for one in services):
            scpi.ask_host(
                inquiry, visa, host, more=[one.address for one in services if one.host == host and one.address]
            )
        for address in scpi.visa_addresses(inquiry, visa):
            scpi.ask_address(inquiry, visa, address)
    serial_lines.list_ports(inquiry, computer)
    for name, up in computer.can_interfaces().items():
        if not inquiry.looked_at(f"can socketcan {name} "):
            why = text("a CAN interface that was not asked for. To include it: --can socketcan/{name}", name=name)
            inquiry.skip(name, why if up else text("{name} is down", name=name))
