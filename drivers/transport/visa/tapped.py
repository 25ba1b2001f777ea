"""A VISA resource manager whose resources tell what they send and receive."""

from typing import TYPE_CHECKING, Any

from pyvisa.constants import StatusCode
from pyvisa.errors import VisaIOError

from drivers.transport.visa.resource import RESOURCE_ERRORS
from drivers.transport.wire import Wire

if TYPE_CHECKING:
    from pyvisa import ResourceManager


class TappedManager:
    """A resource manager; what it opens is an ordinary resource, with a library in it that tells."""

    def __init__(self, manager: "ResourceManager", wire: Wire) -> None:
        self._manager = manager
        self._wire = wire

    def open_resource(self, *arguments: Any, **named: Any) -> Any:
        """Open a resource as PyVISA does."""
        resource: Any = self._manager.open_resource(*arguments, **named)
        resource.visalib = _TappedLibrary(resource.visalib, self._wire)
        return resource

    def __getattr__(self, attribute: str) -> Any:
        return getattr(self._manager, attribute)


class _TappedLibrary:
    """The library of one resource; what comes in pieces is told as the message that it is, where its end shows."""

    def __init__(self, library: Any, wire: Wire) -> None:
        self._library = library
        self._wire = wire
        self._received = bytearray()

    def __getattr__(self, attribute: str) -> Any:
        return getattr(self._library, attribute)

    def write(self, session: int, data: bytes) -> Any:
        self._tell()
        self._wire("visa", ">", bytes(data))
        try:
            return self._library.write(session, data)
        except RESOURCE_ERRORS as error:
            self._failed("write", error)
            raise

    def read(self, session: int, count: int) -> Any:
        try:
            data, status = self._library.read(session, count)
        except RESOURCE_ERRORS as error:
            self._failed("read", error)
            raise
        self._received += data
        if status != StatusCode.success_max_count_read:
            self._tell()
        return data, status

    def close(self, session: int) -> Any:
        self._tell()
        return self._library.close(session)

    def _tell(self) -> None:
        if self._received:
            data, self._received = bytes(self._received), bytearray()
            self._wire("visa", "<", data)

    def _failed(self, what: str, error: Exception) -> None:
        self._tell()
        said = error.abbreviation if isinstance(error, VisaIOError) else type(error).__name__
        self._wire("visa", "!", f"{what}: {said}".encode())
