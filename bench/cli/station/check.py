"""`motorbench station check`: does every instrument answer, and is it the right one?"""

import sys
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from bench.cli.options import Json
from bench.cli.output import padded, print_json, say_broken
from bench.cli.station.missing_counterparts import as_dict, missing_counterparts, print_missing
from bench.cli.station.needs import good as needs_met
from bench.cli.station.needs import outlooks, print_outlooks
from bench.i18n.errors import message
from bench.i18n.language import language_of, translator
from bench.journal.unrecorded import Unrecorded
from bench.run.console import console_on
from bench.safety.interlocks import Interlocks, it_is, stood
from bench.safety.ownership.claims import claim_of, interlock_claims, relay_claims
from bench.safety.ownership.owner import HeldError, Ownership, owning
from bench.safety.ownership.state_folder import state_folder
from bench.safety.station_instruments import StationInstruments
from bench.safety.trip_latch import Latch
from bench.safety.watchdog_relays import open_relay
from bench.safety.watchdogs import armed_watchdogs
from bench.station.calibration_list import CalibrationDue, calibration_list
from bench.station.clock import SystemClock, wall_date
from bench.station.station_file import Entry, Station, load_station
from bench.station.visa_library import StationVisa
from drivers.interfaces import InstrumentError
from drivers.interfaces.text import Text, Translate, english, text
from drivers.manual.prompt import Option, Prompt
from procedures.core.bench import Role
from procedures.core.nameplate import Nameplate, WindingConnection

#: Nothing is energised, so that no limit of a motor counts.
NO_MOTOR = Nameplate("none", WindingConnection.WYE, rated_current=1e-3)


class DefaultAnswers:
    """Answers in place of a person where nothing is measured."""

    def ask(self, quantity: Text, unit: str, minimum: float, maximum: float, context: Text | None) -> float:
        """Answer the least: nobody measures here."""
        return minimum

    def choose(self, quantity: Text, options: Sequence[Option]) -> float:
        """Choose the first: nobody measures here."""
        return options[0].number

    def confirm(self, task: Text) -> None:
        """Go on."""


def check(
    station: Path,
    *procedures: str,
    set_: Annotated[tuple[str, ...], Parameter(name="--set")] = (),
    language: str = "auto",
    json: Json = False,
) -> int:
    """Open every instrument of a station file, say who answers, when each is due for calibration, which watchdogs are armed,
    and for each procedure what the station lacks or what people are asked for.

    Nothing is energised. Exit status 1 where an instrument does not answer, a driver misnames its simulated instrument, or a procedure
    that is named cannot run; where none is named, if none can.

    Parameters
    ----------
    station
        The station file.
    procedures
        Procedures that must be possible. Default: at least one of `all`.
    set_
        A setting of these procedures, as for `motorbench run`.
    language
        en, zh, or auto (by the locale). Default for JSON: en.

    """
    translate = english if json and language == "auto" else translator(language_of(language))
    read = load_station(station)
    needs, missing = outlooks(read, procedures, set_), missing_counterparts(read)
    due = calibration_list(read.entries.values(), wall_date())
    overdue = [notice.message.render(translate) for notice in read.check_calibrations(wall_date(), read.entries)]
    prompts: dict[Role, Prompt] = dict.fromkeys(read.entries, DefaultAnswers())
    nowhere = Unrecorded()
    state = state_folder()
    with owning(state, "motorbench station check") as owner:
        instruments = StationInstruments(
            read, NO_MOTOR, SystemClock(), nowhere, nowhere, StationVisa(read.visa_library), prompts.get, owner=owner
        )
        found = {role.value: held(read, entry, owner, translate) for role, entry in read.entries.items()}
        contacts = _look_at_contacts(read, owner, translate)
        relays = _look_at_relays(read, owner, translate)
        try:
            for role, entry in read.entries.items():
                if found[role.value]["error"] is None:
                    look(instruments, entry, found[role.value], translate)
            errors = {role: str(found[role.value]["error"]) for role in read.entries if found[role.value]["error"]}
            watchdogs = armed_watchdogs(read, instruments.opened(), errors)
        finally:
            closing = instruments.close()
    trip = Latch(state, read).standing()
    looked_at = (*found.values(), *contacts.values(), *relays.values())
    named = procedures not in ((), ("all",))
    # A station that has its contacts only can be looked at, too.
    possible = needs_met(needs, named=named) or not (named or read.entries)
    good = possible and not closing and trip is None and all(told["error"] is None for told in looked_at)
    good = good and not any(one.slip for one in missing.values())
    if json:
        print_json(
            {
                "station": read.name,
                "instruments": found,
                "interlocks": contacts,
                "trip": None if trip is None else asdict(trip),
                "watchdog_relays": relays,
                "watchdogs": [one.as_dict() for one in watchdogs],
                "missing_counterparts": as_dict(missing, translate),
                "procedures": {each.name: each.as_dict(translate) for each in needs},
                "closing": list(closing),
                "overdue": overdue,
                "calibrations": [each.as_dict() for each in due],
                "broken": [one.as_dict() for one in read.catalogues.broken(load=False)],
                "good": good,
            }
        )
    else:
        say_broken(read.catalogues.broken(load=False), translate)
        tripped = [] if trip is None else [stood(trip).render(translate)]
        _print(read.name, found, contacts, relays, [*tripped, *overdue, *closing], translate)
        for one in watchdogs:
            mark = "!" if one.missing else "✓"
            console_on(sys.stdout).print(f"  {mark} {one.words.render(translate)}", markup=False, soft_wrap=True)
        print_missing(missing, translate)
        if due:
            _print_due(due, translate)
        if named or read.entries:
            print_outlooks(needs, translate)
    return 0 if good else 1


def held(station: Station, entry: Entry, owner: Ownership, translate: Translate) -> dict[str, Any]:
    """Acquire an instrument for the check, or report its present owner."""
    result: dict[str, Any] = {
        "driver": entry.driver.name,
        "address": entry.address,
        "calibration": entry.calibration.as_dict() if entry.calibration else None,
        "identity": None,
        "found_state": [],
        "error": None,
    }
    try:
        owner.claim([claim_of(station, entry)])
    except HeldError as error:
        result["error"] = message(error, translate)
    return result


def look(instruments: StationInstruments, entry: Entry, told: dict[str, Any], translate: Translate) -> None:
    """Open an instrument, and tell who answers and what it is found set to."""
    try:
        instrument = instruments.get(entry.role)
        identity = instrument.identity
        told["found_state"] = [
            {
                "query": one.query,
                "found": one.found,
                "wanted": one.wanted or None,
                "changed": one.changed,
                "effect": one.effect.render(translate),
            }
            for one in instrument.found_state
        ]
    except InstrumentError as error:
        told["error"] = message(error, translate)
    else:
        told["identity"] = ", ".join(
            part for part in (identity.manufacturer, identity.model, identity.serial_number, identity.firmware) if part
        )


def _look_at_contacts(station: Station, owner: Ownership, translate: Translate) -> dict[str, dict[str, Any]]:
    result: dict[str, dict[str, Any]] = {}
    for entry in station.interlocks:
        result[entry.name] = {"address": entry.address, "error": None}
        try:
            owner.claim(interlock_claims(replace(station, interlocks=(entry,))))
            interlocks = Interlocks([entry])
        except (HeldError, InstrumentError) as error:
            result[entry.name]["error"] = message(error, translate)
            continue
        how = dict(interlocks.not_closed()).get(entry.name)
        interlocks.close()
        result[entry.name]["error"] = None if how is None else it_is(how).render(translate)
    return result


def _look_at_relays(station: Station, owner: Ownership, translate: Translate) -> dict[str, dict[str, Any]]:
    result: dict[str, dict[str, Any]] = {}
    for entry in station.watchdog_relays:
        about: dict[str, Any] = {"address": entry.address, "picked_up": None, "error": None}
        result[entry.name] = about
        try:
            owner.claim(relay_claims(replace(station, watchdog_relays=(entry,))))
            relay = open_relay(entry)
            try:
                about["picked_up"] = relay.picked_up()
            finally:
                relay.close()
        except (HeldError, InstrumentError) as error:
            about["error"] = message(error, translate)
    return result


def _print(
    name: str,
    found: dict[str, dict[str, Any]],
    contacts: dict[str, dict[str, Any]],
    relays: dict[str, dict[str, Any]],
    faults: list[str],
    translate: Translate,
) -> None:
    console = console_on(sys.stdout)

    def say(said: Text) -> str:
        return said.render(translate)

    console.print(name, style="bold", markup=False)
    if not found:
        console.print(f"  {say(text('no instruments; add [instruments.ROLE] tables to the file'))}", markup=False)
    for role, told in found.items():
        mark, words = ("✓", told["identity"]) if told["error"] is None else ("✗", told["error"])
        console.print(
            f"  {mark} {padded(translate(role), 18)}{told['driver']:<24}{told['address'] or '–'}", markup=False
        )
        console.print(f"      {words}", markup=False)
        for one in told["found_state"]:
            if one["changed"] or one["wanted"] is None:
                then = say(text(" → {wanted}, restored at the end", wanted=one["wanted"])) if one["changed"] else ""
                console.print(
                    f"      {one['query']} {one['found']}{then}: {one['effect']}", markup=False, soft_wrap=True
                )
    for contact, told in contacts.items():
        mark, words = ("✓", say(text("closed"))) if told["error"] is None else ("✗", told["error"])
        console.print(f"  {mark} {contact:<18}{padded(say(text('interlock')), 24)}{told['address']}", markup=False)
        console.print(f"      {words}", markup=False)
    for relay, told in relays.items():
        state = say(text("picked up") if told["picked_up"] else text("dropped out"))
        mark, words = ("✓", state) if told["error"] is None else ("✗", told["error"])
        console.print(f"  {mark} {relay:<18}{padded(say(text('watchdog relay')), 24)}{told['address']}", markup=False)
        console.print(f"      {words}", markup=False)
    for fault in faults:
        console.print(f"  ✗ {fault}", markup=False)


def _print_due(due: Sequence[CalibrationDue], translate: Translate) -> None:
    """Print when each instrument is due for calibration, soonest first."""
    console = console_on(sys.stdout)
    console.print(text("Calibrations, soonest first").render(translate), markup=False)
    for each in due:
        mark = "–" if each.calibration is None else "!" if each.pressing else "✓"
        console.print(f"  {mark} {each.words.render(translate)}", markup=False, soft_wrap=True)
