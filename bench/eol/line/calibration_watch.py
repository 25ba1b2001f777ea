"""Calibrations that run out while a batch goes on: the line hears of them with the new day, not by motors that cannot be tested."""

from collections.abc import Callable
from datetime import date

from bench.eol.line.preparation.line_file import ProductionLine
from bench.eol.line.preparation.prepare import calibrations_of
from bench.i18n.errors import InputError
from bench.station.clock import wall_date
from drivers.interfaces.text import Text, text, text_of
from procedures.core.bench import Role


class CalibrationWatch:
    """Looks through the calibrations of a line's `roles` once a day, the day it is made on left out.

    What is due soon or overdue is `noted`; where the station refuses what is overdue that goes to `trouble`.
    """

    def __init__(
        self,
        line: ProductionLine,
        roles: frozenset[Role],
        noted: Callable[[Text], None],
        trouble: Callable[[Text], None],
        today: Callable[[], date] = wall_date,
    ) -> None:
        self._line, self._roles = line, roles
        self._noted, self._trouble = noted, trouble
        self._today, self._seen = today, today()
        self._why: Text | None = None

    def refused(self) -> Text | None:
        """Return why the line may test no further motor, None where it may."""
        day = self._today()
        if day != self._seen:
            self._seen = day
            try:
                pressing = calibrations_of(self._line, self._roles, day)
            except InputError as error:
                self._why = text("the line takes no more motors: {why}", why=text_of(error))
                self._trouble(self._why)
            else:
                self._why = None
                for words in pressing:
                    self._noted(words)
        return self._why
