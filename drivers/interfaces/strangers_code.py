"""Runs code of plug-ins so that nothing in it can end the program; only a person's Ctrl-C does."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class ExitAttemptError(ValueError):
    """Code of a plug-in tried to end the whole program."""


@contextmanager
def strangers_code() -> Iterator[None]:
    """Run code of a plug-in in the block.

    Raises what it raises; LeftError in place of SystemExit, KeyboardInterrupt and GeneratorExit, unless Ctrl-C was pressed.
    """
    pressed = False

    def note(number: int, frame: FrameType | None) -> None:
        nonlocal pressed
        pressed = True
        if callable(before):
            before(number, frame)

    before = signal.getsignal(signal.SIGINT)
    # Python hands signals to the main thread only.
    listens = threading.current_thread() is threading.main_thread() and callable(before)
    if listens:
        signal.signal(signal.SIGINT, note)
    try:
        yield
    except (SystemExit, KeyboardInterrupt, GeneratorExit) as error:
        if pressed:
            raise
        raise ExitAttemptError(f"{type(error).__name__}: {error}") from error
    finally:
        if listens:
            signal.signal(signal.SIGINT, before)
