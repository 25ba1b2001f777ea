"""The page after its session has ended: it states that it no longer knows the state, and can still abort."""

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any

from nicegui import Client, events, ui

from bench.panel.pages.reader import Reader
from bench.panel.server.gate import LOGIN
from bench.panel.server.sessions import Session
from drivers.interfaces.text import Text, text

_KEY = "motorbench_abort"


@dataclass(frozen=True)
class Abort:
    """The abort of a page's run or batch: the call returns why it was refused, or None.

    `buttons` are the elements by which it is asked for.
    """

    call: Callable[[], Awaitable[Text | None]]
    buttons: frozenset[int]


def offer_abort(call: Callable[[], Awaitable[Text | None]], *buttons: ui.element) -> None:
    """Note how this page aborts: whatever becomes of its session, that stays possible."""
    ui.context.client.storage[_KEY] = Abort(call, frozenset(button.id for button in buttons))


def abort_of(client: Client) -> Abort | None:
    """Return how a page aborts, where there is something to abort."""
    return client.storage.get(_KEY)


def show_ended(client: Client, session: Session) -> None:
    """Show on a page that its session has ended; only the abort remains possible."""
    say, abort = Reader(session).say, abort_of(client)
    for part in list(client.layout.default_slot.children):
        if part is not client.page_container:
            part.delete()
    client.content.clear()
    with client.content, ui.element("main").classes("max-w-3xl mx-auto mt-16 p-4 flex flex-col gap-4"):
        words = text("UNKNOWN: your session has ended, so this page no longer shows the state. Log in again to see it.")
        ui.label(say(words)).classes("mb-emergency").props("role=alert")
        ui.link(say(text("Log in again")), LOGIN).classes("mb-link text-xl")
        if abort is None:
            return

        async def stop() -> None:
            refused = await abort.call()
            outcome.set_text(say(refused or text("The abort was passed on. Look at the bench: is everything off?")))

        async def key(event: events.KeyEventArguments) -> None:
            pressed: Any = event.key
            if event.action.keydown and event.modifiers.ctrl and pressed.escape:
                await stop()

        button = ui.button(say(text("ABORT")), on_click=stop, color=None).classes("mb-abort text-2xl px-10 py-4")
        # Below the button, which no words may move.
        outcome = ui.label().classes("text-xl").props("role=status")
        keyboard = ui.keyboard(on_key=key, repeating=False, ignore=[])
        offer_abort(abort.call, button, keyboard)
