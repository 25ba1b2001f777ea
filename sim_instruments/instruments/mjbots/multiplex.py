"""The multiplex protocol of mjbots: what a frame's bytes ask of registers and of byte streams, and what is answered.

Sources: mjlib `multiplex/format.h` and `multiplex/micro_server.cc` (the firmware's side, commit 48bcba0); the register protocol's page in
the documentation of moteus says the same of the subframes 00h to 31h and 50h. The tunnel with flow control (43h, 44h), which the maker's
newer firmware has, stands in neither: to this device those are unknown subframes.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

#: Types of values by their number in a subframe: int8, int16, int32, float.
INT8, INT16, INT32, FLOAT = range(4)
_FORMATS = ("<b", "<h", "<i", "<f")
WRITE, READ, REPLY = 0x00, 0x10, 0x20
WRITE_ERROR, READ_ERROR = 0x30, 0x31
CLIENT_DATA, SERVER_DATA, CLIENT_POLL = 0x40, 0x41, 0x42
NOP = 0x50
UNKNOWN_REGISTER, NOT_WRITABLE = 1, 2
LARGEST_FRAME = 64
#: What the server keeps free in a frame beside a stream's bytes: length, checksum of a serial frame, and some more.
_OVERHEAD = 5 + 2 + 16
#: The bytes that a stream's input holds until they are read.
_INPUT = 128


class RefusedWriteError(Exception):
    """A register that cannot be written, with the protocol's number of the error."""

    def __init__(self, code: int) -> None:
        self.code = code
        super().__init__(f"error {code}")


class DiscardedFrameError(Exception):
    """The rest of the frame is meant for somebody else; nothing is answered."""


class RegisterServer(Protocol):
    """The registers that a frame's subframes read and write."""

    def begin_frame(self) -> None:
        """Be told that a frame begins."""

    def end_frame(self) -> None:
        """Be told that a frame has ended, and do what it commands as a whole."""

    def write(self, register: int, kind: int, value: float) -> None:
        """Write a value as it came, of a type. Raises RefusedWriteError, and DiscardedFrameError for a frame that is not for it."""

    def read(self, register: int, kind: int) -> float | None:
        """Return a register's value as it goes out in a type, None for one that cannot be read so."""


class TunnelEnd(Protocol):
    """One end of a tunnelled stream."""

    def take(self, data: bytes) -> None:
        """Take what a client has sent."""

    def give(self, most: int) -> bytes:
        """Return what is to be sent, up to so many bytes."""


class MalformedError(Exception):
    """Bytes that end within a subframe."""


@dataclass
class Bytes:
    """Bytes that are read from the front. Everything raises MalformedError where there are too few."""

    data: bytes
    at: int = 0

    @property
    def left(self) -> int:
        """The number of bytes left."""
        return len(self.data) - self.at

    def varuint(self) -> int:
        """Return a number of up to five bytes, seven bits each."""
        result = 0
        for place in range(5):
            byte = self.take(1)[0]
            result |= (byte & 0x7F) << 7 * place
            if not byte & 0x80:
                break
        return result

    def value(self, kind: int) -> float:
        """Return a value of a type."""
        code = _FORMATS[kind]
        result: float = struct.unpack(code, self.take(struct.calcsize(code)))[0]
        return result

    def take(self, count: int) -> bytes:
        """Return so many bytes."""
        if count > self.left:
            raise MalformedError
        self.at += count
        return self.data[self.at - count : self.at]


def varuint(value: int) -> bytes:
    """Return a number as up to five bytes of seven bits each."""
    result = bytearray()
    while True:
        result.append(value & 0x7F | (0x80 if value > 0x7F else 0))
        value >>= 7
        if not value:
            return bytes(result)


class MultiplexServer:
    """Serves registers, and streams by their channel's number; counts nothing."""

    def __init__(self, registers: RegisterServer, streams: dict[int, TunnelEnd]) -> None:
        self._registers = registers
        self._streams = streams

    def serve(self, frame: bytes, *, respond: bool) -> bytes | None:
        """Do what a frame's bytes ask; return the answer, possibly empty, None where there is none.

        What is malformed or unknown ends the frame; what stood before it is done, and answered.
        """
        answer, asked = bytearray(), Bytes(frame)
        self._registers.begin_frame()
        try:
            while asked.left and self._subframe(asked, answer, respond=respond):
                continue
        except MalformedError:
            pass
        except DiscardedFrameError:
            self._registers.begin_frame()
            return None
        self._registers.end_frame()
        # A longer one does not fit into a frame: the firmware stops at its own assertion.
        return bytes(answer) if respond and len(answer) <= LARGEST_FRAME else None

    def _subframe(self, asked: Bytes, answer: bytearray, *, respond: bool) -> bool:
        """Do one subframe; return whether the next one may follow."""
        kind = asked.varuint()
        if kind == NOP:
            return True
        if WRITE <= kind < READ:
            self._write(kind, asked, answer)
            return True
        if READ <= kind < REPLY:
            # Unless an answer is wanted the firmware does not look at what follows, and takes it for subframes.
            return self._read(kind - READ, asked, answer) if respond else True
        if kind in (CLIENT_DATA, CLIENT_POLL):
            self._stream(kind, asked, answer, respond=respond)
            return True
        return False

    def _write(self, kind: int, asked: Bytes, answer: bytearray) -> None:
        count = kind % 4 or asked.varuint()
        register = asked.varuint()
        for number in range(register, register + count):
            value = asked.value(kind // 4)
            try:
                self._registers.write(number, kind // 4, value)
            except RefusedWriteError as error:
                answer += bytes([WRITE_ERROR]) + varuint(number) + varuint(error.code)

    def _read(self, kind: int, asked: Bytes, answer: bytearray) -> bool:
        count = kind % 4 or asked.varuint()
        register = asked.varuint()
        reply = bytearray([REPLY | kind])
        if not kind % 4:
            reply += varuint(count)
        reply += varuint(register)
        for number in range(register, register + count):
            value = self._registers.read(number, kind // 4)
            if value is None:
                answer += bytes([READ_ERROR]) + varuint(number) + varuint(UNKNOWN_REGISTER)
                return False
            reply += struct.pack(_FORMATS[kind // 4], value)
        answer += reply
        return True

    def _stream(self, kind: int, asked: Bytes, answer: bytearray, *, respond: bool) -> None:
        channel, count = asked.varuint(), asked.varuint()
        stream = self._streams.get(channel)
        if stream is None or (kind == CLIENT_DATA and count > asked.left):
            raise MalformedError
        most = LARGEST_FRAME - _OVERHEAD
        if kind == CLIENT_DATA:
            # More than the input holds is an overrun: none of it is read, and it is taken for subframes.
            if count <= _INPUT:
                stream.take(asked.take(count))
        else:
            most = min(most, count)
        if respond:
            given = stream.give(most)
            answer += bytes([SERVER_DATA]) + varuint(channel) + varuint(len(given)) + given


def told(frame: bytes) -> str:
    """Return what a frame's bytes ask, in words: `write 000H 01CH read 00DH`, `stream 1 tel get servo_control`, `poll 1`."""
    return " ".join(_words(Bytes(frame)))


def _words(asked: Bytes) -> Iterator[str]:
    try:
        while asked.left:
            kind = asked.varuint()
            if kind < REPLY:
                count = kind % 4 or asked.varuint()
                register = asked.varuint()
                if kind < READ:
                    asked.take(count * struct.calcsize(_FORMATS[kind // 4]))
                yield "write" if kind < READ else "read"
                yield from (f"{number:03X}H" for number in range(register, register + min(count, LARGEST_FRAME)))
            elif kind in (CLIENT_DATA, CLIENT_POLL):
                channel, count = asked.varuint(), asked.varuint()
                yield f"{'stream' if kind == CLIENT_DATA else 'poll'} {channel}"
                if kind == CLIENT_DATA:
                    yield asked.take(count).decode("ascii", "replace").strip()
            elif kind != NOP:
                yield f"subframe {kind:02X}H"
                return
    except MalformedError:
        yield "malformed"
