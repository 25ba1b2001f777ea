"""Where the serial numbers of a batch come from: a file, a scanner or keyboard, or made up for virtual motors."""

import os
import queue
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Protocol

from bench.i18n.errors import InputError
from drivers.interfaces.text import text

#: No line of a file or a scanner is longer (characters); what is, is refused as a serial number anyway.
_LONGEST = 4096
#: Lines of a stream that are read before they are needed.
_AHEAD = 1000


class Serials(Protocol):
    """Gives serial numbers one by one, as they were given: nothing is checked here."""

    @property
    def descriptor(self) -> int | None:
        """What becomes readable when there is something new; None where `take` never has to wait."""

    def take(self) -> str | None:
        """Return the next; None where there is none now."""

    @property
    def ended(self) -> bool:
        """Whether there will be no more."""

    def close(self) -> None:
        """Let go of the source."""


class MadeUp:
    """Serial numbers `pattern` formatted with the motors' numbers `first` … `last`."""

    descriptor = None

    def __init__(self, pattern: str, first: int, last: int) -> None:
        self._pattern = pattern
        self._next, self._last = first, last

    @property
    def ended(self) -> bool:
        """Whether all were given."""
        return self._next > self._last

    def take(self) -> str | None:
        """Return the next."""
        if self.ended:
            return None
        self._next += 1
        return self._pattern.format(number=self._next - 1)

    def close(self) -> None:
        """Pass."""


class FromFile:
    """The lines of a file, read as they are needed; empty ones are passed over. Raises InputError where it cannot be read."""

    descriptor = None

    def __init__(self, path: Path) -> None:
        try:
            _check_text(path)
            self._file = path.open(encoding="utf-8-sig", errors="backslashreplace")
        except OSError as error:
            raise InputError(
                text(
                    "{path}: the file of serial numbers cannot be read: {strerror}", path=path, strerror=error.strerror
                )
            ) from None
        self._lines = self._read()
        self._ahead = next(self._lines, None)

    @property
    def ended(self) -> bool:
        """Whether all were given."""
        return self._ahead is None

    def take(self) -> str | None:
        """Return the next line."""
        line, self._ahead = self._ahead, next(self._lines, None)
        return line

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _read(self) -> Iterator[str]:
        while line := self._file.readline(_LONGEST):
            if given := line.strip(" \r\n"):
                yield given


def _check_text(path: Path) -> None:
    # What comes through a pipe can be read but once: there each line is judged as it comes.
    if path.is_file():
        try:
            with path.open(encoding="utf-8") as file:
                while file.read(1 << 16):
                    pass
        except UnicodeDecodeError as error:
            raise InputError(text("{path}: the file of serial numbers is not UTF-8 text", path=path)) from error


class Given:
    """Serial numbers as they are given, from any thread."""

    def __init__(self) -> None:
        self._lines: queue.Queue[str] = queue.Queue(_AHEAD)
        self._over = False
        self._reading, self._writing = os.pipe()
        os.set_blocking(self._reading, False)

    @property
    def descriptor(self) -> int | None:
        """What becomes readable with each one."""
        return self._reading

    @property
    def waiting(self) -> int:
        """How many were given and not taken."""
        return self._lines.qsize()

    @property
    def ended(self) -> bool:
        """Whether there will be no more and all were taken."""
        return self._over and self._lines.empty()

    def give(self, serial: str) -> None:
        """Hand one in; waits while very many have not been taken."""
        self._lines.put(serial)
        self._tell()

    def end(self) -> None:
        """Say that there will be no more."""
        self._over = True
        self._tell()

    def take(self) -> str | None:
        """Return the next that has come."""
        try:
            os.read(self._reading, 1)
        except BlockingIOError:
            return None
        try:
            return self._lines.get_nowait()
        except queue.Empty:
            return None

    def close(self) -> None:
        """Stop listening; what was given and not taken is lost."""
        os.close(self._reading)

    def _tell(self) -> None:
        try:
            os.write(self._writing, b"\n")
        except OSError:
            # Nobody listens any more.
            return


class FromStream(Given):
    """The lines of a scanner or a keyboard, as they come."""

    def __init__(self, stream: IO[str]) -> None:
        super().__init__()
        threading.Thread(target=self._read, args=(stream,), name="serial numbers", daemon=True).start()

    def _read(self, stream: IO[str]) -> None:
        while line := stream.readline(_LONGEST):
            if given := line.strip(" \r\n"):
                self.give(given)
        self.end()
