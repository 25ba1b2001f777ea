"""A motor's tests for a page: what the records say of one serial number, and what changed from a test to the next."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote, urlencode

from bench.i18n.errors import InputError
from drivers.interfaces.text import Text, text, text_of
from reports.labels import ParameterLabels

if TYPE_CHECKING:
    from bench.eol.record import MeasuredFigure, MotorRecord

#: What a test says of itself that may be another at the next one, by the record's fields.
_CIRCUMSTANCES = (
    ("station", text("Station")),
    ("socket", text("Socket")),
    ("plan", text("Plan")),
    ("model", text("Motor type")),
    ("person", text("Operator")),
)


@dataclass(frozen=True)
class MotorTests:
    """A motor's tests, the latest first, and what readers call their parameters; `fault` says why there are none."""

    serial_number: str
    tests: tuple["MotorRecord", ...] = ()
    labels: ParameterLabels = field(default_factory=lambda: ParameterLabels({}))
    fault: Text | None = None


@dataclass(frozen=True)
class FigurePair:
    """A figure of two tests of one motor, None in the one that has it not; `beyond` tells whether it differs by more than both know it."""

    parameter: str
    before: "MeasuredFigure | None"
    now: "MeasuredFigure | None"

    @property
    def difference(self) -> float | None:
        """By how much the later one is larger, in its unit."""
        if self.before is None or self.now is None or self.before.unit != self.now.unit:
            return None
        difference = self.now.value - self.before.value
        return difference if math.isfinite(difference) else None

    @property
    def beyond(self) -> bool:
        """True if the expanded uncertainties of both do not explain the difference."""
        if self.difference is None or self.before is None or self.now is None:
            return False
        # The records' modules load a database's library, which a panel without a line need not have.
        from bench.eol.retest import differs

        return differs(self.before, self.now)


def motor_address(serial_number: str) -> str:
    """Return the address of the page of a motor's tests."""
    return f"/motors?{urlencode({'serial_number': serial_number})}"


def run_address(test: "MotorRecord", runs: Path) -> str | None:
    """Return the address of a run's page; None where it is not below the panel's runs, or no longer there."""
    from bench.eol.archive.run_among import run_among

    places = (run_among(runs, test), Path(test.run)) if test.run else ()
    folder = next((place for place in places if place.is_dir()), None)
    if folder is None:
        return None
    try:
        name = folder.resolve().relative_to(runs.resolve())
    except ValueError:
        return None
    return f"/runs/{quote(name.as_posix())}"


def read_motor(reference: str, serial_number: str) -> MotorTests:
    """Return what a database's records say of a serial number. Takes its time: not for an event loop."""
    # The database's library takes a second to load, which a panel without a line need not spend.
    from sqlalchemy.exc import SQLAlchemyError

    from bench.eol.line_statistics import parameter_labels
    from bench.eol.store.database import NoDatabaseError, open_for_reading, using
    from bench.eol.store.records import Records

    try:
        with using(open_for_reading(reference)) as engine:
            tests = tuple(reversed(Records(engine).of_motor(serial_number)))
            labels = parameter_labels(engine)
    except NoDatabaseError:
        return MotorTests(serial_number, fault=text("There are no records at {records} yet.", records=reference))
    except (InputError, SQLAlchemyError, OSError) as error:
        # What a database says of itself stays as it is.
        own = getattr(error, "orig", None)
        message = text_of(error) if own is None else " ".join(str(own).split())
        return MotorTests(serial_number, fault=text("The records cannot be read: {error}", error=message))
    fault = None if tests else text("There is no record of the serial number {serial}.", serial=serial_number)
    return MotorTests(serial_number, tests, labels, fault)


def changed_figures(before: "MotorRecord", now: "MotorRecord") -> list[FigurePair]:
    """Return the figures of two tests: those first that changed beyond their uncertainty, then as the later test has them."""
    earlier = {each.parameter: each for each in before.measured}
    later = {each.parameter: each for each in now.measured}
    pairs = [FigurePair(name, earlier.get(name), later.get(name)) for name in {**later, **earlier}]
    return sorted(pairs, key=lambda pair: not pair.beyond)


def changed_circumstances(before: "MotorRecord", now: "MotorRecord") -> Sequence[tuple[Text, str, str]]:
    """Return what else is another at the later test: what it is, as it was, as it is."""
    pairs = [(words, str(getattr(before, name)), str(getattr(now, name))) for name, words in _CIRCUMSTANCES]
    return [(words, was, is_now) for words, was, is_now in pairs if was != is_now]
