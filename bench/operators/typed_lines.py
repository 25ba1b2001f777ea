"""Lines that a person types, waited for no longer than wanted."""

import os
import select
import sys
from time import monotonic


class TypedLines:
    """The lines of the standard input. What was read beyond a line is kept for the next call."""

    def __init__(self) -> None:
        self._held = b""

    def next(self, patience: float | None = None) -> str | None:
        """Return the next line, None where none came within `patience` (s). Raises EOFError where there is none any more."""
        try:
            file = sys.stdin.fileno()
        except (OSError, AttributeError):
            # A stream within the program has no descriptor, and nobody who could keep one waiting.
            return _line(sys.stdin.readline())
        deadline = None if patience is None else monotonic() + patience
        while b"\n" not in self._held:
            left = None if deadline is None else max(0.0, deadline - monotonic())
            if not select.select([file], [], [], left)[0]:
                return None
            part = os.read(file, 1 << 16)
            if not part:
                last, self._held = self._held, b""
                return _line(_decoded(last))
            self._held += part
        line, _, self._held = self._held.partition(b"\n")
        return _decoded(line)


def _line(line: str) -> str:
    if not line:
        raise EOFError
    return line


def _decoded(line: bytes) -> str:
    return line.decode(sys.stdin.encoding or "utf-8", "replace")
