"""Work for tests: it squares, and may end the process that does it."""

import os
import signal
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from bench.distribution.work import Task


@dataclass(frozen=True)
class Squares:
    """Squares a number. Whoever gets the number `deadly` is killed, as long as `mark` is not there; it is left there then."""

    deadly: int = -1
    mark: str = ""

    def begin(self) -> Callable[[Task], int]:
        """Return what squares."""
        return self._square

    def _square(self, task: Task) -> int:
        (number,) = task
        if number == self.deadly and not (self.mark and Path(self.mark).exists()):
            if self.mark:
                Path(self.mark).touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return number * number
