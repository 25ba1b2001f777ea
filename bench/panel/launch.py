"""Starts runs as processes of their own: they outlive the panel's server, and each has its own way down."""

import asyncio
import json
import sys
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from bench.errors import InputError
from bench.operators.line import FILE

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

    def arguments(self, runs: Path) -> list[str]:
        """Return the command line that says the same."""
        said = ["run", *self.procedures, "--station", self.station, "--motor", self.motor]
        said += ["--operator", "panel", f"--person={self.person}", "--language", self.language, "--runs", str(runs)]
        said += [f"--set={setting}" for setting in self.settings]
        said += ["--continue-on-error"] if self.go_on else []
        return said + ([f"--seed={self.seed}"] if self.seed is not None else [])


class Launcher:
    """Starts runs into one folder of runs, and reaps those that end."""

    def __init__(self, runs: Path) -> None:
        self._runs = runs
        self._reaping: set[asyncio.Task[int]] = set()

    async def start(self, order: Order) -> Path:
        """Start a run and return its folder once it can be talked to. Raises InputError with what it said instead."""
        return await self._launch(order.arguments(self._runs))

    async def resume(self, folder: Path, person: str) -> Path:
        """Have a run go on where it ended. Raises InputError with what it said instead."""
        said = ["run", "--resume", str(folder), "--operator", "panel", f"--person={person}", "--runs", str(self._runs)]
        return await self._launch(said)

    async def _launch(self, arguments: Sequence[str]) -> Path:
        with tempfile.TemporaryFile() as said:
            # A session of its own: Ctrl-C at the server's terminal is not meant for the motor.
            process = await asyncio.create_subprocess_exec(
                sys.executable,
                "-m",
                "bench",
                *arguments,
                stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.DEVNULL,
                stderr=said,
                start_new_session=True,
            )
            ended = asyncio.create_task(process.wait())
            self._reaping.add(ended)
            ended.add_done_callback(self._reaping.discard)
            try:
                async with asyncio.timeout(_START_TIME):
                    while not ended.done():
                        folder = self._announced(process.pid)
                        if folder is not None:
                            return folder
                        await asyncio.sleep(_LOOK)
            except TimeoutError:
                process.terminate()
                raise InputError(f"the run did not begin within {_START_TIME:g} s; it was ended") from None
            said.seek(0)
            words = said.read().decode("utf-8", "replace").strip()
            raise InputError(words.removeprefix("motorbench: ") or f"the run ended at once, with {process.returncode}")

    def _announced(self, pid: int) -> Path | None:
        for path in self._runs.glob(f"*/{FILE}"):
            with suppress(OSError, ValueError):
                if json.loads(path.read_text(encoding="utf-8")).get("pid") == pid:
                    return path.parent
        return None
