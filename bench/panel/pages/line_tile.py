"""A socket of the line as a tile: the motor in it, or the last one's verdict in large type."""

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any

from nicegui import ui

from bench.journal.stored_result import restore_text
from bench.panel.pages.parts import named
from bench.panel.pages.reader import Reader
from drivers.interfaces.text import Text, text

#: What a tile says in large type: a mark beside the colour, for those who do not tell the colours apart.
VERDICTS: Mapping[str, tuple[str, Text]] = {
    "pass": ("✓", text("PASS")),
    "fail": ("✗", text("FAIL")),
    "error": ("!", text("ERROR")),
    "aborted": ("■", text("ABORTED")),
}


class Tile:
    """One socket: the motor in it, or the last one's verdict in large type."""

    def __init__(self, reader: Reader, name: str) -> None:
        self._reader = reader
        self._since = ""
        say = reader.say
        with ui.element("section").classes("mb-tile") as self._box:
            ui.label(say(text("Socket {name}", name=name))).classes("text-lg font-semibold")
            self._verdict = ui.label().classes("verdict")
            self._serial = ui.label().classes("text-2xl font-semibold break-all")
            self._detail = ui.label().classes("text-base whitespace-pre-line")
        named(self._box, say(text("Socket {name}", name=name))).props("aria-live=polite")

    def show(self, socket: Mapping[str, Any]) -> None:
        """Show a socket as the batch tells it."""
        say = self._reader.say
        last = socket["last"]
        self._since = socket["since"]
        if socket["serial_number"]:
            self._set("measuring", "…", socket["serial_number"])
            self.tick()
        elif last is not None:
            mark, words = VERDICTS[last["verdict"]]
            self._set(last["verdict"], f"{mark} {say(words)}", last["serial_number"])
            outside = [say(restore_text(label)) for label in last["outside"]]
            self._detail.set_text(last["cause"] or "\n".join(outside))
        else:
            self._set("empty", "–", say(text("free")))
            self._detail.set_text("")

    def tick(self) -> None:
        """Count the seconds of the motor that is measured."""
        if self._since:
            passed = (datetime.now(UTC) - datetime.fromisoformat(self._since)).total_seconds()
            self._detail.set_text(
                self._reader.say(text("measuring for {seconds:.0f} s", seconds=max(0.0, round(passed))))
            )

    def _set(self, state: str, verdict: str, serial: str) -> None:
        self._box.props["data-state"] = state
        self._verdict.set_text(verdict)
        self._serial.set_text(serial)
