"""One name for each instrument, however a station file writes its address."""

import ipaddress
import os
import re
import socket
from collections.abc import Callable, Collection, Iterator
from urllib.parse import parse_qs, urlsplit

from drivers.transport.in_process import IN_PROCESS

#: Gives the IP addresses of a host's name; none where nobody knows it.
Resolve = Callable[[str], Collection[str]]

#: Registered ports of the instrument itself: SCPI over a plain socket (IANA scpi-raw), HiSLIP (IVI-6.1), Modbus TCP.
_SCPI_PORT, _HISLIP_PORT, _MODBUS_PORT = 5025, 4880, 502
_VISA = re.compile(r"(?P<kind>[a-z]+?)(?P<board>[0-9]*)", re.IGNORECASE)
_LAN_DEVICE = re.compile(r"(?:inst|hislip)(?P<number>[0-9]+)(?:,(?P<port>[0-9]+))?")


def addresses_of(host: str) -> Collection[str]:
    """Return the IP addresses that the system knows for a host's name."""
    try:
        return {str(found[4][0]) for found in socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)}
    except (OSError, UnicodeError):
        return ()


def canonical_addresses(
    address: str, *, units: Collection[int] = (), resolve: Resolve = addresses_of
) -> tuple[str, ...]:
    """Return the names of what answers at an address, sorted; two addresses of one instrument have one in common.

    Board numbers, upper and lower case and defaults do not count; a host has its name and every IP address; a serial
    port is the device that its path leads to. Each of `units` on a Modbus TCP gateway is an instrument, but a serial
    line is one as a whole. An address in this process has none.
    """
    address = address.strip()
    scheme, mark, _ = address.partition("://")
    if mark:
        return tuple(sorted(_of_url(scheme.casefold(), address, units, resolve)))
    if "::" in address:
        return tuple(sorted(_of_visa(address, resolve)))
    return (serial_port(address),)


def serial_port(path: str) -> str:
    """Return the name of the serial device that a path leads to."""
    path = path.partition("?")[0]
    return f"serial {os.path.realpath(path) if path.startswith('/') else path.casefold()}"


def is_serial_line(address: str) -> bool:
    """Return whether an address is that of a serial line, which one process at a time can use."""
    return any(name.startswith("serial ") for name in canonical_addresses(address, resolve=lambda _: ()))


def _of_url(scheme: str, address: str, units: Collection[int], resolve: Resolve) -> Iterator[str]:
    try:
        parts = urlsplit(address)
        port = parts.port
    except ValueError:
        yield f"address {address.casefold()}"
        return
    path = parts.path
    if scheme == IN_PROCESS or (scheme == "can" and parts.netloc == IN_PROCESS):
        return
    if scheme == "can":
        yield _can(parts.netloc, path.removeprefix("/"), parse_qs(parts.query).get("node", [""])[-1])
    elif scheme in ("rtu", "spy", "fdcanusb"):
        yield serial_port(path)
    elif parts.hostname:
        if scheme == "tcp":
            port = port or _MODBUS_PORT
        for host in _hosts(parts.hostname, resolve):
            place = f"tcp {host}:{port}"
            yield from (f"{place} unit {unit}" for unit in units) if units else (place,)
    else:
        yield f"address {address.casefold()}"


def _can(interface: str, channel: str, node: str) -> str:
    if channel.startswith("/"):
        # An adapter behind a serial port: its line is one process' at a time, whatever the node.
        return serial_port(channel.partition("@")[0])
    number = f" node {int(node, 10)}" if node.isdecimal() else ""
    return f"can {interface.casefold()} {channel}{number}"


def _of_visa(address: str, resolve: Resolve) -> Iterator[str]:
    first, *parts = (part.strip() for part in address.split("::"))
    if first[:4].upper() == "ASRL":
        port = first[4:]
        yield serial_port(port if port.startswith("/") else f"asrl {port}")
        return
    match = _VISA.fullmatch(first)
    kind = match["kind"].upper() if match else first
    board = int(match["board"] or 0) if match else 0
    suffix = parts[-1].upper() if parts else ""
    fields = parts[:-1] if suffix in ("INSTR", "SOCKET", "INTFC", "RAW") else parts
    if kind in ("TCPIP", "VICP") and fields:
        name, _, port = fields[0].partition(",")
        for host in _hosts(name, resolve):
            # PyVISA-py has the port of a core channel behind the host: what listens there is an instrument of its own.
            yield f"tcp {host}:{_number(port)}" if port else _on_network(host, fields[1:], suffix)
    elif kind == "USB" and len(fields) >= 3:
        # The maker's and the model's number may be written in either base; the interface is the same instrument's.
        yield " ".join(["usb", *(_number(field) for field in fields[:2]), fields[2].casefold()])
    else:
        yield " ".join([kind.casefold(), str(board), *(_number(field) for field in fields)])


def _on_network(host: str, fields: list[str], suffix: str) -> str:
    if suffix == "SOCKET":
        plain = _number(fields[0]) if fields else ""
        return f"lan {host} 0" if plain == str(_SCPI_PORT) else f"tcp {host}:{plain}"
    device = fields[0].casefold() if fields else "inst0"
    match = _LAN_DEVICE.fullmatch(device)
    if match is None:
        return f"lan {host} {device}"
    number, port = int(match["number"]), int(match["port"] or _HISLIP_PORT)
    if port == _HISLIP_PORT:
        return f"lan {host} {number}"
    return f"tcp {host}:{port}" + (f" {number}" if number else "")


def _hosts(name: str, resolve: Resolve) -> set[str]:
    """Return what a host is known by: its name and its IP addresses."""
    bare = name.strip("[]").rstrip(".").casefold()
    try:
        return {_ip(bare)}
    except ValueError:
        found = set()
        for address in resolve(bare):
            try:
                found.add(_ip(address))
            except ValueError:
                continue
        return {bare, *found}


def _ip(text: str) -> str:
    address = ipaddress.ip_address(text)
    mapped = getattr(address, "ipv4_mapped", None)
    return str(mapped or address)


def _number(field: str) -> str:
    try:
        return str(int(field, 0))
    except ValueError:
        return field.casefold()
