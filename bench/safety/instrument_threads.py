"""Calls to instruments that do not wait for each other longer than they must."""

import queue
import threading
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")


class Call(Generic[T]):
    """One call under way: what it gave, or the error, once `done` is set."""

    def __init__(self, work: Callable[[], T]) -> None:
        self._work = work
        self.done = threading.Event()
        self.value: T | None = None
        self.error: BaseException | None = None

    def run(self) -> None:
        """Do the work; whatever it raises is kept."""
        try:
            self.value = self._work()
        except BaseException as error:  # noqa: BLE001  not even an interrupt may keep the next call from being made
            self.error = error
        finally:
            self.done.set()


class Lane:
    """Makes calls one after the other on a thread of its own, which a call that never returns may keep for ever."""

    def __init__(self, name: str) -> None:
        self._calls: queue.SimpleQueue[Call[object] | None] = queue.SimpleQueue()
        threading.Thread(target=self._run, name=f"way down: {name}", daemon=True).start()

    def submit(self, call: "Call[object]") -> None:
        """Have a call made after those before it."""
        self._calls.put(call)

    def end(self) -> None:
        """Let the thread go once everything is done."""
        self._calls.put(None)

    def _run(self) -> None:
        while (call := self._calls.get()) is not None:
            call.run()
