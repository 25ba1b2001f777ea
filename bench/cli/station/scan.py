"""`motorbench station scan`: which instruments are where, asked without changing anything."""

import sys
import tomllib
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from bench.cli.new_file import refuse_existing
from bench.cli.options import Json
from bench.cli.output import print_json, say_broken
from bench.discovery.findings import FoundInstrument, ScanReport
from bench.discovery.scan import ScanRequest
from bench.discovery.scan import scan as look
from bench.discovery.station_draft import draft
from bench.i18n.errors import InputError, UsageError
from bench.i18n.language import language_of, translator
from bench.run.console import console_on
from bench.safety.ownership.owner import owning
from bench.safety.ownership.state_folder import state_folder
from bench.station.clock import SystemClock
from bench.station.computer import Computer
from bench.station.library_logs import quieten_libraries
from bench.station.station_file import Station, catalogues_at, load_station, make_station
from bench.station.visa_library import StationVisa
from drivers.interfaces.text import Text, Translate, english, reason_of, text

_HIGHEST_UNIT = 247


def scan(
    *,
    host: tuple[str, ...] = (),
    serial: tuple[str, ...] = (),
    modbus: tuple[str, ...] = (),
    can: tuple[str, ...] = (),
    units: str = "1-16",
    station: Path | None = None,
    output: Path | None = None,
    force: bool = False,
    name: str = "bench",
    named_only: bool = False,
    within: float = 60.0,
    visa_library: str = "@py",
    language: str = "auto",
    json: Json = False,
) -> int:
    """Look where instruments can be, say who answers and which driver fits; nothing is set, energised or reset.

    Without options VISA (USB, GPIB, VXI-11 by broadcast) and mDNS are asked; serial ports and CAN interfaces are listed.
    Ctrl-C ends it with what was found.

    Parameters
    ----------
    host
        Hosts to query, like 192.168.1.5 (on the ports of HiSLIP, SCPI and VXI-11) or 192.168.1.5:5025, and VISA addresses.
    serial
        Serial ports to listen on. If nothing arrives by itself, the instrument is queried.
    modbus
        Serial ports, or tcp://host:port, on which to look for Modbus units. Registers are only read, never written.
    can
        CAN buses on which to look for CANopen nodes, like socketcan/can0. With ?fd=true, or fdcanusb:///dev/fdcanusb, for nodes
        of CAN FD.
    units
        The Modbus unit numbers to try.
    station
        A station file. Shows which of its addresses answer, and what else is found.
    output
        Write a proposed station file here.
    force
        Overwrite that file.
    name
        The name of the proposed station.
    named_only
        Ask only what was named.
    within
        Longest time for the scan, s, 1 to 3600.
    visa_library
        The VISA library, written as in a station file. Default: that of the station file, if one is given.
    language
        en, zh, or auto (by the locale). Default for JSON: en.

    """
    translate = english if json and language == "auto" else translator(language_of(language))
    request = request_of(host, serial, modbus, can, units, named_only=named_only, within=within)
    if output is not None:
        refuse_existing(output, force=force)
    read = None if station is None else load_station(station)
    report = scanned(request, read, visa_library, translate)
    if output is not None:
        write_draft(output, draft(report, name, translate))
    if json:
        told = report.as_dict(translate) | {"output": str(output) if output else None}
        if read is not None:
            told["station"] = _of_station(report, read, translate)
        print_json(told)
    else:
        print_report(report, read, translate)
        if output is not None:
            line = text(
                "Proposed station file: {file}. Fill it in, then motorbench station check {file}", file=str(output)
            )
            console_on(sys.stdout).print(line.render(translate), markup=False, soft_wrap=True)
    if report.interrupted:
        print(f"motorbench: {text('interrupted by Ctrl-C').render(translate)}", file=sys.stderr)
    missing = read is not None and not all(one["fits"] for one in _of_station(report, read, translate).values())
    return 1 if report.interrupted or missing else 0


def request_of(
    host: tuple[str, ...],
    serial: tuple[str, ...],
    modbus: tuple[str, ...],
    can: tuple[str, ...],
    units: str,
    *,
    named_only: bool,
    within: float,
) -> ScanRequest:
    """Return what a command line asks for. Raises UsageError for what cannot be."""
    if not 1.0 <= within <= 3600.0:
        raise UsageError(text("--within {within:g}: allowed is 1 to 3600 s", within=within))
    for line in modbus:
        if "://" in line and urlsplit(line).scheme not in ("rtu", "tcp"):
            raise UsageError(text("--modbus {line}: give a serial port, rtu:///… or tcp://host:port", line=line))
    for bus in can:
        if "/" not in bus.removeprefix("can://"):
            raise UsageError(text("--can {bus}: give interface/channel, like socketcan/can0", bus=bus))
    visa = tuple(one for one in host if "::" in one)
    hosts = tuple(_host(one) for one in host if one not in visa)
    return ScanRequest(hosts, visa, serial, modbus, can, _units(units), named_only, within)


def scanned(request: ScanRequest, station: Station | None, visa_library: str, translate: Translate) -> ScanReport:
    """Scan, telling on standard error what takes long."""
    catalogues = catalogues_at("virtual") if station is None else station.catalogues
    drivers = [driver for roles in catalogues.drivers.values() for driver in roles]
    say_broken(catalogues.broken(load=False), translate)
    quieten_libraries()
    visa = StationVisa(visa_library if station is None else station.visa_library)
    with owning(state_folder(), "motorbench station scan") as owner:
        try:
            return look(
                request,
                drivers,
                clock=SystemClock(),
                owner=owner,
                visa=visa,
                computer=Computer(),
                station=station,
                say=lambda words: print(f"motorbench: {words.render(translate)}", file=sys.stderr, flush=True),
            )
        finally:
            visa.close()


def write_draft(file: Path, content: str) -> None:
    """Write a station file that holds. Raises InputError where it cannot be written, or does not hold."""
    make_station(tomllib.loads(content), str(file), content.encode())
    try:
        file.write_text(content, encoding="utf-8")
    except OSError as error:
        message = text(
            "{file}: the station file cannot be written: {strerror}", file=str(file), strerror=reason_of(error)
        )
        raise InputError(message) from error


def _host(given: str) -> tuple[str, int | None]:
    try:
        parts = urlsplit(f"//{given}")
        host, port = parts.hostname, parts.port
    except ValueError:
        host, port = None, None
    if not host or parts.path or port == 0:
        raise UsageError(
            text("--host {given}: give a name or an IP address, or one with a port like 192.168.1.5:5025", given=given)
        )
    return host, port


def _units(given: str) -> tuple[int, ...]:
    first, _, last = given.partition("-")
    if first.isdecimal() and (last.isdecimal() or not last):
        low, high = int(first), int(last or first)
        if 1 <= low <= high <= _HIGHEST_UNIT:
            return tuple(range(low, high + 1))
    raise UsageError(text("--units {given}: allowed is a number or a range from 1 to 247, like 1-16", given=given))


def _of_station(report: ScanReport, station: Station, translate: Translate) -> dict[str, dict[str, Any]]:
    """Return by role whether its address answers, and whether as its driver wants it; what a person works needs none."""
    result = {}
    for role, entry in station.entries.items():
        if not entry.address:
            continue
        there = next((one for one in report.found if role.value in one.used_by), None)
        fits = there is not None and any(match.driver.name == entry.driver.name for match in there.matches)
        undeclared = there is not None and not entry.driver.recognised_by
        result[role.value] = {
            "address": entry.address,
            "answers": there is not None,
            "fits": fits or undeclared,
            "answer": None if there is None else there.said.render(translate),
        }
    return result


def print_report(report: ScanReport, station: Station | None, translate: Translate) -> None:
    """Say what was found, what did not answer and what was not looked at."""
    console = console_on(sys.stdout)

    def line(words: Text | str, indent: str = "") -> None:
        said = words.render(translate) if isinstance(words, Text) else words
        console.print(f"{indent}{said}", markup=False, soft_wrap=True)

    if station is not None:
        line(text("{station}: of its addresses", station=station.source))
        for role, told in _of_station(report, station, translate).items():
            mark = "✓" if told["fits"] else "✗"
            words = (
                text("answers")
                if told["fits"]
                else text("the instrument that answers is not one for this driver")
                if told["answers"]
                else text("does not answer")
            )
            line(f"{mark} {role:<18}{told['address']}  {words.render(translate)}", "  ")
            if told["answer"]:
                line(told["answer"], "      ")
    others = [one for one in report.found if not one.used_by] if station is not None else report.found
    if station is None:
        line(text("Found:") if others else text("Nothing found."))
    else:
        line(text("Found besides:") if others else text("Nothing found besides."))
    for one in others:
        _print_finding(one, line)
    silent = [one for one in report.asked if not one.answered]
    if silent:
        line(text("Asked without an answer:"))
        for question in silent:
            line(
                text("{where}: {what}: {outcome}", where=question.where, what=question.what, outcome=question.outcome),
                "  ",
            )
    if report.unlooked:
        line(text("Not looked at:"))
        for place in report.unlooked:
            line(text("{where}: {why}", where=place.where, why=place.why), "  ")


def _print_finding(one: FoundInstrument, line: Any) -> None:
    line(f"{'✓' if one.matches else '?'} {one.address}", "  ")
    line(one.said, "      ")
    for match in one.matches:
        line(text("driver {driver}, role {role}", driver=match.driver.name, role=match.driver.role.value), "      ")
    if not one.matches:
        near = text("no driver recognises it; near: {drivers}", drivers=one.near)
        line(near if one.near else text("no driver recognises it"), "      ")
    if one.addresses[1:]:
        line(text("also at {addresses}", addresses=one.addresses[1:]), "      ")
