"""The row that is always in sight: what is known of the bench, and ABORT."""

from collections.abc import Awaitable, Callable
from time import monotonic
from typing import Any

from nicegui import events, ui

from bench.panel.bench_state import ShownState, StateKind
from bench.panel.live.live_run import LiveRun
from bench.panel.pages.ended_session import offer_abort
from bench.panel.pages.icons import icon
from bench.panel.pages.parts import named
from bench.panel.pages.reader import Reader
from drivers.interfaces.text import Text, text


class StateRow:
    """State and ABORT of a run; `abort` passes the wish on and returns why it was refused, or None."""

    def __init__(self, run: LiveRun, reader: Reader, abort: Callable[[], Awaitable[Text | None]]) -> None:
        self._run = run
        self._reader = reader
        self._call = abort
        self._refused: Text | None = None
        say = reader.say
        with ui.element("div").classes("mb-status"):
            self._state = ui.element("div").classes("mb-state").props("data-state=unknown data-sound=''")
            with self._state:
                ui.element("div").classes("mb-stripes")
                for name in ("off", "on", "unknown", "unread"):
                    icon(name)
                with ui.element("div"):
                    self._headline = ui.label().props("role=status aria-live=assertive")
                    # Its age changes twice a second: nobody wants that read out.
                    self._detail = ui.label().classes("mb-detail")
            button = ui.element("button").classes("mb-stop").props("accesskey=x type=button").on("click", self._abort)
            named(button, say(text("Abort the run: everything off")))
            with button:
                icon("stop")
                with ui.element("span"):
                    self._word = ui.label(say(text("ABORT")))
                    self._small = ui.label("Ctrl + Esc").classes("mb-small")
        offer_abort(abort, button, ui.keyboard(on_key=self._key, repeating=False, ignore=[]))

    def show(self, state: ShownState) -> None:
        """Show what is known now."""
        say = self._reader.say
        before = dict(self._state.props)
        self._state.props["data-state"] = state.kind.value
        # While a procedure measures, states come and go too fast to be heard.
        quiet = state.kind is StateKind.UNREAD or (state.kind is StateKind.UNKNOWN and self._run.line.question is None)
        if not quiet:
            self._state.props["data-sound"] = state.kind.value
        # Whatever is updated has the browser work out every element of the page.
        if self._state.props != before:
            self._state.update()
        self._headline.set_text(say(state.headline))
        self._detail.set_text(say(self._refused or state.detail))
        asked = self._run.abort_asked_at
        if asked is not None:
            self._word.set_text(say(text("ABORTING")))
            self._word.classes(add="mb-aborting")
            self._small.set_text(say(text("pressed {age} s ago", age=f"{monotonic() - asked:.0f}")))

    async def _abort(self) -> None:
        self._refused = await self._call()

    async def _key(self, event: events.KeyEventArguments) -> None:
        key: Any = event.key
        if event.action.keydown and key.escape and event.modifiers.ctrl:
            await self._abort()
