"""What instruments did in earlier sessions of a run, for a procedure that goes on where it was left."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class EarlierCall:
    """A call to the instrument of a role, with its arguments, and what it gave as the journal has it: None where nothing."""

    role: str
    call: str
    arguments: Sequence[Any] = ()
    value: Any = None


#: What one attempt at a procedure did, in order.
EarlierAttempt = Sequence[EarlierCall]
