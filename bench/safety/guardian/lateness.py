"""Delays on a busy computer, of the guardian's own process and of the run's: heartbeats are delayed with them."""

from collections import deque
from contextlib import suppress
from pathlib import Path

#: Wakers are late by as much (s) on an idle computer.
_USUAL = 0.01


class Lateness:
    """Remembers by how much the guardian woke up after its time, over the last `window` seconds."""

    def __init__(self, window: float) -> None:
        self._window = window
        self._late: deque[tuple[float, float]] = deque()

    def woke(self, planned: float, now: float) -> None:
        """Note a wait that was planned to end at a time and ended now (s, monotonic), with nothing heard in between."""
        if now - planned > _USUAL:
            self._late.append((now, now - planned))

    def allowance(self, now: float) -> float:
        """Return the longest delay of the window (s), no more than the window itself."""
        while self._late and self._late[0][0] < now - self._window:
            self._late.popleft()
        return min(max((delay for _, delay in self._late), default=0.0), self._window)


class RunQueue:
    """Time (s) that the threads of a process were ready to run and had no processor, as Linux counts it (proc(5), schedstat).

    A guardian in a session or control group of its own gets its share of a processor that the run's group has used up, so its own
    lateness does not show the run's. A process that is stopped, or that waits for a disk, is not ready: nothing is counted for it.
    """

    def __init__(self, pid: int, processes: Path = Path("/proc")) -> None:
        self._tasks = processes / str(pid) / "task"
        self._noted = self._delays()

    def note(self) -> None:
        """Count from here on."""
        self._noted = self._delays()

    def waited(self) -> float:
        """Return the time (s) since the last note, of all threads together; 0 where the system does not count it."""
        delays = self._delays()
        return sum(delay - self._noted.get(task, delay) for task, delay in delays.items()) * 1e-9

    def _delays(self) -> dict[str, int]:
        delays = {}
        # Threads come and go meanwhile.
        with suppress(OSError):
            for task in self._tasks.iterdir():
                with suppress(OSError, ValueError, IndexError):
                    delays[task.name] = int((task / "schedstat").read_text().split()[1])
        return delays
