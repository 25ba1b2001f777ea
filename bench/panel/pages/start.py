"""Choose motor and procedures, see that the station is ready, begin."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

from nicegui import ui

from bench.i18n.errors import InputError
from bench.motor.shipped_motors import shipped_motors
from bench.panel.launch import Order
from bench.panel.offer import Offered, named_roles, rehearse
from bench.panel.pages.frame import frame
from bench.panel.pages.motor_form import motor_files
from bench.panel.pages.parts import kept, late_note
from bench.panel.pages.reader import Reader
from bench.panel.pages.settings_part import SettingsPart
from bench.panel.pages.station_part import StationPart
from bench.panel.panel import Panel
from bench.panel.server.sessions import Session
from bench.station.station_file import VIRTUAL
from drivers.interfaces.text import Text, text
from reports.labels import role_name, section_name

#: Roles that the virtual bench in process does without: its hands do what a fixture would.
_NOT_VIRTUAL = frozenset({"switch_matrix", "rotor_actuator", "insulation_tester"})
_TO_LIST = "document.querySelector('.mb-procedures [role=checkbox]:not([aria-disabled=true])')?.focus()"
_LIST = 'document.querySelector(".mb-procedures").inert'
_HOLD = "() => { " + _LIST + " = true; emit(); }"
_RELEASE = _LIST + " = false"


def start_page(panel: Panel, session: Session, motor: str = "", as_before: str = "") -> None:
    """Build the page; `motor` is the name of the motor file that is chosen already, `as_before` that of a run whose type and
    procedures are.
    """
    with frame(panel, session, text("Measure"), "/") as reader:
        _StartPage(panel, session, reader, motor, as_before).build()


class _StartPage:
    def __init__(self, panel: Panel, session: Session, reader: Reader, motor: str, as_before: str) -> None:
        self._panel = panel
        self._session = session
        self._reader = reader
        self._chosen = motor
        self._before = _beginning(panel, as_before) if as_before else {}
        self._planned = frozenset(map(str, self._before.get("procedures", ())))
        self._boxes: dict[str, ui.checkbox] = {}
        self._notes: dict[str, ui.label] = {}
        self._roles = None if panel.station == VIRTUAL else named_roles(Path(panel.station))
        self._offered: Mapping[str, Offered] = {}

    def build(self) -> None:
        say = self._reader.say
        self._running()
        with ui.element("div").classes("grid gap-4 grid-cols-1 lg-grid-cols-3"):
            with ui.element("section").classes("mb-card"):
                ui.label(say(text("1  Motor"))).classes("text-xl font-bold mb-2").props("role=heading aria-level=2")
                asked = text("Serial number (scan or type)")
                self._serial = kept(ui.input(say(asked)).props("outlined autofocus data-scan"), asked)
                self._serial.classes("w-full mb-3")
                late_note(self._reader)
                self._motor = ui.select(
                    self._motors(), label=say(text("Motor type")), on_change=self._motor_chosen
                ).props("outlined")
                self._motor.classes("w-full")
                known = {Path(path).stem: path for path in motor_files(self._panel.motors)}
                if self._chosen in known:
                    self._motor.set_value(known[self._chosen])
                source = str((self._before.get("motor") or {}).get("source", ""))
                if source in self._motors():
                    self._motor.set_value(source)
                if self._session.may_change:
                    ui.button(say(text("New motor …")), on_click=lambda: ui.navigate.to("/motor")).props(
                        "flat no-caps dense"
                    )
                self._person = (
                    ui.input(say(text("Operator's name")), value=self._session.person)
                    .props("outlined")
                    .classes("w-full mt-2")
                )
                self._person.set_enabled(not self._session.logged_in)
                self._serial.on("keydown.enter", self._begin)
            with ui.element("section").classes("mb-card"):
                ui.label(say(text("2  Procedures"))).classes("text-xl font-bold mb-2").props(
                    "role=heading aria-level=2"
                )
                self._lacking = ui.label().classes("mb-wrong").props("role=alert")
                self._list = ui.element("div").classes("flex flex-col flex-nowrap mb-procedures")
                with self._list:
                    ui.spinner(size="2rem")
                self._hold_list()
                self._settings = SettingsPart(self._reader, map(str, self._before.get("settings", ())))
            with ui.element("section").classes("mb-card"):
                ui.label(say(text("3  Station"))).classes("text-xl font-bold mb-2").props("role=heading aria-level=2")
                StationPart(self._panel, self._session, self._reader, self._checked).build()
        with ui.element("div").classes("mb-act mb-begin"):
            self._hand = ui.button(say(text("Use the instruments by hand")), on_click=self._begin_by_hand)
            self._hand.props("outline no-caps").set_enabled(False)
            self._try = ui.button(say(text("Rehearse")), on_click=self._rehearse).props("outline no-caps")
            self._try.set_enabled(False)
            self._fault = ui.label().props("role=alert").classes("mb-act-note mb-wrong")
            self._said = ui.label().props("role=status").classes("mb-act-note")
            # Where a step's Done is.
            self._start = ui.button(say(text("Start")), on_click=self._begin, color=None).props("unelevated no-caps")
            self._start.classes("mb-b mb-done").set_enabled(False)
        ui.timer(0.01, self._fill, once=True)

    def _motors(self) -> dict[str, str]:
        """Return the motors to choose from, by what the command line calls them."""
        shipped = {name: self._reader.say(text("{name} (virtual)", name=name)) for name in shipped_motors()}
        return motor_files(self._panel.motors) | shipped

    def _running(self) -> None:
        for run in self._panel.running():
            with ui.element("section").classes("mb-card mb-4 flex items-center gap-4"):
                ui.label(self._reader.say(text("A run is in progress: {name}", name=run.name))).classes("text-lg")
                ui.button(
                    self._reader.say(text("Show it")),
                    on_click=lambda name=run.name: ui.navigate.to(f"/runs/{quote(name, safe='')}"),
                )

    async def _fill(self) -> None:
        try:
            offered = await self._panel.offer.procedures()
        except InputError as error:
            self._complain(self._reader.fault(error))
            return
        self._start.set_enabled(self._session.may_lead)
        self._hand.set_enabled(self._session.may_lead)
        self._try.set_enabled(True)
        self._offered = offered
        self._show_procedures(offered)
        self._settings.offer(offered)
        self._motor_chosen()

    def _show_procedures(self, offered: Mapping[str, Offered]) -> None:
        say = self._reader.say
        self._list.clear()
        self._boxes.clear()
        self._notes.clear()
        with self._list:
            with ui.row().classes("gap-2 mb-1"):
                ui.button(say(text("All")), on_click=lambda: self._mark(True)).props("flat dense no-caps")
                ui.button(say(text("None")), on_click=lambda: self._mark(False)).props("flat dense no-caps")
            for name, procedure in offered.items():
                if procedure.manual:
                    continue
                missing = [] if self._roles is None else sorted(set(procedure.roles) - self._roles)
                box = ui.checkbox(
                    f"{say(Text(procedure.title))} ·\u00a0{say(section_name(procedure.section))}",
                    value=not missing and (name in self._planned if self._planned else procedure.in_all),
                )
                box.props("dense").classes("text-base")
                box.on_value_change(lambda: self._lacking.set_text(""))
                needs = text("needs: {roles}", roles=[role_name(role) for role in procedure.roles])
                if missing:
                    needs = text("missing: {roles}", roles=[role_name(role) for role in missing])
                elif not procedure.roles:
                    needs = text("needs no instrument")
                # A part of the box: it is pressed with it, and read out with it.
                with box:
                    note = ui.label(say(needs)).classes("mb-missing" if missing else "mb-small")
                self._notes[name] = note
                box.set_enabled(not missing)
                self._boxes[name] = box

    def _hold_list(self) -> None:
        """Let nothing be clicked in the list, in the browser itself, from a choice of the motor until the motor's own is there."""
        # Its handler comes after that of the value, whose list is then on its way already.
        self._motor.on("update:model-value", lambda: ui.run_javascript(_RELEASE), js_handler=_HOLD)

    def _motor_chosen(self) -> None:
        """On the virtual bench the six-step drive is that of the motor's file, and hands stand in for a fixture."""
        self._motor.error = None
        if self._panel.station != VIRTUAL or not self._motor.value or not self._offered:
            return
        from bench.motor.motor_file import load_motor

        try:
            drive = load_motor(str(self._motor.value)).six_step is not None
        except InputError as error:
            self._complain(self._reader.fault(error))
            return
        roles = {role for procedure in self._offered.values() for role in procedure.roles}
        self._roles = frozenset((roles if drive else roles - {"drive"}) - _NOT_VIRTUAL)
        self._show_procedures(self._offered)

    def _checked(self, roles: frozenset[str]) -> None:
        self._roles = roles
        self._show_procedures(self._offered)

    def _mark(self, value: bool) -> None:
        """Take none, or all that `all` takes."""
        for name, box in self._boxes.items():
            if box.enabled and not (value and self._offered and not self._offered[name].in_all):
                box.set_value(value)

    async def _rehearse(self) -> None:
        """Say how long each procedure takes and what would not go well; nothing of the station is opened."""
        say = self._reader.say
        chosen = [name for name, box in self._boxes.items() if box.value]
        if self._motor_missing() or self._none_chosen():
            return
        self._tell(say(text("Rehearsing on a virtual twin …")))
        try:
            rehearsed = await rehearse(
                chosen,
                self._panel.station,
                str(self._motor.value),
                self._session.language,
                self._settings.of(chosen),
            )
        except InputError as error:
            self._complain(self._reader.fault(error))
            return
        for name, (bench, hands) in rehearsed.times.items():
            if name in self._notes:
                words = text("about {minutes:.1f} min, {hands:.0f} s of it by hand", minutes=bench / 60.0, hands=hands)
                self._notes[name].set_text(say(words))
        total = sum(bench for bench, _ in rehearsed.times.values())
        self._tell(say(text("About {minutes:.0f} min in all.", minutes=total / 60.0)))
        self._fault.set_text("\n".join(rehearsed.objections))

    def _tell(self, words: str) -> None:
        self._fault.set_text("")
        self._said.set_text(words)

    def _motor_missing(self) -> bool:
        """Say at the motor's field that it is empty, and go there; tell whether it is."""
        if self._motor.value:
            return False
        self._tell("")
        self._motor.error = self._reader.say(text("Choose the motor's type."))
        self._motor.run_method("focus")
        return True

    def _none_chosen(self) -> bool:
        """Say at the list that no procedure is chosen, and go there; tell whether none is."""
        none = not any(box.value for box in self._boxes.values())
        self._lacking.set_text(self._reader.say(text("Choose at least one procedure.")) if none else "")
        if none:
            self._tell("")
            ui.run_javascript(_TO_LIST)
        return none

    def _complain(self, words: str) -> None:
        self._fault.set_text(words)
        self._said.set_text("")

    async def _begin(self) -> None:
        # Enter in the serial number's field comes here too.
        if not self._start.enabled:
            return
        chosen = [name for name, box in self._boxes.items() if box.value]
        if self._motor_missing() or self._none_chosen():
            return
        await self._order(chosen)

    async def _begin_by_hand(self) -> None:
        """Begin the run in which the instruments are commanded one by one."""
        by_hand = [name for name, procedure in self._offered.items() if procedure.manual][:1]
        if by_hand and self._hand.enabled and not self._motor_missing():
            await self._order(by_hand)

    async def _order(self, chosen: list[str]) -> None:
        """Start a run of the procedures that are chosen."""
        say = self._reader.say
        self._session.call(str(self._person.value or ""))
        self._tell(say(text("Starting …")))
        # A second click would start a second run.
        self._start.set_enabled(False)
        self._hand.set_enabled(False)
        order = Order(
            chosen,
            self._panel.station,
            str(self._motor.value),
            self._session.person,
            self._session.language,
            settings=self._settings.of(chosen),
            serial_number=str(self._serial.value or "").strip(),
        )
        try:
            run = await self._panel.start(order)
        except (InputError, TimeoutError) as error:
            self._start.set_enabled(True)
            self._hand.set_enabled(True)
            self._complain(self._reader.fault(error))
            return
        self._panel.control.take(self._session.token, self._session.person)
        ui.navigate.to(f"/runs/{quote(run.name, safe='')}")


def _beginning(panel: Panel, run: str) -> Mapping[str, Any]:
    """Return how a run of the panel's folder began; nothing where there is no such run."""
    return next(iter(panel.beginning(run)), {}) if run in {each.name for each in panel.archive.list()} else {}
