"""A worker's end of the line to the coordinator: its messages are sorted as they come, whatever the worker is doing."""

import queue
import threading
from collections.abc import Callable
from multiprocessing.connection import Connection

from bench.eol.line.arbiter import Answer
from bench.eol.line.messages import FromWorker, Leave, Stop, Task, Told


class Channel:
    """Reads on a thread of its own; `stop` is called there with the reason when the run under way is to end.

    A coordinator that has gone is a reason too: nobody would keep the record.
    """

    def __init__(self, connection: Connection, stop: Callable[[str], None]) -> None:
        self._connection = connection
        self._stop = stop
        self._tasks: queue.SimpleQueue[Task | Leave] = queue.SimpleQueue()
        self._answers: queue.SimpleQueue[Told] = queue.SimpleQueue()
        threading.Thread(target=self._read, name="line", daemon=True).start()

    def task(self) -> Task | None:
        """Return the next motor; None when there are no more."""
        task = self._tasks.get()
        return task if isinstance(task, Task) else None

    def answer(self, ticket: int) -> Answer:
        """Return the answer to a ticket, when it comes."""
        while (told := self._answers.get()).ticket != ticket:
            pass
        return told.answer

    def send(self, message: FromWorker) -> None:
        """Tell the coordinator. Raises OSError where it has gone."""
        self._connection.send(message)

    def _read(self) -> None:
        try:
            while True:
                self._take(self._connection.recv())
        except (EOFError, OSError):
            self._stop("the end of the batch's process")
            self._tasks.put(Leave())

    def _take(self, message: object) -> None:
        if isinstance(message, Stop):
            self._stop(message.by)
        elif isinstance(message, Told):
            self._answers.put(message)
        elif isinstance(message, Task | Leave):
            self._tasks.put(message)
