"""`motorbench station new`: a station file from a scan and a person's answers, checked at the end."""

import sys
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

from tomli_w import dumps

from bench.cli.new_file import refuse_existing
from bench.cli.options import Language
from bench.cli.station.check import check
from bench.cli.station.scan import print_report, request_of, scanned, write_draft
from bench.discovery.station_draft import Candidate, candidates
from bench.files.typed_value import typed_value
from bench.i18n.errors import InputError, message
from bench.i18n.language import language_of, translator
from bench.station.driver_options import unit_of_option
from bench.station.station_file import catalogues_at, make_station
from bench.station.station_limits import KEY as LIMITS
from bench.station.station_limits import SECTIONS
from drivers.catalogue import MANUAL, Driver
from drivers.interfaces.role import ROLES
from drivers.interfaces.text import Text, Translate, text
from procedures.core.bench import Role

#: Options with a default that is worth a question: what a machine is rated for, and how long silence may last.
_WORTH_ASKING = ("rated_torque", "pole_pairs", "watchdog_time", "heartbeat_time")
_SECONDS = {"watchdog_time": "s", "heartbeat_time": "s"}


class _Dialogue:
    """Questions on standard output, answers from standard input."""

    def __init__(self, translate: Translate) -> None:
        self._translate = translate

    def say(self, words: Text) -> None:
        print(words.render(self._translate), flush=True)

    def ask(self, question: Text) -> str:
        print(f"{question.render(self._translate)} ", end="", flush=True)
        line = sys.stdin.readline()
        if not line:
            raise InputError(text("the answers ended before the last question; nothing was written"))
        return line.strip()

    def value(self, key: str, unit: str, default: object) -> Any:
        """Return a value as a station file has it, None where the default is to stand."""
        optional = default is not MISSING
        shown = text("leave it out") if default is None else Text("{value}", {"value": str(default)})
        question = (
            text("{key}{unit} [{default}]:", key=key, unit=f" ({unit})" if unit else "", default=shown)
            if optional
            else text("{key}{unit}:", key=key, unit=f" ({unit})" if unit else "")
        )
        while True:
            reply = self.ask(question)
            if reply:
                return typed_value(reply)
            if optional:
                return None
            self.say(text("this question has no default; enter a value"))


def new(
    file: Path,
    /,
    *,
    host: tuple[str, ...] = (),
    serial: tuple[str, ...] = (),
    modbus: tuple[str, ...] = (),
    can: tuple[str, ...] = (),
    units: str = "1-16",
    force: bool = False,
    name: str = "",
    named_only: bool = False,
    within: float = 60.0,
    visa_library: str = "@py",
    language: Language = "auto",
) -> int:
    """Look for the instruments, ask for the rest (roles, limits, ratings, watchdogs, fixture), write the station file, and check it.

    Parameters
    ----------
    file
        The station file to write.
    host
        The same as for station scan; so are serial, modbus, can, units, named-only, within and visa-library.
    serial
        Serial ports to listen on. If nothing arrives by itself, the instrument is queried.
    modbus
        Serial ports, or tcp://host:port, on which to look for Modbus units.
    can
        CAN buses on which to look for CANopen nodes.
    units
        The Modbus unit numbers to try.
    force
        Overwrite the file.
    name
        The station's name. Without it, you are asked.
    named_only
        Ask only what was named.
    within
        Longest time for the scan, s, 1 to 3600.
    visa_library
        The VISA library, written as in a station file.

    """
    translate = translator(language_of(language))
    refuse_existing(file, force=force)
    request = request_of(host, serial, modbus, can, units, named_only=named_only, within=within)
    report = scanned(request, None, visa_library, translate)
    print_report(report, None, translate)
    if report.interrupted:
        raise InputError(text("interrupted by Ctrl-C"))
    talk = _Dialogue(translate)
    station: dict[str, Any] = {"name": name or talk.ask(text("The station's name:")) or "bench"}
    if visa_library != "@py":
        station["visa_library"] = visa_library
    data: dict[str, Any] = {"station": station, "instruments": {}}
    for one in _chosen(talk, candidates(report)):
        _settle(talk, data, one.role, one.driver, one.table, translate)
    for driver in _by_hand(talk, data["instruments"]):
        _settle(talk, data, driver.role, driver, {"driver": MANUAL}, translate)
    if any(ROLES[Role(role)].in_fixture for role in data["instruments"]):
        _add_room(talk, data, translate)
    write_draft(file, dumps(data))
    talk.say(text("Written: {file}. Interlocks, relays and calibrations: docs/explanation/safety.md", file=str(file)))
    return check(file, language=language)


def _chosen(talk: _Dialogue, found: Iterable[Candidate]) -> list[Candidate]:
    """Return one candidate a role; what has a role already is not asked about again."""
    chosen: list[Candidate] = []
    by_role: dict[Role, list[Candidate]] = {}
    for one in found:
        by_role.setdefault(one.role, []).append(one)
    for role, several in by_role.items():
        free = [one for one in several if one.finding not in [other.finding for other in chosen]]
        if not free:
            continue
        talk.say(text("{role}: which instrument?", role=role.value))
        for number, one in enumerate(free, 1):
            talk.say(
                text(
                    "  {number}: {driver} at {address}: {answer}",
                    number=number,
                    driver=one.driver.name,
                    address=one.finding.address,
                    answer=one.finding.said,
                )
            )
        while True:
            # What fits several roles is in none of them unless a person says so.
            usual = "1" if free[0].sole_role else "0"
            given = talk.ask(text("its number, or 0 for none [{usual}]:", usual=usual)) or usual
            if given.isdecimal() and int(given) <= len(free):
                break
            talk.say(text("allowed is 0 to {most}", most=len(free)))
        if int(given):
            chosen.append(free[int(given) - 1])
    return chosen


def _by_hand(talk: _Dialogue, taken: Mapping[str, Any]) -> list[Driver]:
    drivers = {driver.role.value: driver for driver in catalogues_at("virtual").drivers[MANUAL]}
    free = [role for role in drivers if role not in taken]
    question = text("Which of {roles} are set and read by a person (names, or nothing):", roles=free)
    while free:
        given = talk.ask(question).replace(",", " ").split()
        if all(role in free for role in given):
            return [drivers[role] for role in dict.fromkeys(given)]
        talk.say(text("allowed are {roles}", roles=free))
    return []


def _settle(
    talk: _Dialogue, data: dict[str, Any], role: Role, driver: Driver, table: Mapping[str, Any], translate: Translate
) -> None:
    """Ask for what an instrument's table lacks, until it holds."""
    talk.say(text("{role}, {driver}:", role=role.value, driver=driver.name))
    while True:
        made = dict(table)
        for option in fields(driver.options):
            required = option.default is MISSING and option.default_factory is MISSING
            if option.name in made or not (required or option.name in _WORTH_ASKING):
                continue
            unit = _SECONDS.get(option.name) or unit_of_option(option.name) or ""
            value = talk.value(option.name, unit, option.default)
            if value is not None:
                made[option.name] = value
        limits = _limits(talk, role, made)
        if limits:
            made[LIMITS] = limits
        if _holds(talk, data | {"instruments": {role.value: made}}, translate):
            data["instruments"][role.value] = made
            return


def _add_room(talk: _Dialogue, data: dict[str, Any], translate: Translate) -> None:
    """Ask for the winding's temperature in the room in which a fixture tests, until it holds."""
    while (room := talk.value("fixture.winding_temperature", "°C", None)) is not None:
        fixture = {"winding_temperature": room}
        if _holds(talk, data | {"fixture": fixture}, translate):
            data["fixture"] = fixture
            return


def _holds(talk: _Dialogue, data: Mapping[str, Any], translate: Translate) -> bool:
    """Say whether a station file with these data would be accepted, and if not, why."""
    try:
        make_station(data, "station.toml", b"")
    except InputError as error:
        talk.say(Text("{error}", {"error": message(error, translate)}))
        return False
    return True


def _limits(talk: _Dialogue, role: Role, made: Mapping[str, Any]) -> dict[str, Any]:
    section = SECTIONS.get(role)
    result = {}
    for key, field in section.model_fields.items() if section is not None else ():
        # Where the driver has asked for the same limit, it is one.
        if key in made:
            continue
        extra = field.json_schema_extra
        unit = str(extra.get("unit", "")) if isinstance(extra, dict) else ""
        value = talk.value(f"{LIMITS}.{key}", unit, None)
        if value is not None:
            result[key] = value
    return result
