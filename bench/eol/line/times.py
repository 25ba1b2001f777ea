"""The sockets' times and signs of life, written by their workers and read by the coordinator without a message each."""

import mmap
import os

_SIZE = 8
_NUMBERS = 3


class Times:
    """Three numbers a socket in memory that several processes share: its time (s), the time (s) it is to tell of, its beats."""

    def __init__(self, descriptor: int, sockets: int) -> None:
        self._map = mmap.mmap(descriptor, _NUMBERS * sockets * _SIZE)
        self._view = memoryview(self._map).cast("d")
        self._sockets = sockets

    @classmethod
    def made(cls, sockets: int) -> "tuple[Times, int]":
        """Return new ones, and the file descriptor by which another process gets at them."""
        descriptor = os.memfd_create("motorbench-times")
        os.ftruncate(descriptor, _NUMBERS * sockets * _SIZE)
        return cls(descriptor, sockets), descriptor

    def reached(self, socket: int) -> float:
        """Return a socket's time."""
        return self._view[socket]

    def reach(self, socket: int, time: float) -> None:
        """Say what a socket's time is."""
        self._view[socket] = time

    def awaited(self, socket: int) -> float:
        """Return the time that a socket is to tell of when it has passed it; 0 for none."""
        return self._view[self._sockets + socket]

    def wait_for(self, socket: int, time: float) -> None:
        """Have a socket tell when it has passed a time; 0 for none."""
        self._view[self._sockets + socket] = time

    def beats(self, socket: int) -> int:
        """Return how many signs of life a socket's worker has given."""
        return int(self._view[2 * self._sockets + socket])

    def beat(self, socket: int, number: int) -> None:
        """Give a sign of life, of this number; 0 before a worker's first."""
        self._view[2 * self._sockets + socket] = number

    def close(self) -> None:
        """Let go of the memory."""
        self._view.release()
        self._map.close()
