"""Starts runs as processes of their own: they outlive the panel's server, and each has its own shutdown."""

import asyncio
import json
import os
import signal
import sys
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from bench.eol.line.batch_log import ANNOUNCEMENTS
from bench.i18n.errors import InputError
from bench.operators.operator_channel import FILE
from drivers.interfaces.text import text

#: A batch's announcement, and that of a batch that panels only watch.
LINE, WATCHED_LINE = ANNOUNCEMENTS

#: How long (s) a run may take until it is reachable, instruments not included.
_START_TIME = 30.0
_LOOK = 0.03


@dataclass(frozen=True)
class Order:
    """A run as the start page orders it; `motor` and `station` as on the command line."""

    procedures: Sequence[str]
    station: str
    motor: str
    person: str
    language: str = "en"
    settings: Sequence[str] = field(default_factory=tuple)
    go_on: bool = False
    seed: int | None = None
    serial_number: str = ""

    def arguments(self, runs: Path) -> list[str]:
        """Return the command line that says the same."""
        args = ["run", *self.procedures, "--station", self.station, "--motor", self.motor]
        args += ["--operator", "panel", f"--person={self.person}", "--language", self.language, "--runs", str(runs)]
        args += [f"--set={setting}" for setting in self.settings]
        args += ["--continue-on-error"] if self.go_on else []
        args += [f"--serial-number={self.serial_number}"] if self.serial_number else []
        return args + ([f"--seed={self.seed}"] if self.seed is not None else [])


@dataclass(frozen=True)
class BatchOrder:
    """A batch as the line's page orders it; `sockets` only for virtual benches."""

    plan: str
    station: str
    batch: str
    person: str
    records: str = ""
    language: str = "en"
    sockets: int | None = None

    def arguments(self, runs: Path) -> list[str]:
        """Return the command line that says the same."""
        args = ["eol", "run", self.plan, "--station", self.station, "--serials", "panel", f"--person={self.person}"]
        args += ["--language", self.language, "--runs", str(runs)]
        args += [f"--batch={self.batch}"] if self.batch else []
        args += [f"--records={self.records}"] if self.records else []
        return args + ([f"--sockets={self.sockets}"] if self.sockets is not None else [])


class Launcher:
    """Starts runs into one folder of runs, and reaps those that end."""

    def __init__(self, runs: Path) -> None:
        self._runs = runs
        self._children: set[int] = set()

    async def start(self, order: Order) -> Path:
        """Start a run and return its folder once it can be talked to. Raises InputError with what it said instead."""
        return await self._launch(order.arguments(self._runs))

    async def resume(self, folder: Path, person: str, repeat: Sequence[str] = (), language: str = "en") -> Path:
        """Resume a run where it ended, or repeat a procedure of it. Raises InputError with the run's message if it does not start."""
        args = ["run", "--resume", str(folder), "--operator", "panel", f"--person={person}", "--runs", str(self._runs)]
        args += ["--language", language]
        args += [f"--repeat={name}" for name in repeat]
        return await self._launch(args)

    async def start_batch(self, order: "BatchOrder") -> Path:
        """Start a batch and return its folder once it can be talked to. Raises InputError with what it said instead."""
        return await self._launch(order.arguments(self._runs), LINE)

    async def _launch(self, arguments: Sequence[str], announced: str = FILE) -> Path:
        self._reap()
        with tempfile.TemporaryFile() as errors:
            pid = _spawn([sys.executable, "-P", "-m", "motorbench", *arguments], errors.fileno())
            self._children.add(pid)
            try:
                async with asyncio.timeout(_START_TIME):
                    while pid in self._children:
                        folder = self._announced(pid, announced)
                        if folder is not None:
                            return folder
                        await asyncio.sleep(_LOOK)
                        self._reap()
            except TimeoutError:
                os.kill(pid, signal.SIGTERM)
                raise InputError(
                    text("the run did not begin within {start_time:g} s; it was ended", start_time=_START_TIME)
                ) from None
            errors.seek(0)
            words = errors.read().decode("utf-8", "replace").strip()
            raise InputError(words.removeprefix("motorbench: ") or text("the run ended immediately without a message"))

    def _reap(self) -> None:
        """Let go of runs that have ended."""
        for pid in list(self._children):
            if os.waitpid(pid, os.WNOHANG)[0] == pid:
                self._children.discard(pid)

    def _announced(self, pid: int, name: str) -> Path | None:
        for path in self._runs.glob(f"*/{name}"):
            with suppress(OSError, ValueError):
                if json.loads(path.read_text(encoding="utf-8")).get("pid") == pid:
                    return path.parent
        return None


def _spawn(command: list[str], errors: int) -> int:
    """Start a process that gets no Ctrl-C of the server's terminal; its standard error goes to `errors`."""
    actions = [
        (os.POSIX_SPAWN_OPEN, 0, os.devnull, os.O_RDONLY, 0),
        (os.POSIX_SPAWN_OPEN, 1, os.devnull, os.O_WRONLY, 0),
        (os.POSIX_SPAWN_DUP2, errors, 2),
    ]
    return os.posix_spawn(command[0], command, os.environ, file_actions=actions, setsid=True)
