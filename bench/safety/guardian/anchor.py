"""Hashes of a guardian's own record in the run's journal: of its beginning and of its end."""

from collections.abc import Mapping
from typing import Any

from bench.journal.events.safety import GuardianEnd, GuardianReady, RecordEnd
from procedures.core.bench import Recorder


class RecordAnchor:
    """Keeps the end of the guardian's record as last reported, and writes it into the journal."""

    def __init__(self) -> None:
        self._journal: Recorder | None = None
        self._head: RecordEnd | None = None
        self._begun = self._closed = False

    def record_in(self, journal: Recorder) -> None:
        """Set the journal that the beginning is written into."""
        self._journal = journal

    def hear(self, message: Mapping[str, Any]) -> None:
        """Take what the guardian says: number and hash of its record's last event are in some of its messages."""
        if "record" in message:
            self._head = RecordEnd(**message["record"])
            self._closed = "left" in message

    def begin(self) -> None:
        """Write down how the guardian's record begins, once; it is ready then and has said so."""
        if self._begun or self._journal is None or self._head is None:
            return
        self._begun = True
        self._journal.record(GuardianReady(record=self._head))

    def end(self) -> GuardianEnd:
        """Return what the run's last event says of it; `closed` is false where the guardian did not tell its record's end."""
        return GuardianEnd(self._head or RecordEnd(0, ""), self._closed)
