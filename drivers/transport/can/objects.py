"""Objects of a CANopen node by SDO, with errors that name the object."""

import queue
import struct
from collections.abc import Callable
from typing import Protocol, TypeVar

from can import CanError
from canopen.sdo.exceptions import SdoAbortedError, SdoError

from drivers.interfaces import UNWATCHED, Calls, CommunicationError, ReportedError, Traffic
from drivers.interfaces.text import text

T = TypeVar("T")
#: SDO aborts by which a node says that it has no such object or subindex.
ABSENT = (0x06020000, 0x06090011)

#: What canopen lets through besides its own errors: frames cut short, a bus that is not connected any more.
LINE_ERRORS = (SdoError, CanError, OSError, RuntimeError, struct.error)


class SdoClient(Protocol):
    """The part of a canopen SDO client that is used: transfers without an object dictionary."""

    def upload(self, index: int, subindex: int) -> bytes:
        """Read an object."""

    def download(self, index: int, subindex: int, data: bytes, force_segment: bool = False) -> None:
        """Write an object."""


class NodeObjects:
    """The objects of one node, as numbers of a stated size (bytes, little endian).

    Where it was `asked_before` by another connection, as by a run that was killed, a reply to that may still come.
    """

    def __init__(
        self,
        client: SdoClient,
        name: str,
        *,
        traffic: Traffic | None = None,
        calls: Calls = UNWATCHED,
        asked_before: bool = False,
    ) -> None:
        self.name = name
        self._client = client
        self._traffic = traffic
        self.calls = calls
        #: A request has had no reply: one that comes late would be taken for that of a later request.
        self._unanswered = asked_before

    def read(self, index: int, subindex: int, size: int, *, signed: bool = False) -> int:
        """Return a number of `size` bytes.

        Raises ReportedError for an SDO abort, CommunicationError for no reply or another size.
        """
        raw = self.read_bytes(index, subindex)
        if len(raw) != size:
            raise CommunicationError(
                self.name,
                text("{count} bytes instead of {size}", count=len(raw), size=size),
                command=f"read {_pretty(index, subindex)}",
            )
        return int.from_bytes(raw, "little", signed=signed)

    def read_optional(self, index: int, subindex: int, size: int, *, signed: bool = False) -> int | None:
        """Return a number of `size` bytes, `None` where the node has no such object; errors as for `read`."""
        return self._where_there(lambda: self.read(index, subindex, size, signed=signed))

    def read_bytes(self, index: int, subindex: int) -> bytes:
        """Return an object's bytes; errors as for `read`."""
        command = f"read {_pretty(index, subindex)}"
        self.trace("write", command)
        try:
            with self.calls.exchange():
                raw = self._transferred(lambda: self._client.upload(index, subindex))
        except LINE_ERRORS as error:
            raise self._failure(error, command) from error
        if self._traffic is not None:
            self._traffic("read", raw.hex(" "))
        return raw

    def read_text(self, index: int, subindex: int) -> str:
        """Return an object's text; errors as for `read`."""
        return self.read_bytes(index, subindex).decode("latin-1").strip("\0 ")

    def read_optional_text(self, index: int, subindex: int) -> str:
        """Return an object's text, empty where the node has no such object; errors as for `read`."""
        return self._where_there(lambda: self.read_text(index, subindex)) or ""

    def write(self, index: int, subindex: int, value: int, size: int, *, signed: bool = False) -> None:
        """Write a number of `size` bytes; errors as for `read`, and ValueError where the number does not fit."""
        try:
            data = value.to_bytes(size, "little", signed=signed)
        except OverflowError as error:
            raise ValueError(
                text(
                    "{value} does not fit {size} bytes of {object}",
                    value=value,
                    size=size,
                    object=_pretty(index, subindex),
                )
            ) from error
        command = f"write {value} to {_pretty(index, subindex)}"
        self.trace("write", command)
        try:
            with self.calls.exchange():
                self._transferred(lambda: self._client.download(index, subindex, data))
        except LINE_ERRORS as error:
            raise self._failure(error, command) from error
        self.trace("read", "done")

    def write_optional(self, index: int, subindex: int, value: int, size: int) -> bool:
        """Write a number of `size` bytes; return False where the node has no such object. Errors as for `write`."""

        def written() -> bool:
            self.write(index, subindex, value, size)
            return True

        return self._where_there(written) or False

    def _transferred(self, transfer: Callable[[], T]) -> T:
        """Return what a transfer gives; it is made again where what came was late, for another request."""
        try:
            result = transfer()
        except SdoError as error:
            silent = isinstance(error.__context__, queue.Empty)
            if silent or not self._unanswered:
                self._unanswered = silent
                raise
            # What is asked again changes nothing: a number is read, or the same is written once more.
            result = transfer()
        else:
            self._unanswered = False
        return result

    def trace(self, direction: str, message: str) -> None:
        """Tell whoever listens to the traffic."""
        if self._traffic is not None:
            self._traffic(direction, message)

    def _where_there(self, transfer: Callable[[], T]) -> T | None:
        try:
            return transfer()
        except ReportedError as error:
            cause = error.__cause__
            if isinstance(cause, SdoAbortedError) and cause.code in ABSENT:
                self.trace("read", "no such object")
                return None
            raise

    def _failure(self, error: Exception, command: str) -> CommunicationError | ReportedError:
        if isinstance(error, SdoAbortedError):
            return ReportedError(self.name, text("SDO abort: {error}", error=error), command=command)
        return CommunicationError(
            self.name,
            text("no usable reply ({error})", error=error),
            command=command,
            remedy=text("Check node id, bit rate and cable"),
        )


def _pretty(index: int, subindex: int) -> str:
    return f"0x{index:04X}:{subindex:02X}"
