"""The panel's end of a run's line: hears the question that is open, answers it, watches, aborts."""

import asyncio
import json
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from time import monotonic
from typing import Any

from bench.journal.stored_result import restore_text, store_text
from bench.operators.operator_channel import FILE
from bench.operators.stored_plot import restore_plot
from drivers.interfaces.text import Text, text
from procedures.core.live_plot import LivePlot

#: How often (s) a run is told that somebody watches; it waits much longer before it ends for want of it.
_BEAT = 2.0
_ANSWER_TIME = 10.0
#: Longest line (bytes) of a run: a plot takes some ten thousand.
_LONGEST = 1 << 20
_ENDED = text("the run has ended")


class RunLine:
    """A connection to a run that is going on.

    `question` is what it waits for now, or None. `alive` is false once the run has ended or was never reached.
    `catch_up` is called before a question is shown: what it follows from stands in the journal by then.
    """

    #: The announcement's file in the run's folder.
    announced = FILE

    def __init__(self, folder: Path, catch_up: Callable[[], None] | None = None) -> None:
        self.folder = folder
        self._catch_up = catch_up
        self.question: Mapping[str, Any] | None = None
        self.alive = False
        self.changes = 0
        #: What the run's sources said of themselves when they were asked last, and when that was heard (s, monotonic).
        self.sources: Sequence[Mapping[str, Any]] = ()
        self.sources_at = -math.inf
        #: What the present procedure shows of its measurement, and whether nothing has been asked since
        #: but to stop turning, which ends what it shows.
        self.plot: LivePlot | None = None
        self.plot_is_newest = False
        self._replies: asyncio.Queue[Mapping[str, Any]] = asyncio.Queue()
        self._speaking = asyncio.Lock()
        self._writer: asyncio.StreamWriter | None = None
        self._tasks: list[asyncio.Task[None]] = []
        #: Whether a page has shown the run since the run last heard so.
        self.watched = False

    async def connect(self) -> bool:
        """Connect where the run's folder says, and return whether somebody is there."""
        try:
            where = json.loads((self.folder / self.announced).read_text(encoding="utf-8"))
            reader, self._writer = await asyncio.open_connection("127.0.0.1", where["port"], limit=_LONGEST)
        except (OSError, ValueError, KeyError):
            # A run that was killed leaves its announcement behind; nobody answers there.
            return False
        self._send({"token": where["token"]})
        self.alive = True
        self._tasks = [asyncio.create_task(self._listen(reader)), asyncio.create_task(self._watch())]
        return True

    async def answer(self, number: int, value: object) -> Text | None:
        """Answer a question; return why it was refused, or None."""
        return await self.say({"id": number, "answer": value})

    async def abort(self, person: str) -> Text | None:
        """Request the run's shutdown; return why it was refused, or None."""
        return await self.say({"abort": person})

    async def ask_again(self) -> Text | None:
        """Request a new read-back of the sources, including those that could not be reached; return why it was refused, or None."""
        return await self.say({"again": True})

    async def close(self) -> None:
        """Hang up; the run goes on, and ends itself where nobody else watches."""
        for task in self._tasks:
            task.cancel()
        if self._writer is not None:
            self._writer.close()
            with suppress(OSError):
                await self._writer.wait_closed()

    def take(self, message: Mapping[str, Any]) -> bool:
        """Take in what the run says of itself; tell whether it did."""
        if "sources" in message:
            self.sources, self.sources_at = message["sources"], monotonic()
            return True
        if "question" not in message and "plot" not in message:
            return False
        if self._catch_up is not None:
            self._catch_up()
        if "plot" in message:
            self._take_plot(message["plot"])
        if "question" in message:
            self.question = message["question"]
            self.plot_is_newest &= self.question is None or self.question.get("action") == "StopTurning"
        self.changes += 1
        return True

    def _take_plot(self, plot: Mapping[str, Any] | None) -> None:
        try:
            self.plot = restore_plot(plot) if plot else None
        except (ValueError, KeyError, TypeError):
            # A run of another version says it in another way: the run is more than its plot.
            self.plot = None
        self.plot_is_newest = self.plot is not None

    async def say(self, message: Mapping[str, Any]) -> Text | None:
        """Say something that is answered; return why it was refused, or None."""
        if not self.alive:
            return _ENDED
        async with self._speaking:
            while not self._replies.empty():
                self._replies.get_nowait()
            self._send(message)
            try:
                async with asyncio.timeout(_ANSWER_TIME):
                    reply = await self._replies.get()
            except TimeoutError:
                return text("the run does not answer") if self.alive else _ENDED
        return restore_text(reply["text"]) if "refused" in reply else None

    def _send(self, message: Mapping[str, Any]) -> None:
        if self._writer is not None:
            self._writer.write(json.dumps(message).encode() + b"\n")

    async def _listen(self, reader: asyncio.StreamReader) -> None:
        try:
            while line := await reader.readline():
                message = json.loads(line)
                if not self.take(message) and message.get("heard", "") != "watching":
                    self._replies.put_nowait(message)
        except (OSError, ValueError):
            return
        finally:
            self.alive, self.question = False, None
            self.changes += 1
            self._replies.put_nowait({"refused": str(_ENDED), "text": store_text(_ENDED)})

    async def _watch(self) -> None:
        while self.alive:
            if self.watched:
                self.watched = False
                self._send({"watching": True, "id": "watching"})
            await asyncio.sleep(_BEAT)
