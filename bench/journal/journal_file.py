"""A journal on the disk: complete lines, each with the hash of the line before, and possibly an incomplete last one."""

import hashlib
import os
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from bench.i18n.errors import FileError, InputError
from bench.journal.codec import RecordedEvent, decode
from bench.journal.packed import open_journal
from drivers.interfaces.text import reason_of, text

#: No event is longer than this (bytes); a file without line ends must not be taken into memory whole.
LONGEST_LINE = 64 * 1024 * 1024
#: So much (bytes) of a journal's end holds its last line, mostly.
_TAIL = 64 * 1024


@dataclass(frozen=True)
class JournalLine:
    """One line as read: its place in the file from 1, its length (bytes), and the SHA-256 that the next one must carry.

    `event` is None for what is no event, `previous` the hash it carries of the line before; a line that does not end
    was `torn`.
    """

    place: int
    length: int
    sha256: str
    torn: bool
    event: RecordedEvent | None
    previous: str


@dataclass(frozen=True)
class JournalFile:
    """A journal that was read: its complete events, the number of bytes of an incomplete end, and where and how they end."""

    events: tuple[RecordedEvent, ...]
    torn_bytes: int
    length: int
    last_hash: str

    @property
    def torn(self) -> bool:
        """Return whether something was cut off in writing."""
        return self.torn_bytes > 0


def read_lines(path: Path, only: Collection[str] | None = None) -> Iterator[JournalLine]:
    """Give a journal's lines in order, whatever they hold; events of kinds beside `only` as data alone, where it is given.

    Raises FileError where the file cannot be read.
    """
    try:
        with open_journal(path) as file:
            place = 0
            while content := file.readline(LONGEST_LINE):
                place += 1
                yield parse_line(place, content, only)
    except OSError as error:
        raise FileError(
            text("{path}: the journal cannot be read: {strerror}", path=path, strerror=reason_of(error))
        ) from None


def read_journal(path: Path, only: Collection[str] | None = None) -> JournalFile:
    """Read a journal; an incomplete end is left out and counted in `torn_bytes`.

    Events of kinds beside `only`, where it is given, are not taken apart: for who has just written them.
    Raises InputError for a file that is missing, or whose chain of hashes is broken at some line.
    """
    events: list[RecordedEvent] = []
    last_hash, length, torn, torn_at = "", 0, 0, 0
    for line in read_lines(path, only):
        if torn or line.torn or line.event is None:
            # A power cut may leave several broken lines, but no whole one after them.
            if line.event is not None and not line.torn:
                raise InputError(
                    text(
                        "{path}: line {torn_at} is not an event; the journal was changed after it was written",
                        path=path,
                        torn_at=torn_at,
                    )
                )
            torn, torn_at = torn + line.length, torn_at or line.place
            continue
        if line.previous != last_hash or line.event.number != line.place:
            raise InputError(
                text(
                    "{path}: line {place} does not follow from the line before; the journal was changed after it was "
                    "written. motorbench results verify {parent} says more",
                    path=path,
                    place=line.place,
                    parent=path.parent,
                )
            )
        events.append(line.event)
        last_hash = line.sha256
        length += line.length
    return JournalFile(tuple(events), torn, length, last_hash)


def last_whole_line(path: Path) -> JournalLine | None:
    """Return a journal's last line that was written to its end, None where there is none; its place is its event's number.

    Raises OSError; FileError for a packed journal that is none.
    """
    with open_journal(path) as file:
        size = file.seek(0, os.SEEK_END)
        wanted = min(size, _TAIL)
        while True:
            file.seek(size - wanted)
            content = file.read(wanted)
            end = content.rfind(b"\n") + 1
            begin = content.rfind(b"\n", 0, end - 1) + 1 if end else 0
            if wanted == size or begin:
                break
            wanted = min(size, 4 * wanted)
    if not end:
        return None
    line = parse_line(0, content[begin:end])
    return replace(line, place=line.event.number) if line.event else None


def parse_line(place: int, content: bytes, only: Collection[str] | None = None) -> JournalLine:
    """Return the content of a line of a journal, complete or not."""
    whole = content.endswith(b"\n")
    body = content[:-1] if whole else content
    event, previous = decode(body, only) or (None, "")
    return JournalLine(place, len(content), hashlib.sha256(body).hexdigest(), not whole, event, previous)
