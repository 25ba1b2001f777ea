"""One run as the panel knows it: its journal as it grows, and its line while it goes on."""

import asyncio
from pathlib import Path
from time import monotonic

from bench.journal.run_folder import RunFolder
from bench.panel.live.live_view import LiveView
from bench.panel.live.run_line import RunLine
from bench.panel.live.tail import JournalTail
from drivers.interfaces.text import Text

#: How often (s) the journal is looked at: nine of ten readings are to be seen 50 ms after they were written.
_LOOK = 0.02
#: How often (s) a run without a line is tried again.
_RETRY = 1.0


class LiveRun:
    """Follows a run's folder until closed; pages read `view` and `line` and look at `changes`."""

    def __init__(self, folder: Path) -> None:
        self.folder = RunFolder(folder)
        self.view = LiveView()
        self.line = RunLine(folder, self.look)
        #: When somebody at a panel asked for the abort (s, monotonic).
        self.abort_asked_at: float | None = None
        self._tail = JournalTail(self.folder.journal)
        self._task: asyncio.Task[None] | None = None

    @property
    def name(self) -> str:
        """The run's name, its folder's."""
        return self.folder.path.name

    @property
    def changes(self) -> int:
        """A number that grows whenever there is something new to be seen."""
        return self.view.changes + self.line.changes

    @property
    def running(self) -> bool:
        """True while its process exists and it has not ended."""
        return self.line.alive and not self.view.ended

    async def open(self) -> None:
        """Read what there is and go on following it."""
        self.look()
        await self.line.connect()
        self._task = asyncio.create_task(self._follow())

    def look(self) -> None:
        """Take in what was written since the last look."""
        for event in self._tail.read_new():
            self.view.take(event)

    async def abort(self, person: str) -> Text | None:
        """Request the run's shutdown; return why it was refused, or None."""
        fault = await self.line.abort(person)
        if fault is None:
            self.abort_asked_at = self.abort_asked_at or monotonic()
            self.line.changes += 1
        return fault

    async def close(self) -> None:
        """Stop following; the run itself goes on."""
        if self._task is not None:
            self._task.cancel()
        await self.line.close()

    async def _follow(self) -> None:
        waited = 0.0
        while True:
            await asyncio.sleep(_LOOK)
            self.look()
            waited += _LOOK
            if not self.line.alive and not self.view.ended and waited >= _RETRY:
                waited = 0.0
                fresh = RunLine(self.folder.path, self.look)
                fresh.watched = self.line.watched
                if await fresh.connect():
                    fresh.changes += self.line.changes
                    self.line = fresh
