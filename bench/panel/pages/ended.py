"""What a run came to, and what can be done with it."""

import asyncio
import sys
from datetime import UTC, datetime
from pathlib import Path
from urllib.parse import quote

from nicegui import ui

from bench.i18n.errors import InputError
from bench.journal.events.run import MotorReference
from bench.journal.signatures import sign, signatures
from bench.panel.live_run import LiveRun
from bench.panel.pages.budgets import budgets_part
from bench.panel.pages.history import STATUS
from bench.panel.pages.misfits import misfits_part
from bench.panel.pages.parts import named, table
from bench.panel.pages.reader import Reader
from bench.panel.pages.waveforms import WaveformsPart
from bench.panel.panel import Panel
from bench.panel.sessions import Session
from bench.plugins.files import catalogues_of_run
from drivers.interfaces.text import text
from reports.tables.summary import other_warnings, rows, why_withheld


def ended_part(panel: Panel, session: Session, run: LiveRun, reader: Reader) -> None:
    """Build the results of a run that has ended."""
    _Ended(panel, session, run, reader).build()


class _Ended:
    def __init__(self, panel: Panel, session: Session, run: LiveRun, reader: Reader) -> None:
        self._panel = panel
        self._session = session
        self._run = run
        self._reader = reader
        start = run.view.run.start
        self._exports = catalogues_of_run(start.software if start is not None else {}).exports

    def build(self) -> None:
        say, view = self._reader.say, self._run.view.run
        motor = view.start.motor if view.start is not None else MotorReference("?")
        ui.label(f"{motor.name} {motor.serial_number}").classes("text-3xl font-bold")
        ui.label(say(STATUS.get(view.status, text("was interrupted")))).classes("text-xl")
        if view.cause:
            ui.label(view.cause).classes("text-base whitespace-pre-line").style("color:#7a130d")
        self._actions()
        with named(ui.element("section").classes("mb-card mb-4"), say(text("Parameters"))):
            self._parameters()
        self._warnings()
        misfits_part(self._panel, self._run, self._reader)
        budgets_part(self._run, self._reader)
        WaveformsPart(self._panel, self._run, self._reader).build()
        self._signatures = named(ui.element("section").classes("mb-card mb-4"), say(text("Signatures")))
        self._sign_part()

    def _actions(self) -> None:
        say, view = self._reader.say, self._run.view.run
        with ui.row().classes("gap-3 my-3 items-end"):
            if self._session.may_lead and view.status != "completed":
                ui.button(say(text("Go on where it ended")), on_click=lambda: self._resume(), color=None).classes(
                    "mb-go"
                )
            if self._session.may_lead:
                ui.button(say(text("Measure the next motor")), on_click=lambda: ui.navigate.to("/")).props("outline")
                titles = {name: say(self._panel.offer.title(name)) for name in view.planned}
                again = ui.select(titles, label=say(text("Procedure to repeat"))).props("outlined dense")
                again.classes("w-64")
                ui.button(say(text("Repeat")), on_click=lambda: self._repeat(again.value)).props("outline")
            targets = {name: target.title for name, target in self._exports.items()}
            target = ui.select(targets, label=say(text("Export for"))).props("outlined dense").classes("w-48")
            ui.button(say(text("Export")), on_click=lambda: self._export(target.value)).props("outline")
            ui.button(say(text("Report")), on_click=self._report).props("outline")
            against = f"/compare/{quote(self._run.name, safe='')}/type"
            ui.button(say(text("Compare with the type")), on_click=lambda: ui.navigate.to(against)).props("outline")

    def _parameters(self) -> None:
        say, view = self._reader.say, self._run.view.run
        head = [text("Parameter"), text("Value"), text("Unit"), text("u"), text("u, %"), text("Note's formula")]
        head += [text("Truth")] if view.truth else []
        lines = []
        for row in rows(view.parameters(), view.truth, self._reader.translate):
            line = [row.name, row.value, row.unit, row.uncertainty, row.relative, row.note]
            lines.append([*line, *([row.truth] if view.truth else []), row.section])
        if not lines:
            ui.label(say(text("No parameter was measured.")))
            return
        numeric = frozenset({1, 3, 4, 5, 6} if view.truth else {1, 3, 4, 5})
        table([*map(say, head), "§"], lines, numeric=numeric)
        legend = text("u: standard uncertainty. Note's formula: its result on the same readings.")
        ui.label(say(legend)).classes("text-sm mt-2")
        why = why_withheld(view.parameters())
        if why:
            ui.label(say(text("Not given"))).classes("text-lg font-semibold mt-3")
        for sentence in why:
            ui.label(f"✗ {say(sentence)}").classes("text-base py-1").style("color:#7a130d")

    def _warnings(self) -> None:
        say, view = self._reader.say, self._run.view.run
        warnings = other_warnings(view.parameters(), view.warnings())
        if not warnings:
            return
        with named(ui.element("section").classes("mb-card mb-4"), say(text("Warnings"))):
            ui.label(say(text("Warnings"))).classes("text-lg font-semibold")
            for procedure, notice in warnings:
                origin = f" ({procedure})" if procedure else ""
                ui.label(f"⚠ {notice.identifier}{origin}: {say(notice.message)}").classes("text-base py-1")

    def _sign_part(self) -> None:
        say = self._reader.say
        self._signatures.clear()
        with self._signatures:
            ui.label(say(text("Signatures"))).classes("text-lg font-semibold")
            try:
                signed = signatures(self._run.folder)
            except InputError as error:
                ui.label(self._reader.fault(error)).style("color:#7a130d")
                return
            for signature in signed:
                when = datetime.fromisoformat(signature.time).strftime("%Y-%m-%d %H:%M:%S UTC")
                parts = [f"{signature.person} ({signature.role})", when, signature.words]
                parts.append(f"SHA-256 {signature.sha256[:12]}…")
                ui.label(" · ".join(part for part in parts if part)).classes("text-base")
                if not signature.holds:
                    ui.label(
                        say(text("This signature does not hold: the run went on, or was changed, after it."))
                    ).style("color:#7a130d")
            if self._session.may_change and self._run.view.ended:
                with ui.row().classes("items-end gap-3"):
                    name = ui.input(say(text("Name")), value=self._session.person).props("outlined dense")
                    remark = ui.input(say(text("Remark"))).props("outlined dense").classes("w-96")
                    ui.button(
                        say(text("Sign off")),
                        on_click=lambda: self._sign(str(name.value or ""), str(remark.value or "")),
                    )

    def _sign(self, person: str, words: str) -> None:
        try:
            sign(self._run.folder, person, self._session.right.value, words, datetime.now(UTC))
        except InputError as error:
            self._complain(self._reader.fault(error))
            return
        self._sign_part()

    async def _repeat(self, procedure: str | None) -> None:
        if procedure is None:
            self._complain(self._reader.say(text("Choose the procedure to repeat.")))
            return
        await self._resume(procedure)

    async def _resume(self, repeat: str | None = None) -> None:
        chosen = [repeat] if repeat is not None else []
        try:
            again = await self._panel.resume(self._run.name, self._session.person, chosen, self._session.language)
        except (InputError, TimeoutError) as error:
            self._complain(self._reader.fault(error))
            return
        self._panel.control.take(self._session.token, self._session.person)
        ui.navigate.to(f"/runs/{quote(again.name, safe='')}")

    async def _export(self, target: str | None) -> None:
        if not target:
            self._complain(self._reader.say(text("Choose what to export for.")))
            return
        out = await self._command(
            "export", str(self._run.folder.path), "--for", target, "--language", self._session.language
        )
        if out is not None:
            ui.download.content(out, f"{self._run.name}.{target}{self._exports[target].suffix}")

    async def _report(self) -> None:
        language = self._session.language
        if await self._command("report", str(self._run.folder.path), "--language", language) is None:
            return
        for path in sorted(self._run.folder.path.glob(f"report*{language}*")) or sorted(
            self._run.folder.path.glob("report*")
        ):
            ui.download.file(Path(path), f"{self._run.name}-{path.name}")

    async def _command(self, *arguments: str) -> bytes | None:
        """Return what a command of motorbench prints; what it refuses is shown."""
        process = await asyncio.create_subprocess_exec(
            sys.executable,
            "-P",
            "-m",
            "motorbench",
            *arguments,
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.PIPE,
        )
        out, errors = await process.communicate()
        if process.returncode != 0:
            self._complain(errors.decode("utf-8", "replace").strip().removeprefix("motorbench: "))
            return None
        return out

    def _complain(self, words: str) -> None:
        close = {"label": self._reader.say(text("Close")), "color": "white"}
        ui.notify(words, type="negative", position="top", timeout=0, actions=[close], multi_line=True)
