"""The common part of every described fault: its beginning and its end."""

import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

if TYPE_CHECKING:
    from sim_instruments.faults.target import FaultTarget

Mend = Callable[[], None]
#: The longest time (s) that anybody waits for.
_LONGEST = 1e6
Seconds = Annotated[float, Field(ge=0.0, le=_LONGEST, json_schema_extra={"unit": "s"})]
Count = Annotated[int, Field(ge=1, le=1_000_000)]
#: The same where it may be left out.
MaybeSeconds = Annotated[float | None, Field(ge=0.0, le=_LONGEST, json_schema_extra={"unit": "s"})]
MaybeCount = Annotated[int | None, Field(ge=1, le=1_000_000)]


@dataclass(frozen=True)
class ActiveFault:
    """A fault that is there: what mends it, and whether anything has felt it yet."""

    mend: Mend
    was_felt: Callable[[], bool] = lambda: True


def pattern_checked(pattern: str | None) -> str | None:
    """Return a regular expression as it is. Raises ValueError for one that is none, or whose meaning is going to change."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            re.compile(pattern or "")
    except (re.error, Warning, OverflowError, RecursionError) as error:
        raise ValueError(f"{pattern!r} is no regular expression: {error}") from error
    return pattern


class Strict(BaseModel):
    """Base of what is described: unknown keys, wrong types and NaN are refused."""

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid", allow_inf_nan=False)


class MessageCondition(Strict):
    """A message to an instrument: the `count`-th from now on, or the first in which `pattern` is found."""

    role: str
    pattern: str | None = None
    count: MaybeCount = None

    @field_validator("pattern")
    @classmethod
    def _compiles(cls, pattern: str | None) -> str | None:
        return pattern_checked(pattern)

    @model_validator(mode="after")
    def _one(self) -> "MessageCondition":
        if (self.pattern is None) == (self.count is None):
            raise ValueError("give either pattern or count of the message, one of the two")
        return self


class Description(Strict):
    """A fault and when it is there.

    It begins `after` s from now, or from a bench time `at` (s), from the `occurrence`-th start of a `step` (of a
    `procedure`, where several have it), or from a `message`; it mends after `duration` s, or never.
    """

    fault: str
    at: MaybeSeconds = None
    step: Annotated[str | None, Field(min_length=1, description="a step's identifier like '3.2.2/3'")] = None
    procedure: Annotated[str | None, Field(min_length=1, description="a procedure's name")] = None
    occurrence: Count = 1
    message: MessageCondition | None = None
    after: Seconds = 0.0
    duration: MaybeSeconds = None

    @model_validator(mode="after")
    def _begins(self) -> "Description":
        given = [name for name in ("at", "step", "message") if getattr(self, name) is not None]
        if len(given) > 1:
            raise ValueError(f"{' and '.join(given)} are both given: a fault begins by one of at, step, message")
        for name in ("procedure", "occurrence"):
            if name in self.model_fields_set and self.step is None:
                raise ValueError(f"{name} belongs to step, which is not given")
        return self

    @property
    def timed(self) -> bool:
        """True if a beginning or an end is stated."""
        return bool(self.model_fields_set & {"at", "step", "message", "after", "duration"})

    def check(self, bench: "FaultTarget") -> None:
        """Raise ValueError where this bench cannot have the fault."""
        if self.message is not None:
            bench.faults(self.message.role)

    def begin(self, bench: "FaultTarget") -> ActiveFault:
        """Bring it onto the bench."""
        raise NotImplementedError

    def told(self) -> dict[str, Any]:
        """Return it as it was given."""
        return self.model_dump(exclude_unset=True)
