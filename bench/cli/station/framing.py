"""`motorbench station set-framing`: rate, format and unit number of an instrument on a shared serial line, set over that line."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import asdict
from pathlib import Path

from tomli_w import dumps

from bench.cli.held_signals import signals_held
from bench.cli.output import print_json
from bench.i18n.errors import UsageError
from bench.i18n.language import language_of, translator
from bench.safety.ownership.claims import claims_of
from bench.safety.ownership.owner import owning
from bench.safety.ownership.state_folder import state_folder
from bench.station.clock import SystemClock
from bench.station.interlock_entries import InterlockEntry
from bench.station.station_file import Entry, Station, load_station
from bench.station.watchdog_relay_entries import RelayEntry
from drivers.catalogue import Surroundings
from drivers.framing import FoundFraming, Framing, FramingSetter
from drivers.interfaces.text import Text, Translate, english, text, word
from drivers.transport.canonical_address import canonical_addresses

_YES = ("y", "yes", "是")
_HELD = text("The framing is being set. The command ends as soon as it is known where the instrument answers.")


def set_framing(
    station: Path,
    instrument: str,
    *,
    rate: int | None = None,
    format_: str | None = None,
    unit: int | None = None,
    yes: bool = False,
    dry_run: bool = False,
    language: str = "auto",
    json: bool = False,
) -> int:
    """Find an instrument on its serial line whatever its framing, and set it as the station file or the options say.

    What is and what would be is shown first; nothing is set without a yes. Afterwards it is asked again, and the lines for
    the station file are printed, which stays as it is. Exit status 1 where nothing was set that had to be.

    Parameters
    ----------
    station
        The station file. For an instrument that was never in use, only its serial port is used.
    instrument
        The role, such as dynamometer.
    rate
        The bit rate (bit/s), like 19200. Default: that of the station file.
    format_
        Data bits, parity and stop bits, like 8N2, for RTU frames. Default: those of the station file.
    unit
        The unit number on the line. Default: that of the station file.
    yes
        Set without asking.
    dry_run
        Set nothing.
    language
        en, zh, or auto (by the locale). Default for JSON: en.
    json
        Print one JSON object and nothing else. Without --yes, nothing is set.

    """
    translate = english if json and language == "auto" else translator(language_of(language))
    read = load_station(station)
    entry = _entry(read, instrument)
    with owning(state_folder(), "motorbench station set-framing") as owner:
        # Whoever has anything of this station may have an output on.
        owner.claim(claims_of(read))
        setter = entry.driver.framing_at(entry.address, entry.options, Surroundings(SystemClock()), entry.name)
        wanted = setter.wanted(rate, format_, unit)
        _refuse_taken(read, entry, wanted)
        found = setter.find(lambda words: print(f"motorbench: {words.render(translate)}", file=sys.stderr, flush=True))
        right = found.at == found.stored == wanted
        if not right:
            setter.refuse(found, wanted)
        if not json:
            with _heard(text("Nothing was set."), translate):
                _print_plan(entry, found, wanted, setter.partners(wanted), translate)
        wish = not right and not dry_run and (yes or (not json and _agreed(translate)))
        with signals_held(_HELD.render(translate)) if wish else nullcontext():
            now = setter.set(found, wanted) if wish else found.at
            partners = setter.partners(wanted) if wish or json else ()
            with _heard(text("It answers at {framing}.", framing=now.words), translate):
                if json:
                    told = {"found": _as_dict(found), "wanted": asdict(wanted), "set": wish, "now": asdict(now)}
                    messages = [one.render(translate) for one in partners]
                    rest = {"partners": messages, "entries": setter.entries(wanted)}
                    print_json({"instrument": entry.role.value, **told, **rest})
                elif right or wish:
                    _print_done(entry, setter, now, wanted, partners, translate)
                else:
                    _say(text("Nothing was set."), translate)
    return 0 if right or wish or dry_run else 1


@contextmanager
def _heard(otherwise: Text, translate: Translate) -> Iterator[None]:
    """Have what is printed within the block leave this process; where nobody reads it, say something on standard error."""
    try:
        yield
        sys.stdout.flush()
    except BrokenPipeError:
        print(f"motorbench: {otherwise.render(translate)}", file=sys.stderr, flush=True)
        raise


def _entry(station: Station, instrument: str) -> Entry:
    able = [entry for entry in station.entries.values() if entry.driver.framing]
    for entry in able:
        if instrument in (entry.role.value, entry.name):
            return entry
    if not able:
        raise UsageError(text("{station}: it has no instrument whose framing can be set", station=station.source))
    raise UsageError(
        text(
            "{instrument}: no instrument of this name has a framing that can be set; {station} has {able}",
            instrument=instrument,
            station=station.source,
            able=[entry.role.value for entry in able],
        )
    )


def _refuse_taken(station: Station, entry: Entry, wanted: Framing) -> None:
    """Raise InputError for a unit number that something else of the station has on the same line."""
    ours = set(canonical_addresses(entry.address))
    others: list[Entry | InterlockEntry | RelayEntry] = [*station.entries.values(), *station.interlocks]
    for other in (*others, *station.watchdog_relays):
        if other is entry or not other.address or not ours & set(canonical_addresses(other.address)):
            continue
        if wanted.unit in getattr(other.options, "units", ()):
            raise UsageError(
                text(
                    "unit {unit} is that of {other} on the same line; give another number with --unit",
                    unit=wanted.unit,
                    other=other.name,
                )
            )


def _agreed(translate: Translate) -> bool:
    print(f"{text('Set this now? [y/N]').render(translate)} ", end="", flush=True)
    return sys.stdin.readline().strip().casefold() in _YES


def _say(words: Text | str, translate: Translate, indent: str = "") -> None:
    message = words.render(translate) if isinstance(words, Text) else words
    # Rich would end the program by itself where nobody reads it.
    print(f"{indent}{message}")


def _print_plan(
    entry: Entry, found: FoundFraming, wanted: Framing, partners: tuple[Text, ...], translate: Translate
) -> None:
    _say(text("{name}: {said}", name=word(entry.name), said=found.said), translate)
    _say(text("  answers at    {framing}", framing=found.at.words), translate)
    if found.stored != found.at:
        _say(
            text(
                "  is set to     {framing}, which takes effect after its power has been off", framing=found.stored.words
            ),
            translate,
        )
    if wanted != found.stored:
        _say(text("  would be set  {framing}", framing=wanted.words), translate)
    for words in partners:
        _say(words, translate, "  ")


def _print_done(
    entry: Entry,
    setter: FramingSetter,
    now: Framing,
    wanted: Framing,
    partners: tuple[Text, ...],
    translate: Translate,
) -> None:
    if now == wanted:
        _say(text("The instrument now answers at {framing}.", framing=now.words), translate)
    else:
        _say(
            text(
                "Set and read back, but the instrument still answers at {now}: switch its power off and on, then "
                "run motorbench station check",
                now=now.words,
            ),
            translate,
        )
    for words in partners:
        _say(words, translate, "  ")
    if setter.present == wanted:
        _say(text("The station file says so already."), translate)
        return
    _say(text("In the station file, under [instruments.{role}]:", role=entry.role.value), translate)
    _say(dumps(setter.entries(wanted)).rstrip(), translate)


def _as_dict(found: FoundFraming) -> dict[str, object]:
    return {"said": str(found.said), "at": asdict(found.at), "stored": asdict(found.stored)}
