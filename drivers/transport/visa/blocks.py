"""Definite length blocks of IEEE 488.2, read from a resource whatever the chunks that they come in."""

from typing import Any

from drivers.interfaces import CommunicationError
from drivers.interfaces.text import text
from drivers.transport.visa.resource import RESOURCE_ERRORS, VisaResource, finding

#: No instrument supported sends a longer block (bytes); a VISA library may set aside at once what is asked for.
LONGEST_BLOCK = 64 * 1024 * 1024
#: A block's first read (bytes), as large as the packets of a USBTMC device go.
_FIRST_CHUNK = 4096
#: What is taken from a socket at once (bytes).
_LARGE_READ = 1 << 19


class BlockReader:
    """Reads the block that an instrument answers a `command` with; `name` is the instrument's in errors.

    Both ways of reading raise CommunicationError where the header is malformed or the block ends early.
    """

    def __init__(self, resource: VisaResource, name: str, command: str) -> None:
        self._resource = resource
        self._name = name
        self._command = command

    def by_parts(self, *, in_pieces: bool) -> bytes | bytearray:
        """Read it by its parts, never more than what must still come; its content comes as one, and is not copied.

        From a socket it is read `in_pieces` that the processor's cache holds: PyVISA-py copies each several times.
        """
        _take_what_is_there(self._resource)
        start = bytes(self._read_exactly(2, 2))
        digits = self._digits(start)
        length = self._length(bytes(self._read_exactly(digits, digits)))
        data = self._read_exactly(length, _LARGE_READ if in_pieces else length)
        self._read_exactly(1, 1)  # the message's termination
        return data

    def by_message(self) -> bytes | memoryview:
        """Read it as a message, by whatever chunks come: some USBTMC devices serve no short reads in the middle of one."""
        received = bytearray()
        while len(received) < 2:
            received += self._chunk(_FIRST_CHUNK, 2, len(received))
        digits = self._digits(bytes(received[:2]))
        start = 2 + digits
        while len(received) < start:
            received += self._chunk(_FIRST_CHUNK, start, len(received))
        length = self._length(bytes(received[2:start]))
        whole = start + length + 1  # with the message's termination
        while len(received) < whole:
            received += self._chunk(whole - len(received), length, min(len(received) - start, length))
        if len(received) > whole + 1:
            raise CommunicationError(
                self._name,
                text("{extra} bytes more than the {length} announced came", extra=len(received) - whole, length=length),
                command=self._command,
            )
        return memoryview(received)[start : start + length]

    def _digits(self, start: bytes) -> int:
        if start[:1] != b"#" or not start[1:].isdigit() or start[1:] == b"0":
            raise CommunicationError(
                self._name, text("a block must start with #<n>, not {start}", start=repr(start)), command=self._command
            )
        return int(start[1:])

    def _length(self, digits: bytes) -> int:
        if not digits.isdigit():
            raise CommunicationError(
                self._name,
                text("a block's length must be digits, not {digits}", digits=repr(digits)),
                command=self._command,
            )
        length = int(digits)
        if length > LONGEST_BLOCK:
            raise CommunicationError(
                self._name,
                text(
                    "a block of {length} bytes is announced, more than {longest_block}",
                    length=length,
                    longest_block=LONGEST_BLOCK,
                ),
                command=self._command,
            )
        return length

    def _read_exactly(self, count: int, piece: int) -> bytes | bytearray:
        chunk = self._chunk(min(count, piece), count, 0)
        if len(chunk) == count:
            return chunk  # whole at once: no copy
        collected, had = bytearray(count), len(chunk)
        with memoryview(collected) as view:
            view[:had] = chunk
            while had < count:
                chunk = self._chunk(min(count - had, piece), count, had)
                view[had : had + len(chunk)] = chunk
                had += len(chunk)
        return collected

    def _chunk(self, count: int, wanted: int, had: int) -> bytes:
        """Return at most `count` bytes; `wanted` and `had` say in an error how many of how many had come."""
        try:
            chunk, _ = self._resource.visalib.read(self._resource.session, count)
        except RESOURCE_ERRORS as error:
            raise CommunicationError(
                self._name,
                text(
                    "only {collected} of {count} announced bytes came ({finding})",
                    collected=had,
                    count=wanted,
                    finding=finding(error),
                ),
                command=self._command,
            ) from error
        if not chunk:
            raise CommunicationError(
                self._name,
                text("only {collected} of {count} announced bytes came", collected=had, count=wanted),
                command=self._command,
            )
        return chunk


def _take_what_is_there(resource: VisaResource) -> None:
    """Have PyVISA-py take from a socket what has come; by itself it takes 4096 bytes and waits anew, again and again."""
    session: Any = getattr(resource.visalib, "sessions", {}).get(resource.session)
    if getattr(session, "max_recv_size", _LARGE_READ) < _LARGE_READ:
        session.max_recv_size = _LARGE_READ
