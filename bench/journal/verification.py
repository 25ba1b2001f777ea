"""Result of verifying that a run is unchanged."""

from dataclasses import dataclass, field
from enum import Enum

from drivers.interfaces.text import Text, lines, text


class Integrity(Enum):
    """Result of the verification of a run: unchanged, unchanged without a verified end, or changed."""

    UNTOUCHED = "untouched"
    UNFINISHED = "unfinished"
    CHANGED = "changed"


@dataclass(frozen=True)
class RecordFault:
    """One change found: the file by its path from the run's folder, its line (0 for none), what is wrong."""

    file: str
    line: int
    what: Text

    @property
    def words(self) -> Text:
        """The whole in a sentence."""
        if self.line:
            return text("{file}, line {line}: {what}", file=self.file, line=self.line, what=self.what)
        return text("{place}: {said}", place=self.file, said=self.what)

    def __str__(self) -> str:
        return str(self.words)


@dataclass
class Verification:
    """Findings of a verification: whole events, the last one's hash, the waveform files compared, every finding.

    `doubts` say what is not vouched for, and why.
    """

    events: int = 0
    last_hash: str = ""
    waveforms: int = 0
    findings: list[RecordFault] = field(default_factory=list)
    doubts: list[Text] = field(default_factory=list)

    @property
    def unproven(self) -> str:
        """The doubts about the record, in English; empty if there are none."""
        return str(lines(self.doubts, between="; "))

    @property
    def verdict(self) -> Integrity:
        """The whole in a word."""
        if self.findings:
            return Integrity.CHANGED
        return Integrity.UNFINISHED if self.doubts else Integrity.UNTOUCHED

    def doubt(self, why: Text) -> None:
        """Add why something is not vouched for."""
        self.doubts.append(why)
