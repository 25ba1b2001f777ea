"""The line's page while no batch is in progress: the plans, who measures, and how to make a first plan."""

import re
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from pathlib import Path

from nicegui import run as background
from nicegui import ui

from bench.eol.line.batch_log import batches_broken_off
from bench.eol.plan_name import plan_name
from bench.i18n.errors import InputError
from bench.panel.child_command import child_command
from bench.panel.launch import BatchOrder
from bench.panel.pages.parts import expansion, named
from bench.panel.pages.reader import Reader
from bench.panel.panel import Panel
from bench.panel.server.sessions import Session
from bench.station.station_file import VIRTUAL
from drivers.interfaces.text import Text, text, text_of

_SOCKETS = 4
#: So many batches that were broken off are named, those that were written last.
_BROKEN_OFF = 3


@dataclass(frozen=True)
class _Offered:
    """A plan's file: its name, and what is in it or why it cannot begin."""

    path: Path
    name: str
    about: Text
    usable: bool


class LineStart:
    """The card that begins a batch; `begun` is called once one goes on."""

    def __init__(self, panel: Panel, session: Session, reader: Reader, begun: Callable[[], None]) -> None:
        self._panel, self._session, self._reader = panel, session, reader
        self._begun = begun
        self._chosen: Path | None = None
        self._cards: dict[Path, ui.element] = {}

    def build(self) -> None:
        """Build it; the plans come as soon as they are read."""
        say = self._reader.say
        ui.label(say(text("Which plan is measured today?"))).classes("text-3xl font-bold").props(
            "role=heading aria-level=1"
        )
        words = text(
            "A plan says what is measured and within which limits. After Begin a scanner is all that is needed."
        )
        ui.label(say(words)).classes("text-base")
        self._plans = named(
            ui.element("div").classes("flex flex-col gap-2").props("role=radiogroup"), say(text("Plan"))
        )
        with ui.element("div").classes("grid gap-4 grid-cols-1 md-grid-cols-2"):
            self._name = ui.input(say(text("Operator's name")), value=self._session.person).props("outlined")
            self._name.set_enabled(not self._session.logged_in)
            self._batch = ui.input(say(text("Batch (the plan's name where empty)"))).props("outlined")
        self._sockets: ui.number | None = None
        if self._panel.station == VIRTUAL:
            self._sockets = ui.number(say(text("Virtual sockets")), value=_SOCKETS, min=1, max=16, precision=0)
            self._sockets.props("outlined")
        for field in (self._batch, self._name):
            field.on("keydown.enter", self._begin)
        begin = ui.button(say(text("Begin")), on_click=self._begin, color=None)
        begin.classes("mb-go text-2xl px-12 py-4 mt-2").props("no-caps")
        self._fault = ui.label().props("role=alert").classes("text-lg whitespace-pre-line mb-refused")
        self._said = ui.label().props("role=status").classes("text-lg")
        self._broken_off = ui.label().classes("mb-told text-lg")
        self._build_making()
        ui.timer(0.01, self._read, once=True)

    async def _read(self) -> None:
        offered = await background.io_bound(_offered, self._panel.plans) or []
        usable = [each.path for each in offered if each.usable]
        if self._chosen not in usable:
            self._chosen = usable[0] if len(usable) == 1 else None
        broken_off = await background.io_bound(batches_broken_off, self._panel.runs) or []
        self._broken_off.set_visibility(bool(broken_off))
        words = text(
            "Broken off and not begun again: batch {names}. With its plan and its name a batch goes on.",
            names=broken_off[:_BROKEN_OFF],
        )
        if (more := len(broken_off) - _BROKEN_OFF) > 0:
            words = text(
                "{words} Earlier ones, not named here: {count}. motorbench eol close lists and closes them.",
                words=words,
                count=more,
            )
        self._broken_off.set_text(self._reader.say(words))
        self._plans.clear()
        self._cards.clear()
        with self._plans:
            for each in offered:
                self._card(each)
            if not offered:
                words = text("There is no plan yet in {folder}. Make one below, from a measured motor.")
                ui.label(self._reader.say(Text(words.template, {"folder": str(self._panel.plans)}))).classes(
                    "text-base"
                )

    def _card(self, each: _Offered) -> None:
        say = self._reader.say
        card = TextButton(on_click=lambda: self._choose(each.path)) if each.usable else ui.element("div")
        card.classes("mb-plan-card").props("role=radio")
        card.props["aria-checked"] = "true" if each.path == self._chosen else "false"
        named(card, each.name)
        if not each.usable:
            card.props("aria-disabled=true")
        with card:
            ui.label(each.name if each.usable else f"⚠ {each.name}").classes("text-lg font-semibold")
            ui.label(say(each.about)).classes("text-base whitespace-pre-line")
        self._cards[each.path] = card

    def _choose(self, path: Path) -> None:
        self._chosen = path
        for other, card in self._cards.items():
            card.props["aria-checked"] = "true" if other == path else "false"
            card.update()

    async def _begin(self) -> None:
        say = self._reader.say
        # A hidden button is still one that a program can press.
        if not self._session.may_lead:
            return
        if self._chosen is None:
            self._fault.set_text(say(text("Choose a plan.")))
            return
        self._session.call(str(self._name.value or ""))
        self._fault.set_text("")
        self._said.set_text(say(text("Starting …")))
        order = BatchOrder(
            str(self._chosen),
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
        self._begun()

    # a first plan

    def _build_making(self) -> None:
        say = self._reader.say
        with expansion(say(text("Make a plan from a measured motor …"))):
            words = text("Its procedures become the plan's, and what was found the middle of the limits.")
            ui.label(say(words)).classes("text-base mb-2")
            with ui.row().classes("items-end gap-3"):
                self._run = ui.select([], label=say(text("Run"))).props("outlined").classes("w-96")
                self._percent = ui.number(say(text("Limits, ± %")), value=10, min=0.1, max=100).props("outlined")
                ui.button(say(text("Make the plan")), on_click=self._make).props("outline no-caps")
        ui.timer(0.05, self._offer_runs, once=True)

    async def _offer_runs(self) -> None:
        runs = await background.io_bound(self._panel.archive.list) or []
        measured = [run for run in runs if run.status == "completed" and run.figures]
        self._run.set_options(
            {
                run.name: " · ".join(part for part in (run.motor, run.serial_number, run.name) if part)
                for run in measured
            }
        )

    async def _make(self) -> None:
        name = self._run.value
        if not name:
            self._fault.set_text(self._reader.say(text("Choose a measured motor's run.")))
            return
        motor = next(run.motor for run in self._panel.archive.list() if run.name == name)
        path = self._panel.plans / plan_name(motor)
        _, refused = await child_command(
            *("eol", "plan", str(self._panel.runs / name), "--output", str(path)),
            *("--percent", str(self._percent.value or 10), "--language", self._session.language),
        )
        self._fault.set_text(refused)
        if not refused:
            self._chosen = path
            await self._read()


class TextButton(ui.element):
    """A button that holds whatever stands in it."""

    def __init__(self, on_click: Callable[[], Awaitable[None] | None]) -> None:
        super().__init__("button")
        self.props("type=button").on("click", lambda: on_click())


def _offered(folder: Path) -> list[_Offered]:
    """Return the plans of a folder with what is in them. Reads files: not for an event loop."""
    return [_about(path) for path in sorted(folder.glob("*.toml")) if _is_plan(path)]


def _about(path: Path) -> _Offered:
    # A panel without a line need not load what reads plans.
    from bench.eol.plan import load_plan
    from bench.eol.plans_beside import check_name

    try:
        plan = load_plan(path)
        check_name(plan)
    except InputError as error:
        return _Offered(path, path.stem, text("Cannot begin: {reason}", reason=text_of(error)), usable=False)
    words = text("limits: {limits} · procedures: {procedures}", limits=len(plan.limited), procedures=len(plan.checks))
    return _Offered(path, plan.name, words, usable=True)


def _is_plan(path: Path) -> bool:
    """Return whether a file is meant as a plan; its errors are shown beside it."""
    return re.search(r"^\[plan\]", path.read_text(encoding="utf-8", errors="replace"), re.MULTILINE) is not None
