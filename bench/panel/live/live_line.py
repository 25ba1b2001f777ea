"""The end of line for the panel: the running batch, whoever started it."""

import asyncio
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bench.panel.launch import LINE, WATCHED_LINE
from bench.panel.live.run_line import RunLine
from drivers.interfaces.text import Text, text

#: How often (s) a line without a batch is looked at.
_LOOK = 1.0


class BatchLine(RunLine):
    """A connection to a batch that is going on; `state` is what it says of its sockets, None before it has."""

    def __init__(self, folder: Path, announced: str = LINE) -> None:
        super().__init__(folder)
        self.announced = announced
        self.state: Mapping[str, Any] | None = None

    def take(self, message: Mapping[str, Any]) -> bool:
        """Take in how the line stands."""
        if "line" not in message:
            return "question" in message
        self.state = message["line"]
        self.changes += 1
        return True


class LiveLine:
    """Follows the batch among the runs that goes on; pages read `state` and look at `changes`."""

    def __init__(self, runs: Path) -> None:
        self._runs = runs
        self._batch: BatchLine | None = None
        self._before = 0
        self._task: asyncio.Task[None] | None = None

    @property
    def changes(self) -> int:
        """A number that grows whenever there is something new to be seen."""
        return self._before + (self._batch.changes if self._batch else 0)

    @property
    def running(self) -> bool:
        """True while a batch is in progress."""
        return self._batch is not None and self._batch.alive

    @property
    def state(self) -> Mapping[str, Any] | None:
        """The state of the line, or that at the last batch's end; None if there was none."""
        return self._batch.state if self._batch else None

    async def open(self) -> None:
        """Find the batch that goes on, and go on looking for one."""
        await self._find()
        self._task = asyncio.create_task(self._follow())

    async def close(self) -> None:
        """Stop following; the batch goes on."""
        if self._task is not None:
            self._task.cancel()
        if self._batch is not None:
            await self._batch.close()

    async def follow(self, folder: Path, announced: str = LINE) -> bool:
        """Follow the batch of a folder; tell whether somebody is there."""
        fresh = BatchLine(folder, announced)
        if not await fresh.connect():
            return False
        old, self._batch = self._batch, fresh
        self._before += 1 + (old.changes if old else 0)
        if old is not None:
            await old.close()
        return True

    async def say(self, message: Mapping[str, Any]) -> Text | None:
        """Say something to the batch; return why it was refused, or None."""
        return await self._batch.say(message) if self._batch else text("no batch is running")

    async def _find(self) -> None:
        # One that is scanned here comes first, and takes the place of one that is only watched.
        watches = self._batch is not None and self._batch.announced == WATCHED_LINE
        if self.running and not watches:
            return
        for name in (LINE,) if self.running else (LINE, WATCHED_LINE):
            for announced in self._runs.glob(f"*/{name}"):
                if await self.follow(announced.parent, name):
                    return

    async def _follow(self) -> None:
        while True:
            await asyncio.sleep(_LOOK)
            await self._find()
