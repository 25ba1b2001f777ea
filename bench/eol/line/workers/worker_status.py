"""The progress of each worker: its bench time and its heartbeat, in memory that the coordinator reads without a message each."""

import mmap
import os
import threading
from collections.abc import Callable

#: How often (s) a worker's heart beats.
INTERVAL = 0.5
_SIZE = 8
_NUMBERS = 3


class WorkerStatus:
    """Three numbers a socket in shared memory: its time (s), the time (s) whose passing it is to report, its heartbeats."""

    def __init__(self, descriptor: int, sockets: int) -> None:
        self._map = mmap.mmap(descriptor, _NUMBERS * sockets * _SIZE)
        self._view = memoryview(self._map).cast("d")
        self._sockets = sockets

    @classmethod
    def create(cls, sockets: int) -> "tuple[WorkerStatus, int]":
        """Return new memory, and the file descriptor by which another process gets at it."""
        descriptor = os.memfd_create("motorbench-times")
        os.ftruncate(descriptor, _NUMBERS * sockets * _SIZE)
        return cls(descriptor, sockets), descriptor

    def reached(self, socket: int) -> float:
        """Return a socket's time."""
        return self._view[socket]

    def reach(self, socket: int, time: float) -> None:
        """Set a socket's time."""
        self._view[socket] = time

    def awaited(self, socket: int) -> float:
        """Return the time whose passing a socket is to report; 0 for none."""
        return self._view[self._sockets + socket]

    def wait_for(self, socket: int, time: float) -> None:
        """Request a report from a socket when it has passed a time; 0 for none."""
        self._view[self._sockets + socket] = time

    def beats(self, socket: int) -> int:
        """Return how many heartbeats a socket's worker has given."""
        return int(self._view[2 * self._sockets + socket])

    def beat(self, socket: int, number: int) -> None:
        """Give the heartbeat of this number; 0 before a worker's first."""
        self._view[2 * self._sockets + socket] = number

    def close(self) -> None:
        """Release the memory."""
        self._view.release()
        self._map.close()


def give_heartbeats(status: WorkerStatus, socket: int, stuck: Callable[[], bool]) -> None:
    """Give heartbeats from a thread of its own until this process ends or freezes; none while it is `stuck`."""

    def beat() -> None:
        number, pause = 0, threading.Event()
        while True:
            if not stuck():
                number += 1
                status.beat(socket, number)
            pause.wait(INTERVAL)

    threading.Thread(target=beat, name="heartbeat", daemon=True).start()


class Heartbeat:
    """The coordinator's knowledge of one worker's heartbeat: for how long (s) it has been `silent`."""

    def __init__(self) -> None:
        self._beats = 0
        self.silent = 0.0

    def observe(self, beats: int, passed: float) -> None:
        """Take the number of beats so far, and the time (s) since it was last taken. Before the first there is no silence."""
        self.silent = self.silent + passed if beats and beats == self._beats else 0.0
        self._beats = beats
