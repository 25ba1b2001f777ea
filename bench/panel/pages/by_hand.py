"""The instruments by hand: what can be commanded as a form, and what is on with what switches it off."""

from collections.abc import Awaitable, Callable, Mapping
from functools import partial
from typing import Any

from nicegui import ui

from bench.by_hand.commands import ArgumentKind, Command, CommandArgument, commands_of
from bench.by_hand.hand_work import OWNERS, PLAIN
from bench.by_hand.look_over import probe_words
from bench.by_hand.outcome import kept_words
from bench.by_hand.values import range_of, spoken
from bench.by_hand.words import called, command_words
from bench.journal.stored_result import restore_text
from bench.operators.typed import typed_number
from bench.panel.pages.parts import kept, named, table
from bench.panel.pages.reader import Reader
from drivers.interfaces import ProbeKind, Role
from drivers.interfaces.declarations import Effect
from drivers.interfaces.text import Text, text, word
from procedures.core.actions import SOCKET_NAMES, YES, FittedProbe, Socket, Terminal
from procedures.core.result import ProcedureResult
from reports.labels import role_name

#: Sends a command's line to the run.
Send = Callable[[str], Awaitable[None]]
#: In the browser: what another choice takes the place of is not carried out any more, however long the server takes to show it.
_OUTDATED = "() => { document.querySelector('[data-carry-out]').inert = true; }"


def said_lines(question: Mapping[str, Any], reader: Reader) -> list[str]:
    """Return what came of the command before, a line each."""
    said = restore_text(question["said"])
    if isinstance(typed := said.values.get("typed"), str) and typed:
        said = Text(said.template, {**said.values, "typed": command_words(typed)})
    first, *others = reader.say(said).splitlines()
    return [f"⚠ {first}" if question["details"]["refused"] else first, *others]


def read_part(finished: Mapping[str, ProcedureResult], reader: Reader) -> None:
    """Build the table of what was read by hand; nothing where nothing was."""
    read = [one for result in finished.values() for one in result.findings.get("read", ())]
    if not read:
        return
    say = reader.say
    with named(ui.element("section").classes("mb-card mb-4"), say(text("Read by hand"))):
        ui.label(say(text("Read by hand"))).classes("text-lg font-semibold")
        rows = [(one["command"], say(role_name(one["instrument"])), say(kept_words(one))) for one in read]
        table([say(text("Command")), say(text("Instrument")), say(text("Reading"))], rows)


class ByHandForm:
    """The form for the next command. What was chosen and typed stays from one command to the next."""

    def __init__(self, reader: Reader) -> None:
        self._reader = reader
        self._role = ""
        self._methods: dict[str, str] = {}
        self._values: dict[str, str] = {}
        self._sockets = dict.fromkeys(Terminal, "open")
        self._connected: Mapping[Terminal, Socket] | None = None

    def offer(self, question: Mapping[str, Any], send: Send, connected: Mapping[Terminal, Socket] | None) -> None:
        """Build it for a question of the run; `connected` is what is on the motor's terminals, as far as that was said."""
        self._question, self._send = question["details"], send
        if connected != self._connected:
            # It may have been typed as well.
            self._connected = connected
            self._sockets = {one: (connected or {}).get(one, Socket.OPEN).value for one in Terminal}
        say = self._reader.say
        roles = self._question["roles"]
        self._role = self._role if self._role in roles else roles[0]
        for words in self._question["on"]:
            with ui.row().classes("items-center gap-4 mt-3 mb-state-live rounded-lg px-4 py-2 w-full"):
                ui.label(say(text("ON: {typed}", typed=command_words(words)))).classes("text-xl grow")
                off = partial(self._line, f"off {words.split()[0]}")
                ui.button(say(text("Switch off")), on_click=off, color=None).classes("mb-abort text-xl px-8 py-2")
        if self._question.get("confirms"):
            ui.button(say(text("⚡ Confirmed: switch on")), on_click=partial(self._line, YES), color=None).classes(
                "mb-abort text-xl px-10 py-4 mt-3"
            ).props("no-caps data-confirm")
        with ui.element("div").classes("grid gap-4 grid-cols-1 lg-grid-cols-3 mt-3"):
            with ui.element("section").classes("lg-col-span-2 min-w-0"):
                self._build_command(roles)
            with ui.element("section").classes("min-w-0"):
                self._build_connection(roles)
        with ui.row().classes("w-full items-end gap-4 mt-4"):
            asked = text("Or type a command; help lists them")
            line = kept(ui.input(label=say(asked)).props("outlined dense"), asked).classes("grow")
            line.on("keydown.enter", lambda: self._line(str(line.value or "")))

    def _build_command(self, roles: list[str]) -> None:
        say = self._reader.say
        names = {role: say(role_name(role)) for role in roles}
        role = ui.select(names, value=self._role, label=say(text("Instrument"))).props("outlined").classes("w-full")
        self._form = ui.element("div").classes("w-full")

        def choose() -> None:
            self._role = str(role.value)
            self._show_methods()

        role.on_value_change(choose).on("update:model-value", js_handler=_OUTDATED)
        self._show_methods()

    def _show_methods(self) -> None:
        commands = commands_of(Role(self._role))
        usual = next((name for name, one in commands.items() if one.declaration.effect is not Effect.MAKES_SAFE), "")
        method = self._methods.get(self._role, usual)
        self._form.clear()
        with self._form:
            words = {name: self._reader.say(called(name)) for name in commands}
            choice = ui.select(words, value=method, label=self._reader.say(text("What to do"))).props("outlined")
            choice.classes("w-full mt-2")

            def choose() -> None:
                self._methods[self._role] = str(choice.value)
                self._show_methods()

            choice.on_value_change(choose).on("update:model-value", js_handler=_OUTDATED)
            if self._role == Role.OSCILLOSCOPE.value:
                for probe in self._question.get("probes", ()):
                    fitted = FittedProbe(probe["channel"], ProbeKind(probe["kind"]), probe["attenuation"])
                    ui.label(self._reader.say(probe_words(fitted))).classes("text-base mt-2")
            self._show_arguments(commands[method])

    def _show_arguments(self, command: Command) -> None:
        say = self._reader.say
        fields = {argument.name: self._field(command, argument) for argument in command.arguments}

        async def carry_out() -> None:
            given = {name: str(field.value or "").strip() for name, field in fields.items()}
            self._values |= {f"{command.role.value}.{command.method}.{name}": typed for name, typed in given.items()}
            typed = [f"{one.name}={_with_unit(one, given[one.name])}" for one in command.arguments if given[one.name]]
            await self._line(" ".join([command.role.value, command.method, *typed]))

        energises = command.declaration.effect is Effect.ENERGISES
        words = text("⚡ Switch on: {what}", what=called(command.method)) if energises else called(command.method)
        button = ui.button(say(words), on_click=carry_out, color=None)
        button.classes("mb-abort" if energises else "mb-go").classes("text-xl px-10 py-4 mt-3")
        button.props("no-caps data-carry-out")

    def _field(self, command: Command, argument: CommandArgument) -> Any:
        say, key = self._reader.say, f"{command.role.value}.{command.method}.{argument.name}"
        label = say(self._labelled(argument, key))
        before = self._values.get(key, "")
        if argument.kind is ArgumentKind.CHOICE:
            words = {one.name.lower(): say(called(one.name.lower())) for one in argument.choices}
            usual = before or ("" if argument.needed else argument.default.name.lower())
            return ui.select(words, value=usual or None, label=label).props("outlined dense").classes("w-full mt-2")
        field = ui.input(label=label, value=before).props("outlined dense inputmode=decimal")
        return kept(field, word(key)).classes("w-full mt-2 text-lg")

    def _labelled(self, argument: CommandArgument, key: str) -> Text:
        largest = self._question["ranges"].get(key)
        unit = spoken(0.0, argument.unit)[1].replace("|", " / ")
        what: Text = called(argument.name)
        if largest is not None:
            what = text("{what} ({range})", what=what, range=range_of(argument, largest))
        elif unit:
            what = text("{what} ({range})", what=what, range=unit)
        return what if argument.needed else text("{what}, may be left out", what=what)

    def _build_connection(self, roles: list[str]) -> None:
        say = self._reader.say
        offered = {
            socket.value: say(words)
            for socket, words in SOCKET_NAMES.items()
            if socket not in OWNERS or OWNERS[socket].value in roles
        }
        ui.label(say(text("On the motor's terminals"))).classes("text-base font-semibold")
        chosen = {}
        for terminal in Terminal:
            box = ui.select(offered, value=self._sockets[terminal], label=terminal.value).props("outlined dense")
            chosen[terminal] = box.classes("w-full mt-2")

        async def connect() -> None:
            self._sockets = {terminal: str(box.value) for terminal, box in chosen.items()}
            await self._line(" ".join(["connect", *(f"{one.value}={at}" for one, at in self._sockets.items())]))

        ui.button(say(text("Connect it so")), on_click=connect).props("outline no-caps").classes("text-lg mt-2")
        with ui.row().classes("gap-2 mt-3"):
            for word in PLAIN:
                ui.button(say(called(word)), on_click=partial(self._line, word)).props("flat dense no-caps")

    async def _line(self, line: str) -> None:
        if line.strip():
            await self._send(line)


def _with_unit(argument: CommandArgument, typed: str) -> str:
    """Return what was typed into a field; a bare number is in the unit that the field shows."""
    typed = "".join(typed.split())
    try:
        typed_number(typed, "")
    except ValueError:
        return typed
    unit = spoken(0.0, argument.unit)[1].split("|")[0].split(" ")[0]
    return f"{typed}{unit}"
