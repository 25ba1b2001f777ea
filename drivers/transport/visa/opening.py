"""Opening a VISA resource and making sure that the right instrument answers."""

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar, cast

from drivers.bases.identification import check_serial_number
from drivers.catalogue import Surroundings
from drivers.interfaces import CommunicationError, Identity, IdentityError
from drivers.interfaces.text import text
from drivers.recognition import ScpiIdentity
from drivers.transport.serial.port_errors import not_opened
from drivers.transport.visa.half_opened import sockets_closed_on_failure
from drivers.transport.visa.resource import RESOURCE_ERRORS, VisaResource
from drivers.transport.visa.session import IDENTITY_QUERY, ScpiSession

if TYPE_CHECKING:
    from pyvisa.resources import SerialInstrument

T = TypeVar("T")


def open_session(
    address: str,
    surroundings: Surroundings,
    name: str,
    *,
    timeout: float = 10.0,
    baud_rate: int | None = None,
    line_end: str = "\n",
) -> ScpiSession:
    """Open a VISA address with the surroundings' resource manager; raises CommunicationError where nothing is there.

    A serial line gets `baud_rate` (bit/s) where that is given; each message sent ends with `line_end`.
    """
    manager = surroundings.manager()
    try:
        with sockets_closed_on_failure():
            resource = cast("VisaResource", manager.open_resource(address))
    except (*RESOURCE_ERRORS, ValueError) as error:
        if address[:5].upper() == "ASRL/" and isinstance(error, OSError):
            raise not_opened(name, address, error) from error
        raise CommunicationError(
            name,
            text("cannot be opened at {address} ({error})", address=address, error=error),
            remedy=text("Check address, power and cable"),
        ) from error
    resource.write_termination = line_end
    # A socket and a serial line have no end-of-message signal; elsewhere END ends a reply.
    socket, serial = address.upper().endswith("::SOCKET"), address.upper()[:4] == "ASRL"
    if serial and baud_rate is not None:
        cast("SerialInstrument", resource).baud_rate = baud_rate
    resource.read_termination = "\n" if socket or serial else None
    # PyVISA-py reads a raw socket until nothing comes, which never ends on one that the instrument has closed.
    return ScpiSession(
        resource,
        name,
        timeout=timeout,
        traffic=surroundings.traffic,
        calls=surroundings.calls,
        clearable=not socket,
        short_reads="::HISLIP" in address.upper(),
    )


def open_driver(session: ScpiSession, make: Callable[[ScpiSession], T]) -> T:
    """Make a driver on a session, and close the session where that fails."""
    try:
        return make(session)
    except BaseException:
        session.close()
        raise


def identify(session: ScpiSession, expected: ScpiIdentity, serial: str | None) -> Identity:
    """Ask *IDN? and compare the answer with the models supported and, where given, the serial number.

    Raises IdentityError naming what answered.
    """
    line = session.identity_line()
    identity = expected.identity_of(line)
    if identity is None:
        raise _unexpected(session.name, line, expected)
    check_serial_number(session.name, identity, serial, IDENTITY_QUERY)
    return identity


def _unexpected(name: str, line: str, expected: ScpiIdentity) -> IdentityError:
    fields = [field.strip() for field in line.split(",")]
    models = " or ".join(expected.models)
    if expected.unnamed:
        what = text("'{line}' answers, expected {models}, serial number, firmware", line=line, models=models)
    elif len(fields) != 4:
        return IdentityError(
            name, text("'{line}' is not an identity of four fields", line=line), command=IDENTITY_QUERY
        )
    else:
        what = text(
            "{manufacturer} {model} answers, expected {models}", manufacturer=fields[0], model=fields[1], models=models
        )
    remedy = text("Correct the address or the driver in the station file")
    return IdentityError(name, what, command=IDENTITY_QUERY, remedy=remedy)
