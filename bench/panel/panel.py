"""The panel's state: the runs it follows, who leads, who is there. Pages only show it."""

import asyncio
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from bench.i18n.errors import InputError
from bench.journal.run_folder import existing_run_folder
from bench.operators.operator_channel import FILE
from bench.panel.archive import Archive
from bench.panel.launch import BatchOrder, Launcher, Order
from bench.panel.live.control import Control
from bench.panel.live.live_line import LiveLine
from bench.panel.live.live_run import LiveRun
from bench.panel.live.tail import JournalTail
from bench.panel.offer import Offer
from bench.panel.server.access import Access
from bench.panel.server.sessions import Sessions
from drivers.interfaces.text import text


class Panel:
    """Everything that outlives a page; `station` is a file or `virtual`, `motors` the folder of motor files made here,
    `plans` that of the end of line's plans, `records` where its records are kept, `access` the people, where one logs in.
    """

    def __init__(
        self,
        runs: Path,
        station: str,
        motors: Path,
        plans: Path | None = None,
        records: str = "",
        sessions: Sessions | None = None,
        access: Access | None = None,
    ) -> None:
        self.runs = runs
        self.station = station
        self.motors = motors
        self.control = Control()
        self.sessions = sessions or Sessions()
        self.access = access
        self.launcher = Launcher(runs)
        self.offer = Offer(str(station))
        self.archive = Archive(runs)
        self.line = LiveLine(runs)
        self.plans = plans or Path("plans")
        self.records = records
        self._live: dict[str, LiveRun] = {}
        self._opening = asyncio.Lock()
        self._beginning = asyncio.Lock()

    async def open(self) -> None:
        """Find the runs that are going on, whoever started them."""
        for announced in self.runs.glob(f"*/{FILE}"):
            await self.follow(announced.parent.name)
        await self.line.open()

    async def close(self) -> None:
        """Stop following; runs go on."""
        for run in self._live.values():
            await run.close()
        await self.line.close()

    async def follow(self, name: str) -> LiveRun:
        """Return a run by its name, followed from now on: its folder's under the runs, that of a batch's motor with the folders on the
        way. Raises InputError where there is none.
        """
        async with self._opening:
            if name not in self._live:
                if not all(part and not part.startswith(".") for part in name.split("/")):
                    raise InputError(
                        text("{name}: a run's name is that of its folder under {runs}", name=name, runs=self.runs)
                    )
                run = LiveRun(existing_run_folder(str(self.runs / name), self.runs).path)
                await run.open()
                self._live[name] = run
            return self._live[name]

    def of_batch(self, run: LiveRun) -> bool:
        """Tell whether a run is a batch's motor, which is begun again at the line only."""
        return run.folder.path.parent != self.runs

    def running(self) -> list[LiveRun]:
        """Return the runs that go on now, newest first."""
        return sorted((run for run in self._live.values() if run.running), key=lambda run: run.name, reverse=True)

    def watch(self) -> None:
        """Tell the runs that whoever has the control is there."""
        for run in self._live.values():
            run.line.watched = True

    async def start(self, order: Order) -> LiveRun:
        """Start a run. Raises InputError with what it said where it could not begin."""
        return await self._followed(await self.launcher.start(order))

    async def start_batch(self, order: BatchOrder) -> None:
        """Start a batch, which `line` follows from then on. Raises InputError with what it said where it could not begin."""
        # Two clicks, or two browsers, would put two batches on the same sockets.
        if self.line.running or self._beginning.locked():
            raise InputError(text("a batch is already running, or is being started"))
        async with self._beginning:
            await self.line.follow(await self.launcher.start_batch(order))

    async def resume(self, name: str, person: str, repeat: Sequence[str] = (), language: str = "en") -> LiveRun:
        """Resume an ended run, or repeat a procedure of it. Raises InputError with the run's message if it does not start."""
        run = self._live.pop(name, None)
        if run is not None:
            await run.close()
        return await self._followed(await self.launcher.resume(self.runs / name, person, repeat, language))

    def beginning(self, name: str) -> Iterator[Mapping[str, Any]]:
        """Give the data of a run's first event, where it has one."""
        for event in JournalTail(self.runs / name / "journal.jsonl").read_new():
            yield event.data
            return

    async def _followed(self, folder: Path) -> LiveRun:
        # The folder announces itself a moment before its journal begins.
        async with asyncio.timeout(10.0):
            while not (folder / "journal.jsonl").is_file():
                await asyncio.sleep(0.01)
        return await self.follow(folder.name)
