"""The due dates of a station's calibrations: the list to work through, soonest first."""

import datetime
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from bench.station.calibration import Calibration
from bench.station.station_file import Entry
from drivers.interfaces.text import Text, text

#: What is due within so many days is told of before a batch begins.
SOON = 30


@dataclass(frozen=True)
class CalibrationDue:
    """One instrument's place in the list: its calibration, None where none is entered, and how many days that holds still."""

    role: str
    calibration: Calibration | None
    days_left: int | None

    @property
    def pressing(self) -> bool:
        """True if it is overdue, or will be soon."""
        return self.days_left is not None and self.days_left <= SOON

    @property
    def words(self) -> Text:
        """Say until when the instrument's accuracy is vouched for."""
        if self.calibration is None or self.days_left is None:
            return text("{role}: no calibration is entered in the station file", role=text(self.role))
        about: dict[str, object] = {
            "role": text(self.role),
            "certificate": self.calibration.certificate,
            "due": self.calibration.due.isoformat(),
        }
        if self.days_left < 0:
            return text(
                "{role}: calibration {certificate} was due on {due}, {days} days ago", days=-self.days_left, **about
            )
        return text("{role}: calibration {certificate} is due on {due}, in {days} days", days=self.days_left, **about)

    def as_dict(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        entered = self.calibration.as_dict() if self.calibration else None
        return {"role": self.role, "calibration": entered, "days_left": self.days_left}


def calibration_list(entries: Iterable[Entry], today: datetime.date) -> list[CalibrationDue]:
    """Return the list of some instruments, soonest first, those without a calibration last."""
    due = [
        CalibrationDue(
            entry.role.value, entry.calibration, (entry.calibration.due - today).days if entry.calibration else None
        )
        for entry in entries
    ]
    return sorted(due, key=lambda each: (each.days_left is None, each.days_left or 0, each.role))
