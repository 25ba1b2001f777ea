"""Signs of life: a worker gives them as long as it gets on, and the coordinator counts how long they stay away."""

import threading
from collections.abc import Callable

from bench.eol.line.times import Times

#: How often (s) a worker gives one.
INTERVAL = 0.5


def give_signs(times: Times, socket: int, stuck: Callable[[], bool]) -> None:
    """Give signs of life from a thread of its own until this process ends or freezes; none while it is `stuck`."""

    def beat() -> None:
        number, pause = 0, threading.Event()
        while True:
            if not stuck():
                number += 1
                times.beat(socket, number)
            pause.wait(INTERVAL)

    threading.Thread(target=beat, name="pulse", daemon=True).start()


class Pulse:
    """What the coordinator knows of one worker's signs: for how long (s) there has been no new one."""

    def __init__(self) -> None:
        self._beats = 0
        self.silent = 0.0

    def look(self, beats: int, passed: float) -> None:
        """Take how many signs there have been, and the time (s) since the last look. Before the first there is no silence."""
        self.silent = self.silent + passed if beats and beats == self._beats else 0.0
        self._beats = beats
