"""One trial: what was done to a run, and what became of it."""

import re
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

#: Off within this (s) of the first call that was not answered, or of what ended the run where none was.
PROMISED = 1.0
#: A run that has not ended this (s) after its end was wanted hangs.
PATIENCE = 45.0
_FAULT = re.compile(r"^(?:[a-z-]+: )?(?!Interrupted)[A-Z]\w*(?:Error|Exception|Warning): ", re.MULTILINE)
#: What Python prints of an exception that landed where nobody can catch it; the stop logic is to bear that.
_UNRAISABLE = re.compile(r"^Exception ignored .*?^\S*Interrupted: [^\n]*$\n?", re.MULTILINE | re.DOTALL)


@dataclass
class Trial:
    """What was done (`kind`, `case`), and what was found; times in s."""

    kind: str
    case: str
    #: Whether the bench had something energised at the moment of the disturbance.
    energised: bool = False
    #: From the disturbance until all was off, and the longest that a call was left without an answer before that.
    off_after: float = 0.0
    unanswered: float | None = None
    #: Whether the run bore the disturbance, so that `off_after` counts from the signal that it then got.
    borne: bool = False
    promised: float = PROMISED
    #: Why nothing can switch everything off, where all processes of the computer died; what was left on then.
    without_computer: str = ""
    #: Why starts before this one failed, before anything was done.
    refused: tuple[str, ...] = ()
    missing: int = 0
    then: str = ""
    resumed: str = ""
    #: What is otherwise than it must be, in words.
    faults: list[str] = field(default_factory=list)
    #: For how long (s) a thread of run, guardian or bench was runnable and got no processor until all was off.
    starved: float = 0.0
    #: The longest time (s) between two looks of the study at the bench until all was off.
    looked_late: float = 0.0
    kept: str = ""

    @property
    def by_load(self) -> bool:
        """Whether it was late by no more than a process waited for a processor or the study did not look."""
        return self.late and self.off - max(self.starved, self.looked_late) <= self.promised

    @property
    def off(self) -> float:
        """How long it took (s), counted as promised: from the first call without an answer where there was one."""
        if self.unanswered is None:
            return self.off_after
        return max(self.unanswered, self.off_after) if self.borne else self.unanswered

    @property
    def late(self) -> bool:
        """Whether that is longer than promised."""
        return self.energised and not self.without_computer and self.off > self.promised

    @property
    def good(self) -> bool:
        """Whether every promise was kept."""
        return not (self.late or self.missing or self.faults)

    def judge_cause(self, cause: str) -> None:
        """Take a run's cause for its end, which must not be a fault of the program."""
        if found := _FAULT.search(cause):
            self.faults.append(f"a fault of the program: {cause[found.start() :][:200]}")

    def judge_stderr(self, said: str) -> None:
        """Take what the processes said on standard error, where no trace may stand."""
        left = _UNRAISABLE.sub("", said)
        if "Traceback (most recent call last)" in left or "Exception ignored" in left:
            self.faults.append("a traceback on standard error")


class Queues:
    """For how long threads of some processes were runnable and got no processor, from now on (Linux' schedstat)."""

    def __init__(self, pids: Iterable[int]) -> None:
        self._pids = tuple(pids)
        self._before = self._waits()

    def longest(self) -> float:
        """Return the longest that one of them waited for a processor (s)."""
        return max((wait - self._before.get(task, 0.0) for task, wait in self._waits().items()), default=0.0)

    def _waits(self) -> dict[str, float]:
        found = {}
        for pid in self._pids:
            for path in Path("/proc").glob(f"{pid}/task/*/schedstat"):
                with suppress(OSError):
                    found[path.parent.name] = int(path.read_text(encoding="ascii").split()[1]) / 1e9
        return found
