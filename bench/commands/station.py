"""`motorbench station check`: does every instrument answer, and is it the right one?"""

import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

from bench.clock import SystemClock, wall_date
from bench.commands.output import console_on, print_json
from bench.errors import InputError, UsageError
from bench.files.station import Entry, Station, load_station
from bench.instruments import StationInstruments, system_visa
from bench.language import language_of, translator
from bench.record.unrecorded import Unrecorded
from bench.safety.interlocks import Interlocks, closed
from bench.safety.latch import Latch
from bench.safety.watchdog_relays import open_relay
from bench.safety.watchdogs import armed_watchdogs
from drivers.interfaces import InstrumentError
from drivers.manual.prompt import Prompt
from procedures.bench import Role
from procedures.nameplate import Connection, Nameplate
from procedures.text import english, text


class _Nobody:
    """Stands for a person where nothing is measured."""

    def ask(self, quantity: str, unit: str, minimum: float, maximum: float, context: str) -> float:
        """Answer the least: nobody measures here."""
        return minimum

    def confirm(self, text: str) -> None:
        """Go on."""


def check(station: Path, *, language: str = "auto", json: bool = False) -> int:
    """Open every instrument of a station file, say who answers, whose calibration is overdue and which watchdogs are armed.

    Nothing is energised.

    Parameters
    ----------
    station
        The station file.
    language
        en, zh, or auto by the locale; JSON is English where none is asked for.
    json
        Print one JSON object and nothing else.

    """
    translate = english if json and language == "auto" else translator(language_of(language))
    read = load_station(station)
    overdue = [notice.message.render(translate) for notice in read.check_calibrations(wall_date(), read.entries)]
    nowhere = Unrecorded()
    plate = Nameplate("none", Connection.WYE, rated_current=1e-3)
    prompts: dict[Role, Prompt] = dict.fromkeys(read.entries, _Nobody())
    instruments = StationInstruments(
        read, plate, SystemClock(), nowhere, nowhere, system_visa(read.visa_library), prompts.get
    )
    contacts = _look_at_contacts(read)
    relays = _look_at_relays(read)
    try:
        found = {role.value: _look(instruments, entry) for role, entry in read.entries.items()}
        errors = {role: str(found[role.value]["error"]) for role in read.entries if found[role.value]["error"]}
        watchdogs = armed_watchdogs(read, instruments.opened(), errors)
    finally:
        closing = instruments.close()
    looked_at = (*found.values(), *contacts.values(), *relays.values())
    good = not closing and all(told["error"] is None for told in looked_at)
    if json:
        print_json(
            {
                "station": read.name,
                "instruments": found,
                "interlocks": contacts,
                "watchdog_relays": relays,
                "watchdogs": [one.as_dict() for one in watchdogs],
                "closing": list(closing),
                "overdue": overdue,
                "good": good,
            }
        )
    else:
        _print(read.name, found, contacts, relays, overdue + list(closing))
        for one in watchdogs:
            mark = "!" if one.missing else "✓"
            console_on(sys.stdout).print(f"  {mark} {one.words.render(translate)}", markup=False, soft_wrap=True)
    return 0 if good else 1


def reset(station: Path, *, by: str, json: bool = False) -> int:
    """Allow runs again after an interlock was open; all interlocks must be closed.

    Parameters
    ----------
    station
        The station file.
    by
        The name of the person who has seen to it, for the record.
    json
        Print one JSON object and nothing else.

    """
    if not by.strip():
        raise UsageError(text("--by NAME: a person resets, and the record keeps who it was"))
    read = load_station(station)
    if not read.interlocks:
        raise InputError(text("{station}: the station has no [interlocks]; there is nothing to reset", station=station))
    with closed(read.interlocks, str(station)):
        trip = Latch(station).reset(by.strip())
    if json:
        print_json({"reset": trip is not None, "trip": None if trip is None else asdict(trip)})
    elif trip is None:
        print("nothing to reset: no interlock has been open")
    else:
        print(f"reset by {by.strip()}: the interlock {trip.interlock} was {trip.how} at {trip.wall}")
    return 0


def _look(instruments: StationInstruments, entry: Entry) -> dict[str, Any]:
    told: dict[str, Any] = {
        "driver": entry.driver.name,
        "address": entry.address,
        "calibration": entry.calibration.as_dict() if entry.calibration else None,
        "identity": None,
        "error": None,
    }
    try:
        identity = instruments.get(entry.role).identity
    except InstrumentError as error:
        told["error"] = str(error)
    else:
        told["identity"] = ", ".join(
            part for part in (identity.manufacturer, identity.model, identity.serial_number, identity.firmware) if part
        )
    return told


def _look_at_contacts(station: Station) -> dict[str, dict[str, Any]]:
    told: dict[str, dict[str, Any]] = {}
    for entry in station.interlocks:
        try:
            interlocks = Interlocks([entry])
        except InstrumentError as error:
            told[entry.name] = {"address": entry.address, "error": str(error)}
            continue
        how = dict(interlocks.not_closed()).get(entry.name)
        interlocks.close()
        told[entry.name] = {"address": entry.address, "error": None if how is None else f"it is {how}"}
    return told


def _look_at_relays(station: Station) -> dict[str, dict[str, Any]]:
    told: dict[str, dict[str, Any]] = {}
    for entry in station.watchdog_relays:
        about: dict[str, Any] = {"address": entry.address, "picked_up": None, "error": None}
        told[entry.name] = about
        try:
            relay = open_relay(entry)
            try:
                about["picked_up"] = relay.picked_up()
            finally:
                relay.close()
        except InstrumentError as error:
            about["error"] = str(error)
    return told


def _print(
    name: str,
    found: dict[str, dict[str, Any]],
    contacts: dict[str, dict[str, Any]],
    relays: dict[str, dict[str, Any]],
    faults: list[str],
) -> None:
    console = console_on(sys.stdout)
    console.print(name, style="bold", markup=False)
    if not found:
        console.print("  no instruments; add [instruments.<role>] tables to the file", markup=False)
    for role, told in found.items():
        mark, words = ("✓", told["identity"]) if told["error"] is None else ("✗", told["error"])
        console.print(f"  {mark} {role:<18}{told['driver']:<24}{told['address'] or '–'}", markup=False)
        console.print(f"      {words}", markup=False)
    for contact, told in contacts.items():
        mark, words = ("✓", "closed") if told["error"] is None else ("✗", told["error"])
        console.print(f"  {mark} {contact:<18}{'interlock':<24}{told['address']}", markup=False)
        console.print(f"      {words}", markup=False)
    for relay, told in relays.items():
        state = "picked up" if told["picked_up"] else "dropped out"
        mark, words = ("✓", state) if told["error"] is None else ("✗", told["error"])
        console.print(f"  {mark} {relay:<18}{'watchdog relay':<24}{told['address']}", markup=False)
        console.print(f"      {words}", markup=False)
    for fault in faults:
        console.print(f"  ✗ {fault}", markup=False)
