"""One attempt at a procedure, and what a run does after it."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from bench.i18n.errors import NOTHING
from bench.run.plan import Planned
from drivers.interfaces.text import Text
from procedures.core.result import ProcedureResult


class Next(Enum):
    """Continuation after an attempt."""

    GO_ON = "go_on"
    STOP = "stop"
    AGAIN = "again"


@dataclass(frozen=True)
class Attempt:
    """A planned procedure with its result, or with its error in the run's language and for any language.

    `started` and `ended` are bench time (s), the wait for instruments that others used left out.
    """

    planned: Planned
    started: float
    ended: float
    result: ProcedureResult | None = None
    error: Exception | SystemExit | None = None
    cause: str = ""
    told: Text = NOTHING


#: Decides what follows.
After = Callable[[Attempt], Next]


def stop_at_failure(attempt: Attempt) -> Next:
    """End the run with the first procedure that fails."""
    return Next.GO_ON if attempt.error is None else Next.STOP


def never_stop(_: Attempt) -> Next:
    """Go on with the next procedure where one fails."""
    return Next.GO_ON
