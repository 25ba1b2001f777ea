"""The calibration of an instrument: its date, its due date, and its certificate."""

import datetime
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import Field, model_validator

from bench.files.toml_file import Section, validate
from bench.i18n.errors import FileError
from drivers.interfaces.text import lines, text
from procedures.core.result import Notice

#: Key of an instrument's table under which both the entry and a driver's own accuracies stand.
KEY = "calibration"
#: Key of the entry's table that holds the accuracies of a driver that takes a list of them.
_POINTS = "points"


class CalibrationSection(Section):
    """`[instruments.<role>.calibration]`: when, until when, by which certificate."""

    date: datetime.date = Field(strict=True, description="a date without quotes, as 2026-03-31")
    due: datetime.date = Field(strict=True, description="a date without quotes, as 2026-03-31")
    certificate: str = Field(min_length=1, description="the certificate's number, text in quotes")

    @model_validator(mode="after")
    def _in_order(self) -> "CalibrationSection":
        if self.due < self.date:
            raise ValueError(
                text(
                    "due = {due} lies before date = {date}; allowed is a due date on or after it",
                    due=self.due,
                    date=self.date,
                )
            )
        return self


@dataclass(frozen=True)
class Calibration:
    """One instrument's calibration: the last day on which it holds is `due`."""

    date: datetime.date
    due: datetime.date
    certificate: str

    def as_dict(self) -> dict[str, str]:
        """Return it as it stands in a result's station block; dates as ISO 8601."""
        return {"date": self.date.isoformat(), "due": self.due.isoformat(), "certificate": self.certificate}


def take_entry(table: Mapping[str, Any], source: str, prefix: str) -> tuple[Calibration | None, dict[str, Any]]:
    """Return an instrument's calibration entry and its table as the driver takes it.

    A driver's own `calibration` goes on standing there: numbered keys (channels, ranges) beside the entry's, a list of points
    under `points`, or as a list alone where there is no entry. Raises InputError naming file, key and what is allowed.
    """
    rest = dict(table)
    given = rest.get(KEY)
    if not isinstance(given, Mapping):
        return None, rest
    accuracies = {key: value for key, value in given.items() if _is_number(key)}
    entry = {key: value for key, value in given.items() if key not in accuracies and key != _POINTS}
    del rest[KEY]
    if accuracies or _POINTS in given:
        rest[KEY] = given.get(_POINTS, accuracies)
    if not entry:
        return None, rest
    read = validate(CalibrationSection, entry, source, f"{prefix}.{KEY}")
    return Calibration(read.date, read.due, read.certificate), rest


def check(
    calibrations: Iterable[tuple[str, Calibration]],
    today: datetime.date,
    source: str,
    *,
    used: Collection[str],
    refuse: bool,
) -> tuple[Notice, ...]:
    """Return a warning for every role among those `used` whose calibration is overdue.

    Raises InputError for a calibration of the future, used or not, and with `refuse` for one that is overdue.
    """
    found = list(calibrations)
    for role, calibration in found:
        if calibration.date > today:
            raise FileError(
                text(
                    "{source}: instruments.{role}.{key}.date = {date} lies in the future; "
                    "allowed is a date up to today, {today}. Correct the file or this computer's date",
                    source=source,
                    role=role,
                    key=KEY,
                    date=calibration.date,
                    today=today,
                )
            )
    overdue = [(role, calibration) for role, calibration in found if role in used and today > calibration.due]
    if refuse and overdue:
        raise FileError(
            lines(
                text(
                    "{source}: instruments.{role}.{key}: certificate {certificate} was due on {due} and today is "
                    "{today}. This station refuses overdue calibrations: calibrate the instrument and enter the "
                    "new certificate",
                    source=source,
                    role=role,
                    key=KEY,
                    certificate=calibration.certificate,
                    due=calibration.due,
                    today=today,
                )
                for role, calibration in overdue
            )
        )
    return tuple(_notice(role, calibration) for role, calibration in overdue)


def _notice(role: str, calibration: Calibration) -> Notice:
    return Notice(
        "calibration-overdue",
        text(
            "{role}: the calibration by certificate {certificate} of {date} was due on {due}; its stated "
            "accuracy is no longer confirmed",
            role=text(role),
            certificate=calibration.certificate,
            date=calibration.date.isoformat(),
            due=calibration.due.isoformat(),
        ),
    )


def _is_number(key: str) -> bool:
    try:
        float(key)
    except ValueError:
        return False
    return True
