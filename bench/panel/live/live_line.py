"""The end of line for the panel: the running batch, whoever started it."""

import asyncio
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bench.panel.launch import LINE, WATCHED_LINE
from bench.panel.live.run_line import RunLine

#: How often (s) a line without a batch is looked at.
_LOOK = 1.0


class BatchLine(RunLine):
    """A connection to a batch that is going on; `state` is what it says of its sockets, None before it has."""

    def __init__(self, folder: Path, announced: str = LINE) -> None:
        super().__init__(folder)
        self.announced = announced
        self.state: Mapping[str, Any] | None = None

    @property
    def broken_off(self) -> bool:
        """Whether it has ended without an end of its own: whoever ends takes the announcement back."""
        return not self.alive and (self.folder / self.announced).exists()

    def take(self, message: Mapping[str, Any]) -> bool:
        """Take in how the line stands."""
        if "line" not in message:
            return "question" in message
        self.state = message["line"]
        self.changes += 1
        return True


class LiveLine:
    """Follows the batches among the runs that go on; a page shows one of them."""

    def __init__(self, runs: Path) -> None:
        self._runs = runs
        #: Those that go on, and of those that have ended the latest.
        self._batches: dict[str, BatchLine] = {}
        self._task: asyncio.Task[None] | None = None

    @property
    def running(self) -> list[BatchLine]:
        """The batches that go on: first those that are scanned for here."""
        alive = (batch for batch in self._batches.values() if batch.alive and batch.state is not None)
        return sorted(alive, key=lambda batch: (batch.announced != LINE, batch.folder.name))

    @property
    def broken_off(self) -> list[BatchLine]:
        """The batches that were cut off while they were followed."""
        return [batch for batch in self._batches.values() if batch.state is not None and batch.broken_off]

    def shown(self, name: str = "") -> BatchLine | None:
        """Return the batch of a name, None where none is known by it; without a name the one to scan for or watch, or begun last."""
        if name:
            return self._batches.get(name)
        latest = next(reversed(self._batches.values()), None)
        return next(iter(self.running), latest)

    async def open(self) -> None:
        """Find the batches that go on, and go on looking for others."""
        await self._find()
        self._task = asyncio.create_task(self._follow())

    async def close(self) -> None:
        """Stop following; the batches go on."""
        if self._task is not None:
            self._task.cancel()
        for batch in self._batches.values():
            await batch.close()

    async def follow(self, folder: Path, announced: str = LINE) -> bool:
        """Follow the batch of a folder; tell whether somebody is there."""
        fresh = BatchLine(folder, announced)
        if not await fresh.connect():
            return False
        for name, batch in list(self._batches.items()):
            if name == folder.name or not (batch.alive or batch.broken_off):
                await self._batches.pop(name).close()
        self._batches[folder.name] = fresh
        return True

    async def _find(self) -> None:
        for name in (LINE, WATCHED_LINE):
            for announced in self._runs.glob(f"*/{name}"):
                known = self._batches.get(announced.parent.name)
                if known is None or not known.alive:
                    await self.follow(announced.parent, name)

    async def _follow(self) -> None:
        while True:
            await asyncio.sleep(_LOOK)
            await self._find()
