"""Ctrl-C and the signals that end a program, as one exception that takes the way down."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Interrupted(BaseException):
    """A person or the system wants the run to end now; no `except Exception` may swallow it."""

    def __init__(self, by: str) -> None:
        self.by = by
        super().__init__(f"interrupted by {by}")


@contextmanager
def raising() -> Iterator[None]:
    """Within the block, the first Ctrl-C, SIGTERM or SIGHUP raises Interrupted in the main thread.

    Those that follow do nothing: what the first one set going is the way down, and it is walked to its end.
    """
    interrupted = False

    def interrupt(number: int, _frame: FrameType | None) -> None:
        nonlocal interrupted
        if interrupted:
            return
        interrupted = True
        raise Interrupted("Ctrl-C" if number == signal.SIGINT else signal.Signals(number).name)

    with _handled(interrupt):
        yield


@contextmanager
def held_back() -> Iterator[None]:
    """Within the block those signals do nothing: the way down is walked to its end."""

    def nothing(_number: int, _frame: FrameType | None) -> None:
        return None

    with _handled(nothing):
        yield


@contextmanager
def _handled(handler: "signal._HANDLER") -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        # Only the main thread receives signals, and only it may say what they do.
        yield
        return
    before = {number: signal.signal(number, handler) for number in _SIGNALS}
    try:
        yield
    finally:
        for number, handler_before in before.items():
            signal.signal(number, handler_before)
