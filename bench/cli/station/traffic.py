"""`motorbench station record` and `replay`: what instruments say, byte by byte, as a file; and whether today's drivers do the same."""

import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.cli.new_file import refuse_existing
from bench.cli.options import Json, Language
from bench.cli.output import padded, print_json
from bench.cli.station.check import NO_MOTOR, DefaultAnswers, held, look
from bench.i18n.errors import UsageError, at, message
from bench.i18n.language import language_of, translator
from bench.journal.unrecorded import Unrecorded
from bench.run.console import console_on
from bench.safety.ownership.owner import owning
from bench.safety.ownership.state_folder import state_folder
from bench.safety.station_instruments import StationInstruments
from bench.station.clock import SystemClock
from bench.station.station_file import load_station
from bench.station.visa_library import StationVisa
from bench.traffic.growing_file import GrowingFile
from bench.traffic.recorder import TrafficRecorder
from bench.traffic.sampling import sample
from bench.traffic.traffic_file import SessionRecording, read_recording
from drivers.interfaces.text import Text, Translate, english, text

if TYPE_CHECKING:
    from bench.traffic.replay import Replayed


def record(
    station: Path,
    *,
    out: Path,
    force: bool = False,
    identifiable: bool = False,
    language: str = "auto",
    json: Json = False,
) -> int:
    """Open every instrument of a station file, ask who it is and how it is set, take a reading, and write down every byte.

    Nothing is energised. Exit status 1 where an instrument could not be opened; what it said is in the file all the same.

    Parameters
    ----------
    station
        The station file.
    out
        The file to write, like bench1.traffic.
    force
        Overwrite that file.
    identifiable
        Keep network addresses and serial numbers in the file.
    language
        en, zh, or auto (by the locale). Default for JSON: en.

    """
    translate = english if json and language == "auto" else translator(language_of(language))
    refuse_existing(out, force=force)
    read = load_station(station)
    clock, nowhere = SystemClock(), Unrecorded()
    tables = {role.value: entry.table for role, entry in read.entries.items()}
    growing = GrowingFile(out, tables, identifiable=identifiable)
    recorder = TrafficRecorder(clock.now, growing.take)
    with owning(state_folder(), "motorbench station record") as owner:
        instruments = StationInstruments(
            read,
            NO_MOTOR,
            clock,
            nowhere,
            nowhere,
            StationVisa(read.visa_library),
            dict.fromkeys(read.entries, DefaultAnswers()).get,
            owner=owner,
            traffic_recorder=recorder,
        )
        found: dict[str, dict[str, Any]] = {}
        try:
            for role, entry in read.entries.items():
                if not entry.driver.needs_address:
                    continue
                told = found[role.value] = held(read, entry, owner, translate) | {"readings": {}}
                if told["error"] is None:
                    look(instruments, entry, told, translate)
                if told["error"] is None:
                    told["readings"] = {
                        name: None if error is None else message(error, translate)
                        for name, error in sample(instruments.opened()[role], role)
                    }
        finally:
            instruments.close()
            made = recorder.recording(read, identifiable=identifiable)
            growing.finish(made)
    counts = {role.value: sum(line.kind in "><" for line in made.of(role)) for role in made.carriers}
    if json:
        about = {role: {**told, "messages": counts.get(role, 0)} for role, told in found.items()}
        print_json({"file": str(out), "instruments": about})
    else:
        _print_recorded(out, found, counts, translate)
    return 0 if all(told["error"] is None for told in found.values()) else 1


def replay(
    file: Path,
    *,
    tolerant: bool = False,
    serve: bool = False,
    host: str = "127.0.0.1",
    base_port: int | None = None,
    station: Path | None = None,
    language: Language = "auto",
    json: Json = False,
) -> int:
    """Repeat a recording with the present drivers, each with its recorded instrument, and report the differences.

    Exit status 1 if there are any.

    Parameters
    ----------
    file
        A recording made by `motorbench station record` or `motorbench run --record`.
    tolerant
        Accept other numbers in messages, and other results of the driver from the replies.
    serve
        Serve the recorded instruments to any client until SIGINT or SIGTERM. Standard output is a station file.
    host
        With --serve: the IPv4 address that the TCP ports listen on.
    base_port
        With --serve: first TCP port. Default: the system chooses the ports.
    station
        A station file that names the plug-ins of the recorded drivers.

    """
    recording = read_recording(file, str(station) if station else "")
    if not recording.carriers:
        raise UsageError(text("{file}: no instrument's messages are in it", file=str(file)))
    if serve:
        return _serve(recording, host, base_port, tolerant=tolerant, language=language)
    from bench.traffic.replay import replay as replayed

    done = replayed(recording, tolerant=tolerant)
    good = all(one.difference is None for one in done)
    if json:
        told = {one.role.value: _as_dict(one) for one in done}
        print_json({"file": str(file), "unfinished": recording.unfinished, "instruments": told, "good": good})
    else:
        _print_replayed(recording, done, translator(language_of(language)))
    return 0 if good else 1


def _serve(recording: SessionRecording, host: str, base_port: int | None, *, tolerant: bool, language: str) -> int:
    from tomli_w import dumps

    from bench.cli.serving import check_host, check_ports, unavailable
    from bench.safety.interrupts import Interrupted, Interrupts
    from bench.traffic.sessions import session_of
    from bench.virtual.virtual_station import as_text
    from sim_instruments.recorded.served import ServedRecording

    check_host(host)
    check_ports(base_port)
    sessions = {role.value: session_of(recording, role, tolerant=tolerant) for role in recording.carriers}
    interrupts = Interrupts()
    try:
        with interrupts.raising(), ServedRecording(sessions, host=host, base_port=base_port) as served:
            for role, ways in served.addresses.items():
                for way, address in ways.items():
                    print(f"# {role:<18}{way:<8}{as_text(address)}")
            tables = {
                role: {**recording.tables[role], "address": as_text(next(iter(ways.values())))}
                for role, ways in served.addresses.items()
            }
            print(dumps({"station": {"name": "recording"}, "instruments": tables}), flush=True)
            sentence = text("motorbench: {file} is served; Ctrl-C ends it", file=recording.source)
            print(sentence.render(translator(language_of(language))), file=sys.stderr)
            with interrupts.waiting():
                threading.Event().wait()
    except Interrupted:
        # That is how serving ends.
        return 0
    except OSError as error:
        raise unavailable(error, host) from error
    return 0


def _print_recorded(out: Path, found: dict[str, dict[str, Any]], counts: dict[str, int], translate: Translate) -> None:
    console = console_on(sys.stdout)
    for role, told in found.items():
        mark, words = ("✓", told["identity"]) if told["error"] is None else ("✗", told["error"])
        sentence = text("{count} messages", count=counts.get(role, 0)).render(translate)
        console.print(f"  {mark} {padded(translate(role), 18)}{told['driver']:<24}{sentence}", markup=False)
        console.print(f"      {words}", markup=False, soft_wrap=True)
        for name, error in told["readings"].items():
            if error is not None:
                console.print(f"      {name}: {error}", markup=False, soft_wrap=True)
    whole = at(out, text("{count} messages", count=sum(counts.values())))
    console.print(whole.render(translate), markup=False, soft_wrap=True)


def _print_replayed(recording: SessionRecording, done: "Sequence[Replayed]", translate: Translate) -> None:
    console = console_on(sys.stdout)

    def say(said: Text) -> str:
        return said.render(translate)

    about, source = recording.about, recording.source
    title = say(text("{file}, made {time}", file=source, time=about["made"])) if "made" in about else source
    console.print(title, style="bold", markup=False, soft_wrap=True)
    if recording.unfinished:
        cut = text("cut short after {count} lines: what was recorded by then is replayed", count=len(recording.lines))
        console.print(f"  {say(cut)}", markup=False)
    for one in done:
        driver = recording.tables[one.role.value]["driver"]
        mark = "✓" if one.difference is None else "✗"
        sent = say(text("{count} messages sent", count=one.messages))
        console.print(f"  {mark} {padded(translate(one.role.value), 18)}{driver:<24}{sent}", markup=False)
        if one.difference is not None:
            for said in (
                one.difference.place,
                text("recorded: {said}", said=one.difference.before),
                text("today:    {said}", said=one.difference.now),
            ):
                console.print(f"      {say(said)}", markup=False, soft_wrap=True)


def _as_dict(one: "Replayed") -> dict[str, Any]:
    found = one.difference
    told = found and {
        "line": found.recorded.number if found.recorded else None,
        "recorded": str(found.before),
        "today": str(found.now),
    }
    return {"messages": one.messages, "difference": told}
