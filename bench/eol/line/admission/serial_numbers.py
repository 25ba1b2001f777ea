"""Sources of a batch's serial numbers: a file, a scanner or keyboard, or generated for virtual motors."""

import os
import queue
import threading
from abc import ABC, abstractmethod
from collections.abc import Generator
from contextlib import suppress
from pathlib import Path
from typing import IO

from bench.eol.line.preparation.line_file import ProductionLine
from bench.eol.line.preparation.prepare import BatchRequest
from bench.eol.plan import Plan
from bench.files.toml_file import not_utf8
from bench.i18n.errors import FileError, InputError, UsageError
from drivers.interfaces.text import reason_of, text, text_of

#: Serial numbers that come from a panel, as `--serials` says it.
PANEL = "panel"
#: No line of a file or a scanner is longer (characters); what is, is refused as a serial number anyway.
_LONGEST = 4096
#: Lines of a stream that are read before they are needed.
_AHEAD = 1000


class SerialNumbers(ABC):
    """Gives serial numbers one by one; nothing is checked here."""

    #: What becomes readable when there is something new; None where `take` never has to wait.
    descriptor: int | None = None
    #: Whether it is a list, that begins anew when a batch goes on.
    listed = False

    @abstractmethod
    def take(self) -> str | None:
        """Return the next; None where there is none now."""

    @property
    @abstractmethod
    def ended(self) -> bool:
        """Return whether there will be no more."""

    @abstractmethod
    def close(self) -> None:
        """Close the source."""


class ListedSerials(SerialNumbers):
    """Serial numbers that are all there already, taken from an iterator as they are needed."""

    listed = True

    def __init__(self, serials: Generator[str]) -> None:
        self._serials = serials
        self._next = next(serials, None)

    @property
    def ended(self) -> bool:
        """Return whether all were taken."""
        return self._next is None

    def take(self) -> str | None:
        """Return the next."""
        serial, self._next = self._next, next(self._serials, None)
        return serial

    def close(self) -> None:
        """Close the iterator, and with it its file."""
        self._serials.close()


def generated_serials(pattern: str, count: int, first: int = 1) -> ListedSerials:
    """Return so many serial numbers: `pattern` formatted with `first` and those after it."""
    return ListedSerials(pattern.format(number=number) for number in range(first, first + count))


def serials_of_file(path: Path) -> ListedSerials:
    """Return the lines of a file; empty ones are passed over. Raises FileError where it cannot be read, or all are empty."""
    try:
        _check_text(path)
        serials = ListedSerials(_lines(path))
    except OSError as error:
        raise FileError(
            text("{path}: the file of serial numbers cannot be read: {strerror}", path=path, strerror=reason_of(error))
        ) from None
    if serials.ended:
        raise FileError(text("{path}: the file has no serial number; write one a line", path=path))
    return serials


def _lines(path: Path) -> Generator[str]:
    with path.open(encoding="utf-8-sig", errors="backslashreplace") as file:
        yield from _serials_in(file)


def _serials_in(stream: IO[str]) -> Generator[str]:
    while line := stream.readline(_LONGEST):
        rest = line
        while len(rest) == _LONGEST and not rest.endswith("\n"):
            # The end of a line that is too long is no serial number of its own.
            rest = stream.readline(_LONGEST)
        if serial := line.strip():
            yield serial


def _check_text(path: Path) -> None:
    # What comes through a pipe can be read but once: there each line is judged as it comes.
    if path.is_file():
        with path.open("rb") as file:
            first = file.read(2)
        try:
            with path.open(encoding="utf-8") as file:
                while file.read(1 << 16):
                    pass
        except UnicodeDecodeError as error:
            raise not_utf8(str(path), first, error) from None


class QueuedSerials(SerialNumbers):
    """Serial numbers that any thread puts in."""

    descriptor: int

    def __init__(self) -> None:
        self._lines: queue.Queue[str] = queue.Queue(_AHEAD)
        self._no_more = False
        self.descriptor, self._writing = os.pipe()
        os.set_blocking(self.descriptor, False)

    @property
    def waiting(self) -> int:
        """The number of serial numbers that were put in and not taken."""
        return self._lines.qsize()

    @property
    def ended(self) -> bool:
        """Return whether there will be no more and all were taken."""
        return self._no_more and self._lines.empty()

    def put(self, serial: str) -> None:
        """Put one in; waits while very many have not been taken."""
        self._lines.put(serial)
        self._signal()

    def end(self) -> None:
        """Say that there will be no more."""
        self._no_more = True
        self._signal()

    def take(self) -> str | None:
        """Return the next that has come."""
        try:
            os.read(self.descriptor, 1)
        except BlockingIOError:
            return None
        try:
            return self._lines.get_nowait()
        except queue.Empty:
            return None

    def left(self) -> list[str]:
        """Return, and forget, what was put in and not taken."""
        left = []
        with suppress(queue.Empty):
            while True:
                left.append(self._lines.get_nowait())
        return left

    def close(self) -> None:
        """Close it; what was put in and not taken is lost."""
        os.close(self.descriptor)

    def _signal(self) -> None:
        try:
            os.write(self._writing, b"\n")
        except OSError:
            # Nobody listens any more.
            return


class ScannedSerials(QueuedSerials):
    """The lines of a scanner or a keyboard, as they come."""

    def __init__(self, stream: IO[str]) -> None:
        super().__init__()
        #: Whether there was one at all.
        self.any = False
        threading.Thread(target=self._read, args=(stream,), name="serial numbers", daemon=True).start()

    def _read(self, stream: IO[str]) -> None:
        for serial in _serials_in(stream):
            self.any = True
            self.put(serial)
        self.end()


def open_serials(request: BatchRequest, plan: Plan, line: ProductionLine, stream: IO[str]) -> SerialNumbers:
    """Return the batch's serial numbers; `stream` is where they are typed or scanned.

    Raises UsageError where the request contradicts itself or the line, InputError for a file that cannot be read.
    """
    first = request.first_serial
    if request.motors is not None and request.serials:
        raise UsageError(text("--motors N generates serial numbers and --serials reads them; give only one of them"))
    if request.motors is not None:
        if not line.is_virtual:
            raise UsageError(
                text(
                    "--motors N is for virtual benches; give the serial numbers of real motors with --serials "
                    "FILE or --serials -"
                )
            )
        if not 1 <= request.motors <= 10_000_000:
            raise UsageError(text("--motors {motors}: allowed are 1 to 10000000", motors=request.motors))
        if not 1 <= first <= 1_000_000_000:
            raise UsageError(text("--first-serial {first}: allowed are 1 to 1000000000", first=first))
        for number in (first, first + request.motors - 1):
            try:
                plan.check_serial(plan.spread.serial.format(number=number))
            except InputError as error:
                raise InputError(
                    text(
                        "{error}; --motors makes serial numbers up by virtual.serial = {pattern!r} of {source}: write it so that "
                        "they match, or give --serials FILE",
                        error=text_of(error),
                        pattern=plan.spread.serial,
                        source=plan.source,
                    )
                ) from None
        return generated_serials(plan.spread.serial, request.motors, first)
    if first != 1:
        raise UsageError(text("--first-serial {first}: only for the motors of --motors N; add --motors", first=first))
    if not request.serials or request.serials == "-":
        return ScannedSerials(stream)
    if request.serials == PANEL:
        return QueuedSerials()
    return serials_of_file(Path(request.serials))
