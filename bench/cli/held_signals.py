"""Ctrl-C and the signals that end a program, held off while something is half done that must be brought to its end."""

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def signals_held(said: str) -> Iterator[None]:
    """Within the block, each signal puts a sentence on standard error and ends nothing; signals reach the main thread only."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def tell(_number: int, _frame: FrameType | None) -> None:
        # A terminal that was closed takes nothing more; a message in the middle of another one is let go.
        with suppress(OSError, ValueError, RuntimeError):
            print(f"motorbench: {said}", file=sys.stderr, flush=True)

    before = {number: signal.signal(number, tell) for number in _SIGNALS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
