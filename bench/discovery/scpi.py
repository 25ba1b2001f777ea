"""Instruments that answer *IDN?: over VISA, and over a plain socket, byte for byte."""

import re
import socket
import warnings
from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, cast

from pyvisa.constants import RENLineOperation

from bench.discovery.findings import FoundInstrument
from bench.discovery.inquiry import Inquiry, shown
from bench.safety.ownership.claims import is_number
from bench.station.visa_library import StationVisa
from drivers.interfaces.text import Text, text
from drivers.transport.visa.half_opened import sockets_closed_on_failure
from drivers.transport.visa.resource import RESOURCE_ERRORS
from drivers.transport.visa.session import IDENTITY_QUERY

if TYPE_CHECKING:
    from pyvisa.resources import MessageBasedResource, SerialInstrument

#: How long (s) an answer to *IDN? may take, and all of a question: opening, asking, letting go.
ANSWER_TIME, QUESTION_TIME = 2.0, 6.0
#: How long (s) a host may take to accept a connection, and VISA to list what it sees.
CONNECTION_TIME, LISTING_TIME = 1.0, 15.0
#: Registered ports: SCPI over a socket (IANA scpi-raw), HiSLIP (IVI-6.1), the portmapper that VXI-11 is found by.
_SCPI_PORT, _HISLIP_PORT, _PORTMAPPER = 5025, 4880, 111
#: More bytes than this are no identity.
_LONGEST = 4096
_IDN = Text("{question}", {"question": IDENTITY_QUERY})
#: What may be asked without having been named: instruments on USB, GPIB and the network.
_ON_BUS = re.compile(r"(USB|GPIB|TCPIP|VICP)[0-9]*::.*::INSTR", re.IGNORECASE)


def visa_addresses(inquiry: Inquiry, visa: StationVisa) -> list[str]:
    """Return what VISA sees on USB, GPIB and the network (VXI-11 by broadcast); serial ports are looked at by themselves."""

    def listed() -> list[str] | None:
        with warnings.catch_warnings():
            # Which package is missing is said in the report.
            warnings.simplefilter("ignore")
            found = visa.manager().list_resources("?*")
        # A Prologix adapter's serial port is listed too, whatever is behind the port.
        return [address for address in found if _ON_BUS.fullmatch(address)] or None

    what = text("what VISA sees on USB, GPIB and the network (VXI-11 by broadcast)")
    return inquiry.ask("VISA", what, listed, LISTING_TIME) or []


def ask_address(
    inquiry: Inquiry, visa: StationVisa, address: str, used_by: tuple[str, ...] = (), baud_rate: int | None = None
) -> None:
    """Ask *IDN? at a VISA address; a serial line has `baud_rate` (bit/s) where that is given."""
    if inquiry.take(address):
        _ask(inquiry, visa, address, used_by, baud_rate)


def ask_host(inquiry: Inquiry, visa: StationVisa, host: str, port: int | None = None, more: Sequence[str] = ()) -> None:
    """Ask a host until one of its ways answers.

    At `port` a plain socket is asked before HiSLIP, whose first bytes would be left in its input; without one, `more` (VISA addresses) and
    the registered ports of HiSLIP, SCPI and VXI-11 are.
    """
    if port is not None:
        ways = {f"TCPIP0::{host}::{port}::SOCKET": 0, f"TCPIP0::{host}::hislip0,{port}::INSTR": port}
    else:
        ways = dict.fromkeys(more, 0) | {
            f"TCPIP0::{host}::hislip0::INSTR": _HISLIP_PORT,
            f"TCPIP0::{host}::{_SCPI_PORT}::SOCKET": 0,
            f"TCPIP0::{host}::inst0::INSTR": _PORTMAPPER,
        }
    if inquiry.take(*ways):
        for address, first in ways.items():
            # A VISA library may wait long for a port that nobody listens at.
            if (not first or _is_open(inquiry, host, first)) and _ask(inquiry, visa, address):
                return


def judge(inquiry: Inquiry, addresses: tuple[str, ...], line: str, used_by: tuple[str, ...] = ()) -> FoundInstrument:
    """Return what a reply to *IDN? says."""
    identity, matches, near = inquiry.known.scpi(line)
    return FoundInstrument(addresses, Text("{line}", {"line": shown(line)}), identity, matches, near, used_by)


def joined(found: Collection[FoundInstrument]) -> list[FoundInstrument]:
    """Return the findings with what is one instrument by its serial number as one, the best of its addresses first."""
    made: dict[object, FoundInstrument] = {}
    for number, one in enumerate(found):
        identity = one.identity
        key: object = number
        if identity is not None and "::" in one.address and is_number(identity.serial_number):
            key = identity.manufacturer, identity.model, identity.serial_number
        before = made.get(key)
        if before is None:
            made[key] = one
            continue
        addresses = sorted({*before.addresses, *one.addresses}, key=_preference)
        made[key] = FoundInstrument(
            tuple(addresses), before.said, identity, before.matches, before.near, before.used_by + one.used_by
        )
    return list(made.values())


def ask_socket(host: str, port: int) -> str | None:
    """Return what a plain socket answers to *IDN?, a half line too; None where nothing comes."""
    with socket.create_connection((host, port), CONNECTION_TIME) as line:
        line.sendall(f"{IDENTITY_QUERY}\n".encode())
        line.settimeout(ANSWER_TIME)
        heard = b""
        with suppress(TimeoutError, ConnectionError):
            while not heard.endswith(b"\n") and len(heard) < _LONGEST and (piece := line.recv(_LONGEST)):
                heard += piece
    return heard.decode("latin-1") or None


def _ask(
    inquiry: Inquiry, visa: StationVisa, address: str, used_by: tuple[str, ...] = (), baud_rate: int | None = None
) -> bool:
    plain = _socket_of(address)
    action: Callable[[], str | None]
    action = partial(_ask_visa, visa, address, baud_rate) if plain is None else partial(ask_socket, *plain)
    answer = inquiry.ask(address, _IDN, action, QUESTION_TIME)
    if answer is None:
        return False
    inquiry.add(judge(inquiry, (address,), answer.strip(), used_by))
    return True


def _ask_visa(visa: StationVisa, address: str, baud_rate: int | None = None) -> str:
    with sockets_closed_on_failure():
        opened = visa.manager().open_resource(address, open_timeout=int(CONNECTION_TIME * 1e3))
    resource = cast("MessageBasedResource", opened)
    try:
        resource.timeout = ANSWER_TIME * 1e3
        resource.write_termination = "\n"
        if address[:4].upper() == "ASRL":
            resource.read_termination = "\n"
            if baud_rate is not None:
                cast("SerialInstrument", resource).baud_rate = baud_rate
        resource.write(IDENTITY_QUERY)
        line = resource.read_raw().decode("latin-1")
        # Who was asked is in remote: its front panel is given back.
        with suppress(NotImplementedError, AttributeError, *RESOURCE_ERRORS):
            cast("Any", resource).control_ren(RENLineOperation.address_gtl)
        return line
    finally:
        with suppress(*RESOURCE_ERRORS):
            resource.close()


def _is_open(inquiry: Inquiry, host: str, port: int) -> bool:
    def connected() -> bool:
        socket.create_connection((host, port), CONNECTION_TIME).close()
        return True

    return bool(inquiry.ask(f"{host}:{port}", text("a connection"), connected, CONNECTION_TIME + 0.5))


def _socket_of(address: str) -> tuple[str, int] | None:
    fields = address.split("::")
    if len(fields) == 4 and fields[3].upper() == "SOCKET" and fields[2].isdecimal():
        return fields[1].strip("[]"), int(fields[2])
    return None


def _preference(address: str) -> tuple[int, str]:
    # HiSLIP and the buses have device clear and serial poll; a plain socket has neither.
    upper = address.upper()
    return (2 if upper.endswith("SOCKET") else 0 if "HISLIP" in upper else 1), address
