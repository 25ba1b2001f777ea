"""Where a guardian's own record is held by the run's journal: at its beginning, and where it ends."""

from collections.abc import Mapping
from typing import Any

from procedures.core.bench import Recorder


class RecordAnchor:
    """Knows how far the guardian's record reaches, as the guardian said last, and puts that into the journal.

    `token` stands in both records, so that one cannot be taken for another run's.
    """

    def __init__(self, token: str) -> None:
        self._token = token
        self._journal: Recorder | None = None
        self._head: Mapping[str, Any] | None = None
        self._begun = self._closed = False

    def record_in(self, journal: Recorder) -> None:
        """Have the beginning written into this journal."""
        self._journal = journal

    def hear(self, message: Mapping[str, Any]) -> None:
        """Take what the guardian says: number and hash of its record's last event are in some of its messages."""
        if "record" in message:
            self._head = message["record"]
            self._closed = "left" in message

    def begin(self) -> None:
        """Write down how the guardian's record begins, once; it is ready then and has said so."""
        if self._begun or self._journal is None or self._head is None:
            return
        self._begun = True
        self._journal.event("guardian_ready", record=dict(self._head))

    def about(self) -> dict[str, Any]:
        """Return what the run's first event says of it."""
        return {"token": self._token}

    def end(self) -> dict[str, Any]:
        """Return what the run's last event says of it; `closed` is false where the guardian did not tell its record's end."""
        return {"record": dict(self._head or {"events": 0, "sha256": ""}), "closed": self._closed}
