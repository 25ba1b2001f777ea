"""A signal that the main thread hears at once, whichever thread the system gave it to and whatever the main one waits in."""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

#: What interrupts a system call of the main thread; its handler is the caller's.
NUDGE = signal.SIGUSR1
#: How often (s) the main thread is nudged until it has heard.
_INTERVAL = 0.01


class Nudge:
    """While `active`, every signal that arrives, and every `give`, nudges the main thread until `heard` is set.

    Python runs handlers in the main thread, between two of its steps: a signal that another thread received, or that came
    just before a system call began, would be heard only when the call has ended.
    """

    def __init__(self) -> None:
        self.heard = threading.Event()
        self._waker = -1

    def give(self) -> None:
        """Nudge, from any thread; does nothing while nobody is active."""
        if self._waker >= 0:
            with suppress(OSError):
                os.write(self._waker, b"\0")

    @contextmanager
    def active(self) -> Iterator[None]:
        """Nudge within the block, which the main thread must enter."""
        waking, self._waker = os.pipe()
        os.set_blocking(self._waker, False)
        before = signal.set_wakeup_fd(self._waker, warn_on_full_buffer=False)
        main = threading.get_ident()
        ending = threading.Event()
        thread = threading.Thread(target=self._work, args=(waking, main, ending), name="nudge", daemon=True)
        thread.start()
        try:
            yield
        finally:
            signal.set_wakeup_fd(before)
            ending.set()
            waker, self._waker = self._waker, -1
            os.close(waker)
            thread.join()
            os.close(waking)

    def _work(self, waking: int, main: int, ending: threading.Event) -> None:
        while arrived := os.read(waking, 4096):
            if set(arrived) == {NUDGE}:
                continue
            while not (self.heard.is_set() or ending.is_set()):
                signal.pthread_kill(main, NUDGE)
                self.heard.wait(_INTERVAL)
