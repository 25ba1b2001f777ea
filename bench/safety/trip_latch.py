"""Trip latch: blocks a station after an interlock has opened, until a person has reset it."""

import json
import os
import uuid
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from typing import Any

from bench.journal.errors import RecordError
from bench.safety.ownership.state_folder import FolderBusyError, StateFolder
from bench.station.interlock_entries import InterlockEntry
from bench.station.station_file import Station
from drivers.interfaces.text import reason_of

#: A line for every trip, reset, and record that holds a reset; lines are only added.
_FILE, _MODE = "trips.jsonl", 0o666


@dataclass(frozen=True)
class Trip:
    """An interlock that opened: which, how, when (ISO 8601, UTC), and the reset, by whom and when, once there is one."""

    interlock: str
    how: str
    wall: str
    reset_by: str = ""
    reset_wall: str = ""


@dataclass(frozen=True)
class _Kept:
    """A trip in the file: the contact's names, the station's, and whether a record holds its reset already."""

    trip: Trip
    keys: frozenset[str] = field(default_factory=frozenset)
    station: str = ""
    recorded: bool = False
    unreadable: bool = False


class Latch:
    """The trips that concern a station: those of its contacts, by whatever file it is reached, and those of its name.

    They are in the computer's state folder, so that a copy or a link of the station file, or a file in which the contact
    stands no more, is held up too.
    """

    def __init__(self, state: StateFolder, station: Station) -> None:
        self._state = state
        self.path = state.path / _FILE
        self._contacts = {entry.name: _keys(entry) for entry in station.interlocks}
        self._station = f"{station.name} at {station.control}" if station.control else station.name

    def check_writable(self) -> None:
        """Raise InputError where a trip could not be kept."""
        os.close(self._open())

    def trip(self, interlock: str, how: str) -> None:
        """Remember that an interlock has opened; the first one is the cause. Raises RecordError where that fails."""
        with self._alone():
            keys = self._contacts.get(interlock, frozenset())
            known = [kept for kept in self._concerning().values() if not kept.trip.reset_by]
            if not any(kept.keys & keys for kept in known):
                line = {
                    "trip": uuid.uuid4().hex,
                    "interlock": interlock,
                    "how": how,
                    "wall": _now(),
                    "keys": sorted(keys),
                    "station": self._station,
                }
                self._append(line)

    def standing(self) -> Trip | None:
        """Return the trip that nobody has reset yet, the first where there are several."""
        return next((kept.trip for kept in self._concerning().values() if not kept.trip.reset_by), None)

    def reset(self, by: str) -> Trip | None:
        """Reset the trips for a person; return the first, None where there is none. Raises RecordError."""
        with self._alone():
            standing = {name: kept for name, kept in self._concerning().items() if not kept.trip.reset_by}
            if not standing:
                return None
            wall = _now()
            self._append({"reset": list(standing), "by": by, "wall": wall})
            return replace(next(iter(standing.values())).trip, reset_by=by, reset_wall=wall)

    def take_reset(self) -> Trip | None:
        """Return a trip that was reset, once: whoever takes it writes it into a record. Raises RecordError."""
        with self._alone():
            reset = {
                name: kept for name, kept in self._concerning().items() if kept.trip.reset_by and not kept.recorded
            }
            if not reset:
                return None
            self._append({"recorded": list(reset)})
            return next(reversed(reset.values())).trip

    def _concerning(self) -> dict[str, _Kept]:
        own = frozenset().union(*self._contacts.values())
        return {
            name: kept
            for name, kept in self._read().items()
            if kept.unreadable or kept.station == self._station or kept.keys & own
        }

    def _read(self) -> dict[str, _Kept]:
        try:
            content = self.path.read_text(encoding="utf-8", errors="replace")
        except FileNotFoundError:
            return {}
        except OSError as error:
            # Whatever it was: an interlock that nobody can clear is one that stands.
            return {"": _Kept(Trip("unknown", f"{self.path} cannot be read: {reason_of(error)}", ""), unreadable=True)}
        result: dict[str, _Kept] = {}
        for number, line in enumerate(content.splitlines(), 1):
            try:
                _take(json.loads(line), result)
            except (ValueError, TypeError, KeyError, AttributeError):
                how = f"{self.path}, line {number}, cannot be read"
                result[f"line {number}"] = _Kept(Trip("unknown", how, ""), unreadable=True)
        return result

    def _append(self, line: Mapping[str, Any]) -> None:
        file = self._open()
        try:
            self._state.append(file, json.dumps(line, ensure_ascii=False).encode())
        except OSError as error:
            raise RecordError(self.path, error) from error
        finally:
            os.close(file)

    def _open(self) -> int:
        return self._state.open(_FILE, os.O_RDWR | os.O_APPEND, _MODE)

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """Lock the file; where another process is stuck with it, what happens is written all the same."""
        stuck = False
        try:
            with self._state.exclusively():
                yield
        except FolderBusyError:
            # Adding a line needs nobody else's leave; two trips for one opening do no harm.
            stuck = True
        if stuck:
            yield


def _take(line: Mapping[str, Any], found: dict[str, _Kept]) -> None:
    if "trip" in line:
        trip = Trip(str(line["interlock"]), str(line["how"]), str(line["wall"]))
        found[line["trip"]] = _Kept(trip, frozenset(line["keys"]), str(line["station"]))
        return
    for name in line["reset"] if "reset" in line else line["recorded"]:
        if name not in found:
            continue
        kept = found[name]
        if "reset" in line:
            kept = replace(kept, trip=replace(kept.trip, reset_by=str(line["by"]), reset_wall=str(line["wall"])))
        else:
            kept = replace(kept, recorded=True)
        found[name] = kept


def _keys(entry: InterlockEntry) -> frozenset[str]:
    return frozenset(entry.driver.contact_names(entry.address, entry.options))


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
