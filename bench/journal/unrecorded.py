"""A record that keeps nothing, for instruments that are only asked who they are."""

import hashlib
from collections.abc import Mapping

from bench.journal.waveforms import StoredRecord
from drivers.interfaces import Waveform
from procedures.core.events import Event


class Unrecorded:
    """Takes events and waveforms and keeps none."""

    def record(self, event: Event) -> None:
        """Pass by."""

    def store(self, name: str, waveforms: Mapping[str, Waveform]) -> StoredRecord:
        """Pass by."""
        return StoredRecord(name, hashlib.sha256().hexdigest(), 0)
