"""Options that every command for a capture takes."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from bench.cli.analyze.output import print_analysis
from bench.i18n.language import language_of, translator
from drivers.interfaces.text import Translate

if TYPE_CHECKING:
    from bench.captures import CapturePart


@Parameter(name="*")
@dataclass(frozen=True)
class RecordOptions:
    """Which part of a capture is taken, how far its channels may err, and how the outcome is printed.

    Parameters
    ----------
    from_
        First instant of the record to take, s, of the file's own time.
    to
        Last instant of the record to take, s.
    time_column
        Column of the time in a plain table, by its name or its number from 1, where it is not the first.
    time_unit
        Unit of that column, where its heading says none.
    accuracy
        Limits of error, NAME=LIMITS, as in CH1=2%+5mV; a channel's name, or for all of a kind: voltage, current, speed, torque,
        inductance, time.
    accuracy_file
        TOML file with the same; what is on the command line overrules it.
    budget
        Print every parameter's uncertainty budget; JSON always holds them.
    language
        en, zh, or auto by the locale.
    json
        Print one JSON object and nothing else.

    """

    from_: Annotated[float | None, Parameter(name="--from")] = None
    to: float | None = None
    time_column: str | None = None
    time_unit: Literal["s", "ms", "us", "ns"] | None = None
    accuracy: Sequence[str] = ()
    accuracy_file: Path | None = None
    budget: bool = False
    language: str = "auto"
    json: bool = False

    @property
    def translate(self) -> Translate:
        """What translates into the reader's language."""
        return translator(language_of(self.language))

    @property
    def selection(self) -> "CapturePart":
        """The part of the capture that is taken."""
        from bench.captures import CapturePart

        return CapturePart(self.from_, self.to, self.time_column, self.time_unit)

    def statements(self, full_scale: Sequence[str] = ()) -> Any:
        """Return the limits of error, with the ranges that channels were set to."""
        from bench.analysis import read_statements

        return read_statements(self.accuracy, self.accuracy_file, full_scale)

    def print(self, outcome: Any) -> int:
        """Print the outcome of an analysis, and return the exit status."""
        return print_analysis(outcome, self.translate, json=self.json, budget=self.budget)
