"""A journal compressed when its run has ended, without loss: every byte comes back, and readers read it in place.

`journal.packed` is a line that names the format, and an xz stream of the journal's lines. A line of the chain is kept without its
number and without the hash of the line before, which no compression could shorten and which the lines themselves give again; its
date is kept in microseconds since the line before, and its time once. Any other line is kept as it is behind an exclamation mark.
Alike stands beside alike: the lines' kinds, their dates, their times, and what they say kind by kind; a twentieth less to keep.
"""

import hashlib
import io
import lzma
import os
import re
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from datetime import UTC, datetime, timedelta
from itertools import islice
from pathlib import Path
from typing import BinaryIO

from bench.i18n.errors import FileError
from bench.journal.disk import write_file
from drivers.interfaces.text import text

#: The file's first line; another format gets another number.
_HEAD = b"motorbench journal, packed 2\n"
#: That of before, whose lines stand in their own order.
_HEAD_IN_ORDER = b"motorbench journal, packed 1\n"
_NAME = "journal.packed"
#: For short texts with long repetitions: no alignment, more context.
_FILTER = {"id": lzma.FILTER_LZMA2, "preset": 6, "lc": 4, "lp": 0, "pb": 0}
#: A fourth of the time for a twelfth more bytes, and for nothing where it comes to one block of the disk (bytes) all the same.
_QUICK = {**_FILTER, "mode": lzma.MODE_FAST, "mf": lzma.MF_HC3, "nice_len": 64, "depth": 8}
_BLOCK = 4096
#: What the compressor looks back over (bytes): its tables are made anew for each journal, and most are short.
_SHORTEST_WINDOW, _LONGEST_WINDOW = 1 << 16, 1 << 23
#: A journal is not longer than this (bytes): a file that was changed may claim anything.
_LONGEST = 1 << 30
_AS_IT_IS = b"!"
_KIND = re.compile(rb'"kind":"([a-z_]+)",')
_TIMES = re.compile(rb'"wall":"(\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{6}\+00:00)","time":([-+.\de]+),')
#: Stands for the line's own time further on in it.
_SAME_TIME = b":~"
_EPOCH, _MICROSECOND = datetime(2000, 1, 1, tzinfo=UTC), timedelta(microseconds=1)


def packed_path(journal: Path) -> Path:
    """Return where a journal is once it is packed."""
    return journal.with_name(_NAME)


def is_journal(journal: Path) -> bool:
    """Tell whether there is a journal, packed or not; none is seen in a folder that must not be entered."""
    return os.path.isfile(journal) or os.path.isfile(packed_path(journal))


def open_journal(journal: Path) -> BinaryIO:
    """Open a journal for reading, packed or not. Raises OSError; FileError for a packed one that is none."""
    try:
        return journal.open("rb")
    except FileNotFoundError:
        try:
            content = packed_path(journal).read_bytes()
        except FileNotFoundError:
            pass
        else:
            return io.BytesIO(_unpacked(packed_path(journal), content))
        raise


def pack(journal: Path) -> None:
    """Replace a journal by its packed form, durably and whole or not at all. Raises OSError where it cannot be read or written."""
    content = journal.read_bytes()
    packed = _HEAD + _compressed(b"\n".join(_beside_alike(list(_shortened(content)))))
    if _unpacked(packed_path(journal), packed) != content:
        raise OSError(f"{journal}: its packed form does not give it back")
    write_file(packed_path(journal), packed)
    journal.unlink()


def unpack(journal: Path) -> None:
    """Unpack a packed journal so that the run can be continued; an unpacked one is unchanged. Raises OSError, FileError."""
    packed = packed_path(journal)
    if packed.is_file() and not journal.is_file():
        write_file(journal, _unpacked(packed, packed.read_bytes()))
        packed.unlink()


def _compressed(short: bytes) -> bytes:
    window = {"dict_size": min(max(len(short), _SHORTEST_WINDOW), _LONGEST_WINDOW)}
    if len(short) <= _SHORTEST_WINDOW:
        quick = lzma.compress(short, lzma.FORMAT_XZ, filters=[{**_QUICK, **window}])
        if len(_HEAD) + len(quick) <= _BLOCK:
            return quick
    return lzma.compress(short, lzma.FORMAT_XZ, filters=[{**_FILTER, **window}])


def _shortened(content: bytes) -> Iterator[bytes]:
    *lines, torn = content.split(b"\n")
    previous, wall, time = "", _EPOCH, b""
    for place, line in enumerate(lines, 1):
        begin, end = _frame(place, previous)
        inner = line[len(begin) : len(line) - len(end)]
        match = _TIMES.match(inner)
        framed = len(line) > len(begin) + len(end) and line.startswith(begin) and line.endswith(end)
        if match and framed and _SAME_TIME not in inner:
            now, before = datetime.fromisoformat(match[1].decode()), time
            time = match[2]
            rest = inner[match.end() :].replace(b":" + time, _SAME_TIME)
            yield b"%d,%s,%s" % ((now - wall) // _MICROSECOND, b"" if time == before else time, rest)
            wall = now
        else:
            yield _AS_IT_IS + line
        previous = hashlib.sha256(line).hexdigest()
    yield _AS_IT_IS + torn


def _beside_alike(lines: list[bytes]) -> Iterator[bytes]:
    """Give how many lines there are, their kinds, the dates and times of those of the chain, and what all say, kind by kind."""
    kinds, dates, times = list[bytes](), list[bytes](), list[bytes]()
    said: dict[bytes, list[bytes]] = {}
    for line in lines:
        kind, rest = _AS_IT_IS, line[1:]
        if not line.startswith(_AS_IT_IS):
            date, time, rest = line.split(b",", 2)
            dates.append(date)
            times.append(time)
            match = _KIND.match(rest)
            kind, rest = (match[1], rest[match.end() :]) if match else (b"", rest)
        kinds.append(kind)
        said.setdefault(kind, []).append(rest)
    yield b"%d" % len(lines)
    for part in (kinds, dates, times, *said.values()):
        yield from part


def _in_order(parts: list[bytes]) -> list[bytes]:
    """Return the lines that `_beside_alike` took apart. Raises ValueError for what it did not give."""
    left = iter(parts)

    def taken(count: int) -> list[bytes]:
        some = list(islice(left, count))
        if len(some) < count:
            raise ValueError
        return some

    kinds = taken(int(taken(1)[0]))
    chained = sum(kind != _AS_IT_IS for kind in kinds)
    dates, times = iter(taken(chained)), iter(taken(chained))
    said = {kind: iter(taken(count)) for kind, count in Counter(kinds).items()}
    if next(left, None) is not None:
        raise ValueError
    lines = []
    for kind in kinds:
        rest = next(said[kind])
        if kind == _AS_IT_IS:
            lines.append(_AS_IT_IS + rest)
        else:
            named = b'"kind":"%s",%s' % (kind, rest) if kind else rest
            lines.append(b"%s,%s,%s" % (next(dates), next(times), named))
    return lines


def _restored(lines: list[bytes]) -> Iterator[bytes]:
    previous, wall, time = "", _EPOCH, b""
    for place, short in enumerate(lines, 1):
        if short.startswith(_AS_IT_IS):
            line = short[1:]
        else:
            begin, end = _frame(place, previous)
            later, another, rest = short.split(b",", 2)
            wall += int(later) * _MICROSECOND
            time = another or time
            stamp = wall.isoformat(timespec="microseconds").encode()
            rest = rest.replace(_SAME_TIME, b":" + time)
            line = b'%s"wall":"%s","time":%s,%s%s' % (begin, stamp, time, rest, end)
        yield line
        previous = hashlib.sha256(line).hexdigest()


def _frame(place: int, previous: str) -> tuple[bytes, bytes]:
    """Return what stands before and behind what a line of the chain says."""
    return b'{"n":%d,' % place, b',"previous":"%s"}' % previous.encode()


def _unpacked(path: Path, packed: bytes) -> bytes:
    if packed.startswith((_HEAD, _HEAD_IN_ORDER)):
        with suppress(lzma.LZMAError, ValueError, OverflowError):
            reader = lzma.LZMADecompressor(lzma.FORMAT_XZ)
            content = reader.decompress(packed[len(_HEAD) :], _LONGEST)
            if reader.eof and not reader.unused_data:
                lines = content.split(b"\n")
                return b"\n".join(_restored(_in_order(lines) if packed.startswith(_HEAD) else lines))
    raise FileError(text("{path}: this is no packed journal, or it was changed or cut off", path=path))
