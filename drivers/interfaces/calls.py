"""Supervises the calls to an instrument: whether a call may begin, and how long its reply may take."""

from contextlib import AbstractContextManager, nullcontext
from typing import Protocol

_NOTHING = nullcontext()


class Calls(Protocol):
    """The calls of a driver before and after each exchange with its instrument."""

    @property
    def patience(self) -> float | None:
        """The longest time (s) until the next reply; None if the transport's own time-out applies."""

    def exchange(self, *, interruptible: bool = False) -> AbstractContextManager[None]:
        """Within the block a command is sent and its reply awaited; left without an error, the instrument has answered.

        An `interruptible` one may be broken off at any of its steps without harm to the transport.
        Raises what ends the run, before anything is sent, where a stop was requested.
        """

    def making_safe(self) -> AbstractContextManager[None]:
        """Within the block commands only switch off, and a requested stop does not keep them from being sent."""


class Unwatched:
    """No supervision."""

    patience: float | None = None

    def exchange(self, *, interruptible: bool = False) -> AbstractContextManager[None]:
        """Do nothing."""
        return _NOTHING

    def making_safe(self) -> AbstractContextManager[None]:
        """Do nothing."""
        return _NOTHING


UNWATCHED: Calls = Unwatched()
