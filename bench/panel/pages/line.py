"""The end of line on one page: scan to start, a tile for each socket, the counters of the shift."""

import re
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

from nicegui import events, ui

from bench.i18n.errors import InputError
from bench.journal.stored_result import restore_text
from bench.panel.launch import BatchOrder
from bench.panel.pages.ended_session import offer_abort
from bench.panel.pages.frame import frame
from bench.panel.pages.line_tile import VERDICTS, Tile
from bench.panel.pages.parts import named
from bench.panel.pages.reader import Reader
from bench.panel.panel import Panel
from bench.panel.sessions import Session
from bench.station.station_file import VIRTUAL
from drivers.interfaces.text import Text, text

#: How often (s) a page looks whether the line has changed.
_LOOK = 0.05
_SOCKETS = 4
_STYLE = """
<style>
  .mb-tile { border-radius: 12px; padding: 1rem 1.25rem; min-height: 15rem; border: 4px solid var(--line); background: var(--card); }
  .mb-tile .verdict { font-size: 4.5rem; line-height: 1.05; font-weight: 800; }
  .mb-tile[data-state=pass] { background: #0b6b3a; border-color: #0b6b3a; color: #fff; }
  .mb-tile[data-state=fail] { background: #b3261e; border-color: #b3261e; color: #fff; }
  .mb-tile[data-state=error], .mb-tile[data-state=aborted] { background: #fff; border: 8px dashed #b3261e; color: #7a130d; }
  .mb-tile[data-state=measuring] { border-color: #1565c0; }
  .mb-count { font-size: 2rem; font-weight: 700; font-variant-numeric: tabular-nums; }
  .mb-scan input { font-size: 2rem; }
</style>
"""
#: The field is emptied where it is filled: a scanner is at the next number before the server has heard of this one.
_TAKE = "(e) => { const serial = e.target.value; e.target.value = ''; e.target.dispatchEvent(new Event('input')); emit(serial); }"
_RETURN = (
    "document.addEventListener('keydown', e => {"
    "const field = document.querySelector('.mb-scan input');"
    "if (field && field.offsetParent && e.key.length === 1 && !e.ctrlKey && document.activeElement.tagName !== 'INPUT')"
    "field.focus();});"
)


def line_page(panel: Panel, session: Session) -> None:
    """Build the page."""
    with frame(panel, session, text("Line"), "/line") as reader:
        ui.add_head_html(_STYLE)
        page = _LinePage(panel, session, reader)
        page.build()
        ui.timer(_LOOK, page.look)


class _LinePage:
    def __init__(self, panel: Panel, session: Session, reader: Reader) -> None:
        self._panel, self._session, self._reader = panel, session, reader
        self._seen: tuple[int, bool] | None = None
        self._tiles: dict[str, Tile] = {}

    def build(self) -> None:
        say = self._reader.say
        self._start = ui.element("section").classes("mb-card mb-4 max-w-3xl flex flex-col flex-nowrap gap-3")
        with self._start:
            self._build_start()
        self._work = ui.element("div").classes("w-full flex flex-col flex-nowrap gap-4")
        with self._work:
            with ui.row().classes("w-full items-center gap-4 no-wrap"):
                self._scan = ui.input(say(text("Scan a serial number"))).props("outlined autofocus autocomplete=off")
                self._scan.classes("grow mb-scan").on("keydown.enter", self._scanned, js_handler=_TAKE)
                self._end = ui.button(say(text("Finish the batch")), on_click=self._finish).props("outline no-caps")
                self._end.classes("text-lg")
                self._abort = ui.button(say(text("ABORT")), on_click=self._stop, color=None)
                named(self._abort.classes("mb-abort text-xl px-8"), say(text("Abort the batch: everything off")))
                ui.tooltip(say(text("Every socket shuts down. Key: Ctrl+Esc. Finish: Ctrl+End")))
            self._message = ui.label().classes("text-2xl rounded-lg px-4 py-3 w-full").props("role=status")
            self._records = ui.label().classes("mb-records text-lg rounded-lg px-4 py-3 w-full whitespace-pre-line")
            self._records.props("role=alert").style("background:#fff4e0;color:#6b3d00")
            self._counters = ui.row().classes("w-full gap-8 items-baseline")
            self._grid = ui.element("div").classes("grid gap-4 grid-cols-1 md-grid-cols-2 xl-grid-cols-4 w-full")
        offer_abort(self._aborted, self._abort, ui.keyboard(on_key=self._key, repeating=False, ignore=[]))
        # A scanner types wherever the cursor is: it comes back to the field by itself.
        ui.run_javascript(_RETURN)
        self.look()

    def look(self) -> None:
        """Show what has changed since the last look."""
        line = self._panel.line
        seen = (line.changes, line.running)
        if seen == self._seen:
            for tile in self._tiles.values():
                tile.tick()
            return
        self._seen = seen
        self._start.set_visibility(not line.running and self._session.may_lead)
        self._work.set_visibility(line.state is not None)
        if line.state is not None:
            self._show(line.state, running=line.running)

    def _show(self, state: Mapping[str, Any], *, running: bool) -> None:
        say = self._reader.say
        for button in (self._end, self._abort):
            button.set_visibility(running)
        self._scan.set_enabled(running and self._session.may_lead and not state["ending"])
        if [socket["name"] for socket in state["sockets"]] != list(self._tiles):
            self._grid.clear()
            with self._grid:
                self._tiles = {socket["name"]: Tile(self._reader, socket["name"]) for socket in state["sockets"]}
        for socket in state["sockets"]:
            self._tiles[socket["name"]].show(socket)
        self._show_message(state, running=running)
        self._show_records(state.get("records") or {})
        self._counters.clear()
        counts = state["counts"]
        motors = sum(counts["verdicts"].values())
        with self._counters:
            self._count(text("Motors"), str(motors))
            for verdict, (mark, words) in VERDICTS.items():
                self._count(words, f"{mark} {counts['verdicts'][verdict]}")
            if motors:
                self._count(text("First-pass yield"), f"{100.0 * counts['first_pass'] / motors:.1f} %")
            self._count(text("Waiting"), str(state["waiting"]))
            ui.label(
                say(
                    text(
                        "batch {batch}, plan {plan}, since {time}",
                        batch=state["batch"],
                        plan=state["plan"],
                        time=_local(counts["since"]),
                    )
                )
            ).classes("text-base")

    def _count(self, what: Text, number: str) -> None:
        with ui.element("div") as box:
            box.props["data-count"] = what.template
            ui.label(self._reader.say(what)).classes("text-sm")
            ui.label(number).classes("mb-count")

    def _show_message(self, state: Mapping[str, Any], *, running: bool) -> None:
        say, message = self._reader.say, state["message"]
        wrong = False
        if not running:
            words = say(text("The batch has ended."))
        elif state["ending"]:
            words = say(text("The batch ends: {how}", how=restore_text(state["ending"])))
        elif message is None:
            words = say(text("Scan the first motor."))
        elif message["kind"] == "begun":
            words = say(text("{serial} → socket {socket}", serial=message["words"], socket=message["socket"]))
        else:
            words, wrong = f"✗ {say(restore_text(message['text']))}", True
        self._say(words, wrong=wrong)

    def _show_records(self, records: Mapping[str, Any]) -> None:
        """Show which records are not where they belong, and why."""
        words = "\n".join(self._reader.say(restore_text(told)) for told in records.get("sentences", ()))
        self._records.set_visibility(bool(words))
        self._records.set_text(words)

    def _say(self, words: str, *, wrong: bool) -> None:
        self._message.set_text(words)
        self._message.style("background:#fdecea;color:#7a130d" if wrong else "background:#e7f4ec;color:#0b4a28")

    async def _scanned(self, event: events.GenericEventArguments) -> None:
        serial = str(event.args or "").strip()
        if not serial:
            return
        if not self._leads():
            return
        fault = await self._panel.line.say({"serial": serial})
        if fault:
            self._say(f"✗ {self._reader.say(fault)}", wrong=True)

    def _leads(self) -> bool:
        session = self._session
        if session.may_lead and self._panel.control.take_if_free(session.token, self._person()):
            return True
        self._say(self._reader.say(text("Another has the control: take it first.")), wrong=True)
        return False

    def _person(self) -> str:
        return self._session.person or self._reader.say(text("this browser"))

    async def _finish(self) -> None:
        if self._leads():
            await self._panel.line.say({"finish": self._person()})

    async def _aborted(self) -> Text | None:
        return await self._panel.line.say({"stop": self._person()})

    async def _stop(self) -> None:
        fault = await self._aborted()
        if fault:
            self._say(f"✗ {self._reader.say(fault)}", wrong=True)

    async def _key(self, event: events.KeyEventArguments) -> None:
        key: Any = event.key
        if not event.action.keydown or not event.modifiers.ctrl or not self._panel.line.running:
            return
        if key.escape:
            await self._stop()
        elif key.end:
            await self._finish()

    # before a batch

    def _build_start(self) -> None:
        say = self._reader.say
        ui.label(say(text("Begin a batch"))).classes("text-xl font-bold mb-2")
        plans = {str(path): path.stem for path in sorted(self._panel.plans.glob("*.toml")) if _is_plan(path)}
        self._plan = ui.select(plans, label=say(text("Plan"))).props("outlined").classes("w-full")
        if len(plans) == 1:
            self._plan.set_value(next(iter(plans)))
        if not plans:
            ui.label(say(text("No plan in {folder}; see --plans.", folder=str(self._panel.plans)))).classes("text-base")
        self._batch = ui.input(say(text("Batch (the plan's name where empty)"))).props("outlined").classes("w-full")
        self._name = ui.input(say(text("Operator's name")), value=self._session.person).props("outlined")
        self._name.classes("w-full")
        self._sockets: ui.number | None = None
        if self._panel.station == VIRTUAL:
            self._sockets = ui.number(say(text("Virtual sockets")), value=_SOCKETS, min=1, max=16, precision=0)
            self._sockets.props("outlined").classes("w-full")
        for field in (self._batch, self._name):
            field.on("keydown.enter", self._begin)
        ui.button(say(text("Begin")), on_click=self._begin, color=None).classes("mb-go text-2xl px-12 py-4 mt-2")
        self._fault = ui.label().props("role=alert").classes("text-lg whitespace-pre-line").style("color:#7a130d")
        self._said = ui.label().props("role=status").classes("text-lg")

    async def _begin(self) -> None:
        say = self._reader.say
        # A hidden button is still one that a program can press.
        if not self._session.may_lead:
            return
        if not self._plan.value:
            self._fault.set_text(say(text("Choose a plan.")))
            return
        self._session.person = str(self._name.value or "").strip() or self._session.person
        self._fault.set_text("")
        self._said.set_text(say(text("Starting …")))
        order = BatchOrder(
            str(Path(self._plan.value)),
            self._panel.station,
            str(self._batch.value or "").strip(),
            self._session.person,
            self._panel.records,
            self._session.language,
            int(self._sockets.value or _SOCKETS) if self._sockets is not None else None,
        )
        try:
            await self._panel.start_batch(order)
        except (InputError, TimeoutError) as error:
            self._fault.set_text(self._reader.fault(error))
            return
        finally:
            self._said.set_text("")
        self._panel.control.take(self._session.token, self._person())
        ui.run_javascript("document.querySelector('.mb-scan input').focus()")


def _is_plan(path: Path) -> bool:
    """Whether a file is meant as a plan; what is wrong in it is said when the batch is begun."""
    return re.search(r"^\[plan\]", path.read_text(encoding="utf-8", errors="replace"), re.MULTILINE) is not None


def _local(time: str) -> str:
    return datetime.fromisoformat(time).astimezone().strftime("%H:%M")
