"""Calls to several instruments in parallel, one thread for each instrument."""

import queue
import threading
from collections.abc import Callable
from typing import Any, Generic, TypeVar

T = TypeVar("T")


class ThreadCall(Generic[T]):
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


class InstrumentThreads:
    """A thread for each instrument, by name: calls to one are made one after the other, whoever asks for them.

    A call that never returns keeps its instrument's thread for ever, and no other.
    """

    def __init__(self) -> None:
        self._queues: dict[str, queue.SimpleQueue[ThreadCall[Any] | None]] = {}
        self._latest: dict[str, ThreadCall[Any]] = {}

    def submit(self, name: str, call: ThreadCall[Any]) -> None:
        """Queue a call after those before it."""
        if name not in self._queues:
            self._queues[name] = queue.SimpleQueue()
            threading.Thread(
                target=self._run, args=(self._queues[name],), name=f"shutdown: {name}", daemon=True
            ).start()
        self._latest[name] = call
        self._queues[name].put(call)

    def is_busy(self, name: str) -> bool:
        """Tell whether calls to an instrument are still under way."""
        return name in self._latest and not self._latest[name].done.is_set()

    def end(self) -> None:
        """End each thread once its calls are done."""
        for calls in self._queues.values():
            calls.put(None)

    @staticmethod
    def _run(calls: "queue.SimpleQueue[ThreadCall[Any] | None]") -> None:
        while (call := calls.get()) is not None:
            call.run()
