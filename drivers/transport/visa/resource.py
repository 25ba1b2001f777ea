"""A PyVISA resource as far as a session uses it, what it raises, and its time-out for a while."""

from contextlib import AbstractContextManager
from typing import Protocol

from pyvisa.constants import StatusCode
from pyvisa.errors import VisaIOError

from drivers.interfaces.text import Text, text_of

#: What a resource raises that does not work; PyVISA-py's HiSLIP says by RuntimeError that the connection was dropped.
RESOURCE_ERRORS = (VisaIOError, OSError, RuntimeError)


class VisaLibrary(Protocol):
    """The part of a VISA library that reads an exact number of bytes."""

    def read(self, session: int, count: int, /) -> tuple[bytes, StatusCode]:
        """Return at most `count` bytes and the status (viRead)."""


class VisaResource(Protocol):
    """The part of a PyVISA message-based resource that a session uses."""

    timeout: float
    read_termination: str | None
    write_termination: str

    @property
    def visalib(self) -> VisaLibrary:
        """The library behind the resource."""

    @property
    def session(self) -> int:
        """The library's handle of the resource."""

    def ignore_warning(self, *codes: StatusCode) -> AbstractContextManager[object]:
        """Keep the library from warning of these status codes."""

    def write(self, message: str) -> int:
        """Send a message and its termination."""

    def read_raw(self, size: int | None = None) -> bytes:
        """Return one reply with its termination."""

    def clear(self) -> None:
        """Clear the device's input and output buffers (viClear)."""

    def open(self) -> None:
        """Open a closed resource anew."""

    def close(self) -> None:
        """Close the resource."""


class ResourceTimeout:
    """Another time-out (s) for the length of a block, or the present one if that is `shorter`; does nothing where it is the same."""

    def __init__(self, resource: VisaResource, seconds: float, *, shorter: bool = False) -> None:
        self._resource = resource
        self._milliseconds = seconds * 1e3
        self._shorter = shorter

    def __enter__(self) -> None:
        self._before = self._resource.timeout
        if self._shorter:
            self._milliseconds = min(self._milliseconds, self._before)
        if self._before != self._milliseconds:
            self._resource.timeout = self._milliseconds

    def __exit__(self, *_: object) -> None:
        if self._before != self._milliseconds:
            self._resource.timeout = self._before


def finding(error: Exception) -> Text:
    """Say what a resource raised."""
    return Text("{reason}", {"reason": error.description}) if isinstance(error, VisaIOError) else text_of(error)
