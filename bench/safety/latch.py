"""What keeps a station still after an interlock has opened, until a person has reset it."""

import json
import os
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bench.errors import InputError
from bench.record.disk import write_file
from procedures.text import text


@dataclass(frozen=True)
class Trip:
    """An interlock that opened: which, how, when (ISO 8601, UTC), and the reset, by whom and when, once there is one."""

    interlock: str
    how: str
    wall: str
    reset_by: str = ""
    reset_wall: str = ""


class Latch:
    """A file beside the station file, `<station file>.tripped`: where it is, nothing starts."""

    def __init__(self, station: Path) -> None:
        self.path = station.with_name(station.name + ".tripped")

    def check_writable(self) -> None:
        """Raise InputError where a trip could not be kept."""
        if not os.access(self.path.parent, os.W_OK):
            raise InputError(
                text(
                    "{path}: an interlock that opens is remembered in this file, and its folder is not writable; "
                    "make it writable, or move the station file",
                    path=self.path,
                )
            )

    def trip(self, interlock: str, how: str) -> None:
        """Remember that an interlock has opened; the first one is the cause. Raises RecordError."""
        if self.standing() is None:
            self._write(Trip(interlock, how, _now()))

    def standing(self) -> Trip | None:
        """Return the trip that nobody has reset yet."""
        trip = self._read()
        return trip if trip is not None and not trip.reset_by else None

    def reset(self, by: str) -> Trip | None:
        """Have a person reset the trip; return it, or None where there is none. Raises RecordError."""
        trip = self.standing()
        if trip is not None:
            self._write(Trip(trip.interlock, trip.how, trip.wall, by, _now()))
        return trip

    def take_reset(self) -> Trip | None:
        """Return a trip that was reset, once: whoever takes it writes it into a record."""
        trip = self._read()
        if trip is None or not trip.reset_by:
            return None
        self.path.unlink(missing_ok=True)
        return trip

    def _read(self) -> Trip | None:
        try:
            content: dict[str, Any] = json.loads(self.path.read_text(encoding="utf-8"))
            return Trip(**content)
        except FileNotFoundError:
            return None
        except (OSError, ValueError, TypeError):
            # Whatever it was: an interlock that nobody can clear is one that stands.
            return Trip("unknown", f"{self.path} cannot be read", "")

    def _write(self, trip: Trip) -> None:
        write_file(self.path, json.dumps(trip.__dict__, ensure_ascii=False).encode() + b"\n")


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
