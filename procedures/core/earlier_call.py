"""Calls to instruments in earlier sessions of a run, for a procedure that continues where it stopped."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class EarlierCall:
    """A call to the instrument of a role, with its arguments and its result as in the journal (None if there was none)."""

    role: str
    call: str
    arguments: Sequence[Any] = ()
    value: Any = None


#: What one attempt at a procedure did, in order.
EarlierAttempt = Sequence[EarlierCall]
