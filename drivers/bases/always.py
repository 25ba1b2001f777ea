"""Ends energised blocks safely."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from drivers.interfaces import UNWATCHED, Calls, InstrumentError


@contextmanager
def always(end: Callable[[], None], calls: Calls = UNWATCHED) -> Iterator[None]:
    """Run the block and then `end`, however the block ends, Ctrl-C included; no requested stop refuses the calls of `end`.

    An error of the block stays the one that is raised; a failure of `end` is then added to it as a note.
    """
    try:
        yield
    except BaseException as cause:
        try:
            _finish(end, calls)
        except InstrumentError as failure:
            cause.add_note(f"During the shutdown: {failure}")
        raise
    _finish(end, calls)


def _finish(end: Callable[[], None], calls: Calls) -> None:
    with calls.making_safe():
        try:
            end()
        except KeyboardInterrupt:
            # An impatient second Ctrl-C must not leave the output on.
            end()
            raise
