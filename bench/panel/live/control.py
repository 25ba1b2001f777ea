"""Control of the panel: one person leads at a time, all others watch."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Leader:
    """The person in control: the browser's session, and the name that is shown."""

    session: str
    name: str


@dataclass
class Control:
    """Hands the control from one session to the next; `changes` grows with every hand-over."""

    leader: Leader | None = None
    changes: int = field(default=0)

    def holds(self, session: str) -> bool:
        """Tell whether this session leads."""
        return self.leader is not None and self.leader.session == session

    def take(self, session: str, name: str) -> None:
        """Take the control, from whoever has it."""
        self.leader = Leader(session, name)
        self.changes += 1

    def take_if_free(self, session: str, name: str) -> bool:
        """Take the control where nobody has it; tell whether this session leads now."""
        if self.leader is None:
            self.take(session, name)
        return self.holds(session)

    def release(self, session: str) -> None:
        """Release the control if this session has it."""
        if self.holds(session):
            self.leader = None
            self.changes += 1
