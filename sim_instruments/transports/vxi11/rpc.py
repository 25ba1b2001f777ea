"""Remote procedure calls as VXI-11 uses them: records on TCP (RFC 5531) with numbers and byte strings (RFC 4506)."""

import struct
from dataclasses import dataclass

from sim_instruments.transports.client import Client

_CALL, _REPLY, _VERSION, _LAST, _NOBODY = 0, 1, 2, 1 << 31, bytes(8)
SUCCESS, NO_PROGRAM, OTHER_VERSION, NO_PROCEDURE, GARBAGE = range(5)


class GarbageError(Exception):
    """Bytes that are not what they should be."""


class XdrReader:
    """Takes one value after the other out of a record. Raises GarbageError where there is none."""

    def __init__(self, data: bytes) -> None:
        self._data, self._place = data, 0

    def numbers(self, count: int) -> tuple[int, ...]:
        """Return unsigned numbers."""
        return struct.unpack(f"!{count}I", self._taken(4 * count))

    def opaque(self) -> bytes:
        """Return a string of bytes."""
        size = self.numbers(1)[0]
        return self._taken(size + -size % 4)[:size]

    def _taken(self, size: int) -> bytes:
        data, self._place = self._data[self._place : self._place + size], self._place + size
        if len(data) < size:
            raise GarbageError
        return data


def numbers(*values: int) -> bytes:
    """Return unsigned numbers as they are sent."""
    return struct.pack(f"!{len(values)}I", *values)


def opaque(data: bytes) -> bytes:
    """Return a string of bytes as it is sent."""
    return numbers(len(data)) + data + bytes(-len(data) % 4)


def call(program: int, version: int, procedure: int, parameters: bytes) -> bytes:
    """Return a call that nobody answers."""
    return _record(numbers(0, _CALL, _VERSION, program, version, procedure) + 2 * _NOBODY + parameters)


@dataclass(frozen=True)
class RpcCall:
    """A client's call."""

    identifier: int
    program: int
    version: int
    procedure: int
    parameters: XdrReader

    def reply(self, outcome: int, results: bytes = b"") -> bytes:
        """Return what answers it."""
        return _record(numbers(self.identifier, _REPLY, 0) + _NOBODY + numbers(outcome) + results)


async def receive(client: Client, longest: int) -> RpcCall:
    """Return a client's next call. Raises ConnectionAbortedError for what is none, or longer than `longest` bytes."""
    content, mark = b"", 0
    while not mark & _LAST:
        mark = int.from_bytes(await client.exactly(4, begun=bool(mark)), "big")
        size = mark & ~_LAST
        # Fragments without a byte would go on for ever.
        if len(content) + size > longest or not size:
            raise ConnectionAbortedError
        content += await client.exactly(size, begun=True)
    reader = XdrReader(content)
    try:
        identifier, *kind, program, version, procedure = reader.numbers(6)
        for _ in ("credentials", "verifier"):
            reader.numbers(1)
            reader.opaque()
    except GarbageError:
        kind = []
    if kind != [_CALL, _VERSION]:
        raise ConnectionAbortedError
    return RpcCall(identifier, program, version, procedure, reader)


def _record(content: bytes) -> bytes:
    return numbers(_LAST | len(content)) + content
