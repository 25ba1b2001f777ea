"""The station on the start page: its instruments, looked for and identified when somebody wants it."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from nicegui import ui

from bench.i18n.errors import InputError
from bench.panel.offer import check_station
from bench.panel.pages.reader import Reader
from bench.panel.panel import Panel
from bench.panel.server.sessions import Session
from bench.station.station_file import VIRTUAL
from drivers.interfaces.text import text
from reports.labels import role_name


class StationPart:
    """The station's state; `found` is called with the roles whose instruments answered."""

    def __init__(self, panel: Panel, session: Session, reader: Reader, found: Callable[[frozenset[str]], None]) -> None:
        self._panel = panel
        self._session = session
        self._reader = reader
        self._found = found

    def build(self) -> None:
        """Build it; nothing is asked of the instruments."""
        say = self._reader.say
        self._station = ui.element("div").classes("w-full")
        with self._station:
            if self._panel.station == VIRTUAL:
                ui.label(say(text("The virtual bench: its instruments are simulated; nothing can be harmed."))).classes(
                    "text-base"
                )
                return
            ui.label(self._panel.station).classes("text-base break-all")
            ui.button(say(text("Check the instruments")), on_click=self._check).props("outline")

    async def _check(self) -> None:
        say = self._reader.say
        self._station.clear()
        with self._station:
            ui.spinner(size="2rem")
        try:
            station = await check_station(Path(self._panel.station), self._session.language)
        except InputError as error:
            station = {"name": self._panel.station, "instruments": {}, "overdue": [self._reader.fault(error)]}
        self._station.clear()
        with self._station:
            for role, instrument in station["instruments"].items():
                self._instrument(role, instrument)
            for words in station["overdue"]:
                ui.label(f"⚠ {words}").classes("text-base").style("color:#6b4400")
            ui.button(say(text("Check again")), on_click=self._check).props("outline")
        self._found(frozenset(role for role, told in station["instruments"].items() if told["error"] is None))

    def _instrument(self, role: str, instrument: Mapping[str, Any]) -> None:
        good = instrument["error"] is None
        ui.label(f"{'✓' if good else '✗'} {self._reader.say(role_name(role))}").classes("text-base font-semibold")
        ui.label(str(instrument["identity"] if good else instrument["error"])).classes("text-sm pl-6 break-all")
        calibration = instrument.get("calibration")
        due = calibration and calibration.get("due")
        words = text("calibrated until {date}", date=str(due)) if due else text("no calibration entered")
        ui.label(self._reader.say(words)).classes("text-sm pl-6").style("color:#44505c")
