"""Standard streams that stop no measurement: closed ones, those of few characters, those on a full disk."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import TextIOWrapper
from typing import BinaryIO

_MODES = (("stdin", "r"), ("stdout", "w"), ("stderr", "w"))


class StandardStream(TextIOWrapper):
    """A stream that takes what cannot be written any more, and keeps the reason in `failed`; a reader who has left is an error as ever."""

    failed: OSError | None = None
    #: What it stands in for, which would close the file with its end.
    before: TextIOWrapper | None = None

    def write(self, words: str) -> int:
        """Write words, or let them go."""
        try:
            return super().write(words)
        except BrokenPipeError:
            raise
        except OSError as error:
            self.failed = self.failed or error
        return len(words)

    def flush(self) -> None:
        """Flush, or note that it cannot be."""
        try:
            super().flush()
        except BrokenPipeError:
            raise
        except OSError as error:
            self.failed = self.failed or error


def open_streams() -> None:
    """Give standard input, output and error something to read or write, where they are what this process began with or nothing at all."""
    for name, mode in _MODES:
        stream = getattr(sys, name)
        if stream is None:
            # The descriptor is taken, too: else a file of a run would have it, and what others print would be in it.
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115
        elif name != "stdin" and type(stream) is TextIOWrapper:
            # One whose descriptor was given to a pipe after it was opened, as in a forked process, cannot be wrapped.
            with suppress(OSError):
                own = StandardStream(
                    stream.buffer,
                    stream.encoding,
                    "backslashreplace",
                    line_buffering=stream.line_buffering,
                    write_through=stream.write_through,
                )
                own.before = stream
                setattr(sys, name, own)


@contextmanager
def standard_bytes() -> Iterator[BinaryIO]:
    """Give standard output for bytes; what cannot be written any more is let go, as its text is."""
    try:
        yield sys.stdout.buffer
    except BrokenPipeError:
        raise
    except OSError as error:
        if not isinstance(sys.stdout, StandardStream):
            raise
        sys.stdout.failed = sys.stdout.failed or error


def unprinted() -> OSError | None:
    """Return why standard output is incomplete, None where it is whole or its reader has left."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        sys.stderr.close()
        return None
    return sys.stdout.failed if isinstance(sys.stdout, StandardStream) else None
