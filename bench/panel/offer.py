"""The available procedures and the station's readiness: asked of child processes, so that the server stays small."""

import asyncio
import json
import tempfile
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bench.i18n.english_names import PROCEDURES
from bench.i18n.errors import InputError
from bench.panel.child_command import child_command
from drivers.interfaces.text import Text, text


@dataclass(frozen=True)
class StepWords:
    """One step: its place in the document and its English template."""

    identifier: str
    template: str


@dataclass(frozen=True)
class Offered:
    """One procedure as it can be chosen; `settings` by name with default, unit and description.

    One that is not `in_all` is chosen by name only, one that is `manual` is a run of its own.
    """

    name: str
    title: str
    section: str
    roles: tuple[str, ...]
    steps: tuple[StepWords, ...]
    settings: Mapping[str, Mapping[str, Any]]
    in_all: bool = True
    manual: bool = False


class Offer:
    """The procedures that this installation and the station's plug-ins have; asked for once."""

    def __init__(self, station: str = "virtual") -> None:
        self._station = station
        self._asked: asyncio.Task[dict[str, Offered]] | None = None

    async def procedures(self) -> Mapping[str, Offered]:
        """Return them by name, in the order of a whole measurement. Raises InputError where the command fails."""
        if self._asked is None or (self._asked.done() and self._asked.exception() is not None):
            self._asked = asyncio.create_task(_offered(self._station))
        return await asyncio.shield(self._asked)

    def title(self, procedure: str) -> Text:
        """Return what readers call a procedure; a plug-in's is its own name until that is known."""
        offered = self._known(procedure)
        return Text(offered.title if offered else PROCEDURES.get(procedure, "{name}"), {"name": procedure})

    def is_manual(self, procedure: str) -> bool:
        """Tell whether a person commands it, as far as that is known."""
        offered = self._known(procedure)
        return offered is not None and offered.manual

    def step(self, procedure: str, identifier: str) -> StepWords | None:
        """Return a step's words, where they are known already."""
        offered = self._known(procedure)
        return next((step for step in offered.steps if step.identifier == identifier), None) if offered else None

    def _known(self, procedure: str) -> Offered | None:
        if self._asked is None or not self._asked.done() or self._asked.exception() is not None:
            return None
        return self._asked.result().get(procedure)


@dataclass(frozen=True)
class RehearsalEstimate:
    """The result of a rehearsal: bench time and hands' time (s) by procedure, and its objections."""

    times: Mapping[str, tuple[float, float]]
    objections: tuple[str, ...]


async def rehearse(
    procedures: Sequence[str], station: str, motor: str, language: str, settings: Sequence[str] = ()
) -> RehearsalEstimate:
    """Return what `motorbench run … --rehearse` says of a plan. Raises InputError with its message."""
    with tempfile.TemporaryDirectory() as folder:
        reply = await _command(
            "run",
            *procedures,
            "--station",
            station,
            "--motor",
            motor,
            *(f"--set={setting}" for setting in settings),
            "--rehearse",
            "--json",
            "--language",
            language,
            "--runs",
            folder,
        )
    failed = [f"{one['name']}: {one['cause']}" for one in reply["procedures"] if one["cause"]]
    passed = [f"{one['procedure']}: {one['message']}" for one in reply["violations"]]
    times = {one["name"]: (float(one["bench_time"]), float(one["hand_time"])) for one in reply["procedures"]}
    return RehearsalEstimate(times, tuple(dict.fromkeys([*passed, *failed])))


def named_roles(station: Path) -> frozenset[str] | None:
    """Return the roles that a station file names; None where it cannot be read, which `check_station` says more of."""
    try:
        named = tomllib.loads(station.read_text(encoding="utf-8")).get("instruments")
    except (OSError, ValueError):
        return None
    return frozenset(named) if isinstance(named, dict) else None


async def check_station(station: Path, language: str) -> Mapping[str, Any]:
    """Return what `motorbench station check --json` says of a station. Raises InputError with its message."""
    return await _command("station", "check", str(station), "--json", "--language", language)


async def _offered(station: str) -> dict[str, Offered]:
    reply = await _command("procedures", "--station", station, "--json", "--language", "en")
    return {
        name: Offered(
            name,
            data["title"],
            data["section"],
            tuple(data["roles"]),
            tuple(StepWords(step["id"], step["text"]) for step in data["steps"]),
            data["settings"],
            not (data["end_of_line"] or data["at_load"] or data["manual"]),
            data["manual"],
        )
        for name, data in reply["procedures"].items()
    }


async def _command(*arguments: str) -> Mapping[str, Any]:
    out, complaint = await child_command(*arguments)
    try:
        reply = json.loads(out)
    except ValueError:
        reply = None
    if isinstance(reply, dict) and set(reply) != {"error"}:
        return reply
    # What it printed for programs is English; what it said to people is in their language.
    raise InputError(complaint or text("motorbench {command} gave no output", command=" ".join(arguments)))
