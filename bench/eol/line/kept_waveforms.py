"""Which waveforms of a motor stay, as its plan has it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bench.eol.plan import KeepWaveforms
from bench.eol.verdict import Verdict
from bench.journal.recording import WaveformSink
from bench.journal.waveforms import LateWaveforms, NoWaveforms, WaveformFolder


class KeptWaveforms:
    """One motor's: gives the run its sink, hears the journal, and in the end has each file's SHA-256."""

    def __init__(self, keep: KeepWaveforms) -> None:
        self._keep = keep
        self._late: LateWaveforms | None = None
        self._files: dict[str, str] = {}

    def sink(self, folder: Path) -> WaveformSink:
        """Return where a run's samples go."""
        if self._keep == "all":
            return WaveformFolder(folder)
        if self._keep == "none":
            return NoWaveforms()
        self._late = LateWaveforms(folder)
        return self._late

    def hear(self, kind: str, data: Mapping[str, Any]) -> None:
        """Note what was written at once."""
        if kind == "waveforms" and data["file"]["sha256"]:
            self._files[data["file"]["path"]] = data["file"]["sha256"]

    def of(self, verdict: Verdict) -> Mapping[str, str]:
        """Return the files of a motor with this verdict, by path; those that were held until now are written. Raises RecordError."""
        if self._late is not None and verdict is not Verdict.PASS:
            self._files |= {stored.path: stored.sha256 for stored in self._late.write()}
        return self._files
