"""A socket of the line as a tile: the motor in it, or the last one's verdict in large type, why, and what the hand does next."""

from collections.abc import Callable, Mapping
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
#: What the hand does with the motor of a socket.
_NEXT: Mapping[str, Text] = {
    "measuring": text("Do not touch."),
    "pass": text("Take it out."),
    "fail": text("Take it out, to the rejects."),
    "error": text("Not judged: take it out and put it aside."),
    "aborted": text("Not judged: take it out and put it aside."),
    "empty": text("Put a motor in and scan it."),
    "cut-off": text("Check that it is off."),
}
#: Figures outside their limits that a tile has room for.
_SHOWN = 3


class Tile:
    """One socket: the motor in it, or the last one's verdict in large type; `title` names a procedure."""

    def __init__(self, reader: Reader, name: str, title: Callable[[str], Text]) -> None:
        self._reader = reader
        self._title = title
        self._since = ""
        say = reader.say
        with ui.element("section").classes("mb-tile") as self._box:
            ui.label(say(text("Socket {name}", name=name))).classes("text-lg font-semibold")
            self._verdict = ui.label().classes("verdict")
            self._serial = ui.label().classes("text-2xl font-semibold break-all")
            self._detail = ui.label().classes("text-base whitespace-pre-line")
            self._figures = ui.element("div").classes("w-full")
            self._diagnosis = ui.label().classes("text-lg font-semibold whitespace-pre-line mb-diagnosis")
            self._next = ui.label().classes("mb-tile-next")
        named(self._box, say(text("Socket {name}", name=name))).props("aria-live=polite")

    def show(self, socket: Mapping[str, Any], *, running: bool, scans: bool) -> None:
        """Show a socket as the batch tells it; one that is not `running` any more was cut off with the motor in it."""
        say = self._reader.say
        last = socket["last"]
        self._since = socket["since"] if running else ""
        self._figures.clear()
        self._diagnosis.set_text(self._faults(last) if last is not None and not socket["serial_number"] else "")
        if socket["serial_number"] and running:
            self._set("measuring", "…", socket["serial_number"])
            self.tick()
        elif socket["serial_number"]:
            self._set("cut-off", "?", socket["serial_number"])
            self._detail.set_text(say(text("not judged: the batch was cut off")))
        elif last is not None:
            mark, words = VERDICTS[last["verdict"]]
            self._set(last["verdict"], f"{mark} {say(words)}", last["serial_number"])
            if last.get("golden"):
                self._serial.set_text(say(text("golden motor {serial}", serial=last["serial_number"])))
                self._next.set_text(say(text("Take it out, and put it back with the golden motors.")))
            # Of a figure outside its limits the cause says the same again.
            self._detail.set_text("" if last["outside"] else self._cause(last) or self._inside(last))
            with self._figures:
                for outside in last["outside"][:_SHOWN]:
                    self._outside(outside)
                if len(last["outside"]) > _SHOWN:
                    ui.label(say(text("{count} more", count=len(last["outside"]) - _SHOWN))).classes("text-base")
        else:
            self._set("empty", "–", say(text("free")))
            self._detail.set_text("")
            if not scans:
                self._next.set_text("")
        if socket.get("braked") and not socket["serial_number"]:
            self._box.props["data-braked"] = "true"
            self._detail.set_text(say(restore_text(socket["braked"])))
            self._next.set_text(say(text("This socket takes no more motors.")))

    def tick(self) -> None:
        """Count the seconds of the motor that is measured."""
        if self._since:
            passed = (datetime.now(UTC) - datetime.fromisoformat(self._since)).total_seconds()
            self._detail.set_text(
                self._reader.say(text("measuring for {seconds:.0f} s", seconds=max(0.0, round(passed))))
            )

    def _cause(self, last: Mapping[str, Any]) -> str:
        """Return why it was not judged, by the titles of what did not end."""
        title = self._title
        causes = [
            text("{what}: {cause}", what=title(name), cause=restore_text(why)) for name, why in last.get("causes", ())
        ]
        return "\n".join(map(self._reader.say, causes)) or self._reader.say(restore_text(last["cause"]))

    def _faults(self, last: Mapping[str, Any]) -> str:
        """Return the parts at fault, a line each, and what the rework place's list calls them."""
        lines = [self._reader.say(restore_text(each)) for each in last.get("diagnosis", ())]
        return "\n".join([*lines, *((f"→ {last['rework']}",) if last.get("rework") else ())])

    def _inside(self, last: Mapping[str, Any]) -> str:
        say, closest = self._reader.say, last["closest"]
        if not last["limited"]:
            return ""
        words = [say(text("{inside} of {limited} within their limits", inside=last["inside"], limited=last["limited"]))]
        if closest is not None:
            label = restore_text(closest["label"])
            message = text("closest: {label}, {left:.0f} % of its limits left", label=label, left=closest["left"])
            words.append(say(message))
        return "\n".join(words)

    def _outside(self, outside: Mapping[str, Any]) -> None:
        say, unit = self._reader.say, outside["unit"]
        value = f"{outside['value']} {unit}".rstrip()
        words = say(text("{name}: {value}", name=restore_text(outside["label"]), value=value))
        ui.label(words).classes("text-base font-semibold")
        limits = f"{outside['low'] or '–'} … {outside['high'] or '–'} {unit}".rstrip()
        ui.label(say(text("limits {limits}", limits=limits))).classes("text-base")
        if outside["place"] is not None:
            with ui.element("div").classes("mb-limits").props("aria-hidden=true"):
                ui.element("i").classes("mb-limits-band")
                ui.element("i").classes("mb-limits-value").style["left"] = f"{100.0 * outside['place']:.1f}%"

    def _set(self, state: str, verdict: str, serial: str) -> None:
        self._box.props["data-state"] = state
        self._verdict.set_text(verdict)
        self._serial.set_text(serial)
        self._next.set_text(self._reader.say(_NEXT[state]))
