"""The runs of a folder, found by motor, serial number, date or parameter."""

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bench.i18n.errors import InputError
from bench.journal.packed import is_journal, packed_path
from bench.journal.stored_result import stored_definition
from bench.panel.live.tail import JournalTail
from drivers.interfaces.text import Text, word


@dataclass(frozen=True)
class Figure:
    """A parameter's value and standard uncertainty in its unit, what readers call it, and the unit that they expect."""

    value: float
    uncertainty: float
    unit: str
    label: Text
    reader_unit: str


@dataclass(frozen=True)
class WithheldFigure:
    """A parameter that is not given: what readers call it, and the likely cause by its short name."""

    label: Text
    cause: str


@dataclass(frozen=True)
class Archived:
    """A run as a list shows it; `date` is its folder's stamp (UTC), `figures` its parameters by name, `withheld` those not given."""

    name: str
    date: str
    motor: str
    serial_number: str
    person: str
    status: str
    figures: Mapping[str, Figure]
    withheld: Mapping[str, WithheldFigure] = field(default_factory=dict)

    def matches(self, words: str, shown: Sequence[str] = ()) -> bool:
        """Tell whether every word is found in name, date, motor, serial number, person, status, a parameter's name or `shown`.

        `shown` is what a reader sees of it in words of a language.
        """
        searched = " ".join(
            (
                self.name,
                self.date,
                f"{self.date[:4]}-{self.date[4:6]}-{self.date[6:8]}",
                self.motor,
                self.serial_number,
                self.person,
                self.status,
                *self.figures,
                *self.withheld,
                *shown,
            )
        )
        return all(word in searched.lower() for word in words.lower().split())


class Archive:
    """Reads each run once; a run that has changed since is read again."""

    def __init__(self, runs: Path) -> None:
        self._runs = runs
        self._known: dict[str, tuple[float, Archived]] = {}

    def list(self) -> list[Archived]:
        """Return all runs, newest first; a folder that holds none is passed over."""
        runs = sorted(self._read(), key=lambda run: run.name, reverse=True)
        self._known = {run.name: self._known[run.name] for run in runs}
        return runs

    def _read(self) -> Iterator[Archived]:
        if not self._runs.is_dir():
            return
        with os.scandir(self._runs) as entries:
            folders = [Path(entry.path) for entry in entries if entry.is_dir()]
        for folder in folders:
            journal, result = folder / "journal.jsonl", folder / "result.json"
            if not is_journal(journal):
                continue
            source = result if os.path.isfile(result) else journal
            try:
                changed = (source if os.path.isfile(source) else packed_path(journal)).stat().st_mtime
            except FileNotFoundError:
                # Removed since the folder was listed.
                continue
            known = self._known.get(folder.name)
            if known is None or known[0] != changed:
                self._known[folder.name] = known = (changed, _archived(folder, source))
            yield known[1]


def _archived(folder: Path, source: Path) -> Archived:
    result: Mapping[str, Any] = {}
    if source.name == "result.json":
        try:
            result = json.loads(source.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            result = {}
        if not isinstance(result, dict) or not result:
            result = {"status": "unreadable"}
    else:
        # Killed before its result was written: its beginning says whose it is.
        try:
            first = next(JournalTail(source).read_new(), None)
            result = {**(first.data if first else {}), "status": "interrupted"}
        except (OSError, InputError):
            result = {"status": "unreadable"}
    motor = result.get("motor") or {}
    return Archived(
        folder.name,
        folder.name[:16],
        str(motor.get("name", "")),
        str(motor.get("serial_number", "")),
        str(result.get("person") or ""),
        str(result.get("status", "")),
        dict(_figures(result.get("parameters") or {})),
        dict(_withheld(result.get("withheld") or {})),
    )


def _figures(parameters: Mapping[str, Any]) -> Iterator[tuple[str, Figure]]:
    for name, entry in parameters.items():
        try:
            definition = stored_definition(entry, name)
            value, uncertainty, unit = entry["value"], entry["standard_uncertainty"], str(entry["unit"])
            label = word(name) if definition is None else definition.label
            reader_unit = (definition.reader_unit if definition else "") or unit
            yield name, Figure(float(value), float(uncertainty), unit, label, reader_unit)
        except (KeyError, TypeError, ValueError):
            continue


def _withheld(entries: Mapping[str, Any]) -> Iterator[tuple[str, WithheldFigure]]:
    for name, entry in entries.items():
        try:
            definition = stored_definition(entry, name)
            yield name, WithheldFigure(word(name) if definition is None else definition.label, str(entry["cause"]))
        except (KeyError, TypeError, ValueError):
            continue
