"""Options that several commands for captures take."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from bench.cli.analyze.output import print_analysis
from bench.cli.analyze.typed import factors_of
from bench.cli.options import Json, Language
from bench.i18n.errors import UsageError
from bench.i18n.language import language_of, translator
from drivers.interfaces.text import Translate, text

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

    """

    from_: Annotated[float | None, Parameter(name="--from")] = None
    to: float | None = None
    time_column: str | None = None
    time_unit: Literal["s", "ms", "us", "ns"] | None = None
    accuracy: Sequence[str] = ()
    accuracy_file: Path | None = None
    budget: bool = False
    language: Language = "auto"
    json: Json = False

    @property
    def translate(self) -> Translate:
        """The translation into the reader's language."""
        return translator(language_of(self.language))

    @property
    def selection(self) -> "CapturePart":
        """The part of the capture that is taken."""
        from bench.captures import CapturePart

        return CapturePart(self.from_, self.to, self.time_column, self.time_unit)

    def arguments(self, full_scale: Sequence[str] = ()) -> dict[str, Any]:
        """Return what every analysis takes: part, limits of error with the ranges that channels were set to, and language."""
        from bench.analysis import read_statements

        accuracy = read_statements(self.accuracy, self.accuracy_file, full_scale)
        return {"accuracy": accuracy, "selection": self.selection, "translate": self.translate}

    def print(self, outcome: Any) -> int:
        """Print the outcome of an analysis, and return the exit status."""
        return print_analysis(outcome, self.translate, json=self.json, budget=self.budget)


@Parameter(name="*")
@dataclass(frozen=True)
class LoopOptions:
    """A loop of windings: how they are joined, its channels and its temperature.

    Parameters
    ----------
    connection
        How the windings are joined.
    voltage
        Name of the voltage channel, if its unit does not identify it.
    current
        Name of the current's channel.
    scale
        Factor for a channel, NAME=FACTOR.
    temperature
        Temperature of the winding, °C. The resistance is then referred to 25 °C.
    temperature_uncertainty
        Half-width of the range within which this temperature is known, K. Default: 2.
    copper_coefficient
        Temperature coefficient of the winding's resistance at 20 °C, 1/K.
    full_scale
        Range that a channel was set to (the whole screen), NAME=RANGE, as in CH1=40V. It is needed for limits in % of full
        scale.

    """

    connection: Literal["wye", "delta"] = "wye"
    voltage: str | None = None
    current: str | None = None
    scale: Sequence[str] = ()
    temperature: float | None = None
    temperature_uncertainty: float | None = None
    copper_coefficient: float = 0.00393
    full_scale: Sequence[str] = ()

    def arguments(self, record: RecordOptions) -> dict[str, Any]:
        """Return what an analysis of a loop takes, with what every one takes. Raises UsageError."""
        from bench.analysis.temperature import copper_temperature

        return {
            "connection": self.connection,
            "voltage": self.voltage,
            "current": self.current,
            "scale": factors_of(self.scale),
            **record.arguments(self.full_scale),
            "temperature": copper_temperature(self.temperature, self.temperature_uncertainty, self.copper_coefficient),
        }


def some(files: Sequence[Path]) -> Sequence[Path]:
    """Return files of which there is one at least. Raises UsageError for none."""
    if not files:
        raise UsageError(text("name at least one file"))
    return files
