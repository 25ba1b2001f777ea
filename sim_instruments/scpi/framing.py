"""Program messages in a stream of bytes, as a raw socket carries them."""

import re
from collections.abc import Iterator

_NOTABLE = re.compile(rb"[\n\"'#]")
_BLOCK = re.compile(rb"#([1-9])")


class MessageSplitter:
    """Splits a stream at newlines that stand neither in a string nor in a block; keeps at most `limit` bytes."""

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._buffer = bytearray()
        self._scanned = 0
        self._dropping = False

    @property
    def begun(self) -> bool:
        """True if a part of a message has arrived."""
        return bool(self._buffer) or self._dropping

    def feed(self, data: bytes) -> Iterator[bytes | None]:
        """Give the messages that are complete with `data`, newline included; None for one that was too long."""
        if self._dropping:
            newline = data.find(b"\n")
            if newline < 0:
                return
            data, self._dropping = data[newline + 1 :], False
        self._buffer += data
        while (end := self._end()) is not None:
            message = bytes(self._buffer[:end])
            del self._buffer[:end]
            self._scanned = 0
            yield message if len(message) <= self._limit else None
        if len(self._buffer) > self._limit:
            self._buffer.clear()
            self._scanned, self._dropping = 0, True
            yield None

    def _end(self) -> int | None:
        """Return where the first message ends; None where more is needed."""
        buffer = self._buffer
        while (match := _NOTABLE.search(buffer, self._scanned)) is not None:
            at, mark = match.start(), match.group()
            if mark == b"\n":
                return at + 1
            next_place = self._after_block(at) if mark == b"#" else self._after_string(at, mark)
            if next_place is None:
                self._scanned = at
                return None
            self._scanned = next_place
        self._scanned = len(buffer)
        return None

    def _after_string(self, at: int, quote: bytes) -> int | None:
        closing = self._buffer.find(quote, at + 1)
        newline = self._buffer.find(b"\n", at + 1)
        if newline >= 0 and (closing < 0 or newline < closing):
            # A string does not reach over the end of a line: its quote is a stray one.
            return newline
        return None if closing < 0 else closing + 1

    def _after_block(self, at: int) -> int | None:
        buffer = self._buffer
        if len(buffer) < at + 2:
            return None
        match = _BLOCK.match(buffer, at)
        if match is None:
            return at + 1
        count = int(match.group(1))
        digits = bytes(buffer[at + 2 : at + 2 + count])
        if not digits.isdigit():
            return None if len(digits) < count and not digits else at + 1
        if len(digits) < count:
            return None
        end = at + 2 + count + int(digits)
        return end if end <= len(buffer) else None
