"""What comes of looking at whether a run is as it was written."""

from dataclasses import dataclass, field
from enum import Enum


class Integrity(Enum):
    """What became of a run: all as it was written, as it was written but without a proven end, or changed afterwards."""

    UNTOUCHED = "untouched"
    UNFINISHED = "unfinished"
    CHANGED = "changed"


@dataclass(frozen=True)
class RecordFault:
    """One thing that is not as it was written: the file from the run's folder, its line (0 for none), what is wrong."""

    file: str
    line: int
    what: str

    def __str__(self) -> str:
        return f"{self.file}{f', line {self.line}' if self.line else ''}: {self.what}"


@dataclass
class Verification:
    """What was found: whole events, the last one's hash, the waveform files compared, every finding.

    `unproven` says what is not vouched for, and why.
    """

    events: int = 0
    last_hash: str = ""
    waveforms: int = 0
    findings: list[RecordFault] = field(default_factory=list)
    unproven: str = ""

    @property
    def verdict(self) -> Integrity:
        """The whole in a word."""
        if self.findings:
            return Integrity.CHANGED
        return Integrity.UNFINISHED if self.unproven else Integrity.UNTOUCHED

    def doubt(self, why: str) -> None:
        """Add why something is not vouched for."""
        self.unproven = f"{self.unproven}; {why}" if self.unproven else why
