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
    """The selected part of a capture, the limits of error of its channels, and the form of the output.

    Parameters
    ----------
    from_
        Start of the part to analyze, s, in the file's own time.
    to
        End of the part to analyze, s.
    time_column
        The time column of a plain table, by its name or its number from 1. Default: the first column.
    time_unit
        Unit of that column, if its heading states none.
    accuracy
        Limits of error, NAME=LIMITS, as in CH1=2%+5mV. NAME is a channel, or a kind for all its channels: voltage, current,
        speed, torque, inductance, time.
    accuracy_file
        TOML file with the same statements. The command line overrides it.
    budget
        Print the uncertainty budget of every parameter. JSON output always contains the budgets.
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
        """The translation into the reader's language."""
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
