"""The end of line on one page: scan to start, a tile for each socket, the counters of the shift."""

from collections.abc import Mapping, Sequence
from typing import Any

from nicegui import events, ui

from bench.journal.stored_result import restore_text
from bench.panel.live.live_line import BatchLine
from bench.panel.pages.ended_session import offer_abort
from bench.panel.pages.frame import frame
from bench.panel.pages.line.batch_list import BatchList
from bench.panel.pages.line.counters import Counters
from bench.panel.pages.line.course import Course
from bench.panel.pages.line.start import LineStart
from bench.panel.pages.line.state import LineStateRow
from bench.panel.pages.line.tile import Tile
from bench.panel.pages.parts import late_note
from bench.panel.pages.reader import Reader
from bench.panel.panel import Panel
from bench.panel.server.sessions import Session
from drivers.interfaces.text import Text, text

#: How often (s) a page looks whether the line has changed.
_LOOK = 0.05
#: The field is emptied where it is filled: a scanner is at the next number before the server has heard of this one.
_TAKE = "(e) => { const serial = e.target.value; e.target.value = ''; e.target.dispatchEvent(new Event('input')); emit(serial); }"


def line_page(panel: Panel, session: Session, batch: str = "") -> None:
    """Build the page, of the `batch` that was chosen if there are several."""
    with frame(panel, session, text("Line"), "/line") as reader:
        page = _LinePage(panel, session, reader, batch)
        page.build()
        ui.timer(_LOOK, page.look)


class _LinePage:
    def __init__(self, panel: Panel, session: Session, reader: Reader, chosen: str) -> None:
        self._panel, self._session, self._reader = panel, session, reader
        self._chosen = chosen
        self._seen: list[tuple[BatchLine, int, bool]] | None = None
        self._tiles: dict[str, Tile] = {}
        self._refused = ""

    def build(self) -> None:
        say = self._reader.say
        self._batches = BatchList(self._reader)
        self._elsewhere = ui.label().classes("text-lg mb-4 max-w-4xl w-full mx-auto").props("role=status")
        self._start = ui.element("section").classes(
            "mb-card mb-4 max-w-4xl w-full mx-auto flex flex-col flex-nowrap gap-3"
        )
        with self._start:
            LineStart(self._panel, self._session, self._reader, self._begun).build()
        self._work = ui.element("div").classes("w-full flex flex-col flex-nowrap gap-4")
        with self._work:
            with ui.element("div").classes("mb-line-head"):
                self._state = LineStateRow(self._reader, self._stop)
                self._band = ui.element("div").classes("mb-line-top")
                with self._band:
                    self._message = ui.label().classes("mb-line-said").props("role=status")
                    self._scan = ui.input(say(text("Scan a serial number"))).props(
                        "outlined dense autofocus autocomplete=off data-scan"
                    )
                    self._scan.classes("mb-scan").on("keydown.enter", self._scanned, js_handler=_TAKE)
                    self._end = ui.button(say(text("Finish the batch")), on_click=self._finish, color=None)
                    self._end.classes("text-lg").props("unelevated no-caps").style("background:#fff;color:#0b4fa0")
            late_note(self._reader)
            self._again = ui.button(on_click=self._test_again).props("outline no-caps").classes("text-lg")
            self._records = ui.label().classes("mb-records text-lg rounded-lg px-4 py-3 w-full whitespace-pre-line")
            self._records.props("role=alert").style("background:#fff4e0;color:#6b3d00")
            self._grid = ui.element("div").classes("grid gap-4 grid-cols-1 md-grid-cols-2 xl-grid-cols-4 w-full")
            with ui.element("div").classes("mb-line-below"):
                self._counters = Counters(self._reader)
                self._reasons = ui.element("section").classes("mb-card")
                self._course = Course(self._panel.records, self._reader)
        offer_abort(self._aborted, self._state.stop, ui.keyboard(on_key=self._key, repeating=False, ignore=[]))
        self.look()

    def look(self) -> None:
        """Show what has changed since the last look."""
        line, batch = self._panel.line, self._batch
        known = [*line.running, *line.broken_off]
        seen = [(each, each.changes, each.alive) for each in (*known, *([batch] if batch else []))]
        if seen == self._seen:
            for tile in self._tiles.values():
                tile.tick()
            return
        self._seen = seen
        running = batch is not None and batch.alive
        self._start.set_visibility(not running and self._session.may_lead)
        self._batches.show(known, batch)
        self._elsewhere.set_visibility(bool(self._chosen) and batch is None)
        if self._chosen and batch is None:
            words = text("Batch {name} is not running at this station.", name=self._chosen)
            self._elsewhere.set_text(self._reader.say(words))
        self._work.set_visibility(batch is not None and batch.state is not None)
        if batch is not None and batch.state is not None:
            self._state.show(batch.state, running=running, alone=len(line.running) < 2)
            self._show(batch.state, running=running, broken_off=batch.broken_off)

    @property
    def _batch(self) -> BatchLine | None:
        return self._panel.line.shown(self._chosen)

    async def _tell(self, message: Mapping[str, Any]) -> Text | None:
        """Say something to the batch that is shown; return why it was refused, or None."""
        batch = self._batch
        return text("no batch is running") if batch is None else await batch.say(message)

    def _show(self, state: Mapping[str, Any], *, running: bool, broken_off: bool) -> None:
        scans = bool(state.get("scans", True))
        self._end.set_visibility(running and scans)
        self._scan.set_visibility(scans)
        self._scan.set_enabled(running and self._session.may_lead and not state["ending"])
        if [socket["name"] for socket in state["sockets"]] != list(self._tiles):
            self._grid.clear()
            with self._grid:
                self._tiles = {
                    socket["name"]: Tile(self._reader, socket["name"], self._panel.offer.title)
                    for socket in state["sockets"]
                }
        for socket in state["sockets"]:
            self._tiles[socket["name"]].show(socket, running=running, scans=scans)
        self._show_message(state, running=running, broken_off=broken_off)
        self._show_records(state.get("records") or {}, state.get("notes", ()))
        self._counters.show(state)
        self._course.wanted(state)
        self._why(state["counts"].get("reworks", {}))

    def _why(self, reworks: Mapping[str, int]) -> None:
        """Show how many motors failed by which part, the most frequent first."""
        self._reasons.set_visibility(bool(reworks))
        self._reasons.clear()
        say = self._reader.say
        with self._reasons:
            ui.label(say(text("Why motors failed"))).classes("text-base font-semibold")
            for code, count in sorted(reworks.items(), key=lambda item: (-item[1], item[0])):
                with ui.row().classes("w-full justify-between gap-8"):
                    ui.label(code or say(text("no part named"))).classes("text-base")
                    ui.label(str(count)).classes("text-base font-semibold")

    def _show_message(self, state: Mapping[str, Any], *, running: bool, broken_off: bool) -> None:
        say, message, scans = self._reader.say, state["message"], state.get("scans", True)
        wrong = False
        if not running and any(socket["serial_number"] for socket in state["sockets"]):
            words, wrong = (
                say(text("The batch was cut off. Begin it again: it goes on with the motors in the sockets.")),
                True,
            )
        elif broken_off:
            words = say(
                text("The batch was broken off between two motors; no record is lost. Begin it again: it goes on.")
            )
            wrong = True
        elif not running:
            words = say(text("The batch has ended."))
            if message is not None and message["kind"] == "trouble":
                words, wrong = f"{words} ✗ {say(restore_text(message['text']))}", True
        elif state["ending"]:
            words = say(text("The batch ends: {how}", how=restore_text(state["ending"])))
        elif not scans and (message is None or message["kind"] == "begun"):
            words = say(text("Serial numbers come from where the batch was begun."))
        elif message is None and state["waiting"]:
            words = say(text("Scanned: {count}. The sockets are being made ready.", count=state["waiting"]))
        elif message is None:
            words = say(text("Scan the first motor."))
        elif message["kind"] == "begun" and not _stands(state, message):
            words = say(text("Scan the next motor."))
        elif message["kind"] == "begun":
            words = say(text("{serial} → socket {socket}", serial=message["words"], socket=message["socket"]))
        else:
            words, wrong = f"✗ {say(restore_text(message['text']))}", True
        self._say(words, wrong=wrong)
        refused = str((message or {}).get("again") or "") if running and scans and not state["ending"] else ""
        self._again.set_visibility(bool(refused) and self._session.may_lead)
        self._refused = refused
        self._again.set_text(
            say(text("Test {serial} again: {person} answers for it", serial=refused, person=self._person()))
        )

    async def _test_again(self) -> None:
        """Have the person at this page answer for the motor that was refused last."""
        if not self._refused or not self._leads():
            return
        if not self._session.person:
            self._say(
                self._reader.say(text("A person who has a motor tested again gives a name when the batch is begun.")),
                wrong=True,
            )
            return
        fault = await self._tell({"serial": self._refused, "again": self._session.person})
        if fault:
            self._say(f"✗ {self._reader.say(fault)}", wrong=True)

    def _show_records(self, records: Mapping[str, Any], notes: Sequence[Any]) -> None:
        """Show which records are not where they belong, and why; and what else is to be known."""
        told = (*records.get("sentences", ()), *notes)
        words = "\n".join(self._reader.say(restore_text(one)) for one in told)
        self._records.set_visibility(bool(words))
        self._records.set_text(words)

    def _say(self, words: str, *, wrong: bool) -> None:
        self._message.set_text(words)
        self._message.props["data-said"] = "wrong" if wrong else ""
        self._band.props["data-wrong"] = "true" if wrong else "false"

    async def _scanned(self, event: events.GenericEventArguments) -> None:
        serial = str(event.args or "").strip()
        if not serial:
            return
        if not self._leads():
            return
        fault = await self._tell({"serial": serial})
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
        if self._leads() and (fault := await self._tell({"finish": self._person()})):
            self._say(f"✗ {self._reader.say(fault)}", wrong=True)

    async def _aborted(self) -> Text | None:
        return await self._tell({"stop": self._person()})

    async def _stop(self) -> None:
        fault = await self._aborted()
        if fault:
            self._say(f"✗ {self._reader.say(fault)}", wrong=True)

    async def _key(self, event: events.KeyEventArguments) -> None:
        key: Any = event.key
        if not event.action.keydown or not event.modifiers.ctrl or self._batch is None or not self._batch.alive:
            return
        if key.escape:
            await self._stop()
        elif key.end:
            await self._finish()

    def _begun(self) -> None:
        # It is the one that is scanned for.
        self._chosen = ""
        self._panel.control.take(self._session.token, self._person())
        ui.run_javascript("document.querySelector('.mb-scan input').focus()")


def _stands(state: Mapping[str, Any], begun: Mapping[str, Any]) -> bool:
    """Return whether the motor that a message says to put in is still in its socket, not judged yet."""
    return any((one["name"], one["serial_number"]) == (begun["socket"], begun["words"]) for one in state["sockets"])
