"""The message on a page that has lost the connection to the server; the browser itself shows it."""

from nicegui import ui

from bench.panel.pages.icons import icon
from bench.panel.pages.reader import Reader
from drivers.interfaces.text import text


def lost_row(reader: Reader) -> None:
    """Build the row that says it, hidden as long as the server is heard."""
    say = reader.say
    with ui.element("div").classes("mb-status mb-lostbar"):
        with ui.element("div").classes("mb-state").props("data-state=lost role=alert"):
            ui.element("div").classes("mb-stripes")
            icon("lost")
            with ui.element("div"):
                # The browser counts, and puts the number in.
                headline = ui.label().props("data-words")
                headline.props["data-words"] = say(
                    text("Connection lost {age} s ago: everything shown is out of date", age="{age}")
                )
                words = text(
                    "Whether outputs are on is not known. A run ends itself safely if nobody reaches it for 60 s."
                )
                ui.label(say(words)).classes("mb-detail")
        stop = ui.element("button").props("disabled").classes("mb-stop")
        with stop:
            ui.label(say(text("ABORT cannot reach the bench: press its red stop button")))
