"""The waiting records of a station, and the reasons: for the terminal, the line's page and the end of a batch."""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime

from bench.eol.store.forwarding import Refusal
from drivers.interfaces.text import Text, text


@dataclass(frozen=True)
class ForwardingProblem:
    """The reason why records are not where they belong, and its beginning (UTC)."""

    why: Text
    since: datetime


@dataclass(frozen=True)
class Waiting:
    """The number of records that wait for the server, the number that are in no database (None if that is unknown), and the
    reasons.

    `next_try` is when it is tried again (UTC); `refused` are records that a database refuses for what is in them.
    """

    for_server: int = 0
    unstored: int | None = 0
    troubles: tuple[ForwardingProblem, ...] = ()
    next_try: datetime | None = None
    refused: tuple[Refusal, ...] = ()

    @property
    def anything(self) -> bool:
        """Return whether anything waits, or would."""
        return bool(self.for_server or self.unstored or self.unstored is None or self.troubles or self.refused)

    def sentences(self) -> Iterator[Text]:
        """Say what waits, since when, why, and when it is tried again."""
        if self.for_server:
            yield text("records that wait for the server: {number}", number=self.for_server)
        if self.unstored is None:
            yield text("the number of records that are in no database is not known: their folder cannot be read")
        elif self.unstored:
            yield text("records that are in no database yet, kept in files: {number}", number=self.unstored)
        for trouble in self.troubles:
            yield text("since {time}: {why}", time=_local(trouble.since), why=trouble.why)
        if self.next_try is not None and self.troubles:
            yield text("the next try is at {time}", time=_local(self.next_try))
        for refusal in self.refused:
            yield refusal.words


def _local(time: datetime) -> str:
    return time.astimezone().strftime("%H:%M:%S")
