"""The cable of an instrument, plugged in or not."""

from collections.abc import Callable
from typing import Protocol

from sim_instruments.faults.line_faults import Faults


class Connection:
    """The cable of one instrument: while it is out nothing gets through, and what was connected before stays cut off."""

    def __init__(self) -> None:
        #: How often it has been pulled out; who connected at another count has lost the connection.
        self.pulled = 0
        self._up = True
        self._listeners: list[Callable[[bool], None]] = []

    @property
    def up(self) -> bool:
        """True if it is plugged in."""
        return self._up

    def listen(self, listener: Callable[[bool], None]) -> None:
        """Call `listener(up)` at every change."""
        self._listeners.append(listener)

    def pull(self) -> None:
        """Pull it out; again is allowed."""
        if self._up:
            self._up = False
            self.pulled += 1
            self._tell()

    def plug(self) -> None:
        """Plug it in; again is allowed."""
        if not self._up:
            self._up = True
            self._tell()

    def _tell(self) -> None:
        for listener in tuple(self._listeners):
            listener(self._up)


class Line(Protocol):
    """A line with messages that faults can strike, and a cable."""

    @property
    def faults(self) -> Faults:
        """Return the faults of its messages."""

    @property
    def connection(self) -> Connection:
        """Return its cable."""
