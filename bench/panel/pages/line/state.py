"""The row of the line that is always in sight: which sockets are measured now, and ABORT."""

from collections.abc import Awaitable, Callable, Mapping
from typing import Any

from nicegui import ui

from bench.journal.stored_result import restore_text
from bench.panel.bench_state import StateKind
from bench.panel.pages.icons import icon
from bench.panel.pages.parts import named
from bench.panel.pages.reader import Reader
from drivers.interfaces.text import Text, text


class LineStateRow:
    """State and ABORT of a batch. The batch tells what its sockets do; what stands at their outputs it does not read back for a page."""

    def __init__(self, reader: Reader, abort: Callable[[], Awaitable[None]]) -> None:
        self._reader = reader
        say = reader.say
        with ui.element("div").classes("mb-status mb-line-state"):
            self._state = ui.element("div").classes("mb-state").props("data-state=unread")
            with self._state:
                ui.element("div").classes("mb-stripes")
                for name in ("on", "unread"):
                    icon(name)
                with ui.element("div"):
                    self._headline = ui.label().props("role=status aria-live=polite data-line-state")
                    self._detail = ui.label().classes("mb-detail")
            self.stop = ui.element("button").classes("mb-stop").props("type=button").on("click", abort)
            named(self.stop, say(text("Abort the batch: everything off")))
            with self.stop:
                icon("stop")
                with ui.element("span"):
                    ui.label(say(text("ABORT")))
                    self._extent = ui.label().classes("mb-small")
            ui.tooltip(say(text("Every socket shuts down. Key: Ctrl+Esc. Finish: Ctrl+End")))

    def show(self, state: Mapping[str, Any], *, running: bool, alone: bool) -> None:
        """Show what the batch last said of its sockets; beside others, ABORT says that it is of this one."""
        self._extent.set_text(self._reader.say(text("all sockets") if alone else text("this batch only")))
        kind, headline, detail = _told(state, running=running)
        self._state.props["data-state"] = kind.value
        self._state.update()
        self._headline.set_text(self._reader.say(headline))
        self._detail.set_text(self._reader.say(detail))
        self.stop.set_visibility(running)


def _told(state: Mapping[str, Any], *, running: bool) -> tuple[StateKind, Text, Text]:
    measured = [str(socket["name"]) for socket in state["sockets"] if socket["serial_number"]]
    if not running:
        unseen = text("Nothing is read back here any more. Check at the sockets yourself that they are off.")
        return StateKind.UNREAD, text("No batch is running."), unseen
    ending = text("The batch ends: {how}", how=restore_text(state["ending"])) if state["ending"] else None
    if measured:
        headline = text("Measuring, maybe energised: socket {names}. Do not touch.", names=measured)
        others = [str(socket["name"]) for socket in state["sockets"] if not socket["serial_number"]]
        rest = text("Not measured now: socket {names}", names=others) if others else text("No socket is free.")
        return StateKind.ON, headline, ending or rest
    quiet = text("A socket's outputs are switched off at its motor's end; between motors nothing is read back.")
    return StateKind.UNREAD, text("No socket measures."), ending or quiet
