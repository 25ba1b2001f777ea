"""A reply that is made while it is sent: a record's samples, say, whose text is many times their size."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass


@dataclass(frozen=True)
class LongReply:
    """Bytes of a reply in `parts`, each made when it is wanted, once."""

    parts: Iterable[bytes]

    def __bytes__(self) -> bytes:
        return b"".join(self.parts)


def joined(replies: "list[str | bytes | LongReply]") -> bytes | LongReply:
    """Return several replies as one, semicolons between them; a long one among them is still made as it is sent."""
    if any(isinstance(reply, LongReply) for reply in replies):
        return LongReply(_chained(replies))
    return b";".join(reply.encode("latin-1") if isinstance(reply, str) else bytes(reply) for reply in replies)


def _chained(replies: "list[str | bytes | LongReply]") -> Iterator[bytes]:
    for place, reply in enumerate(replies):
        if place:
            yield b";"
        if isinstance(reply, LongReply):
            yield from reply.parts
        else:
            yield reply.encode("latin-1") if isinstance(reply, str) else reply
