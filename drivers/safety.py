"""The way down from an energised state."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from drivers.interfaces import InstrumentError


@contextmanager
def always(end: Callable[[], None]) -> Iterator[None]:
    """Run the block and then `end`, however the block ends, Ctrl-C included.

    An error of the block stays the one that is raised; a failure of `end` is then added to it as a note.
    """
    try:
        yield
    except BaseException as cause:
        try:
            _finish(end)
        except InstrumentError as failure:
            cause.add_note(f"On the way down: {failure}")
        raise
    _finish(end)


def _finish(end: Callable[[], None]) -> None:
    try:
        end()
    except KeyboardInterrupt:
        # An impatient second Ctrl-C must not leave the output on.
        end()
        raise
