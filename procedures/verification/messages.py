"""What the wiring's checks found, in words; the record in a result is data, and these sentences are made from it."""

from collections.abc import Mapping, Sequence
from typing import Any

from drivers.interfaces.text import Text, text
from procedures.estimation.emf.probed_phases import Fault
from procedures.estimation.winding.wiring import Kind, Outcome

Colours = Mapping[str, str]

OUTCOMES: Mapping[str, Text] = {
    Outcome.PROVED.value: text("wiring proved"),
    Outcome.UNPROVED.value: text("wiring not proved"),
    Outcome.UNEXPLAINED.value: text("wiring not explained"),
    Outcome.WRONG.value: text("wiring wrong"),
}

#: Why a connection is not proved, or what else there is to say of a check.
REASONS: Mapping[str, Text] = {
    "alike": text("the three lines read alike, so none has its third terminal connected"),
    "unlike": text("the three lines differ, so a third terminal that is connected cannot be told from an unlike phase"),
    "by hand": text("the instrument is set and read by hand, and is not asked for more than the step needs"),
    "no instrument": text("no instrument is connected that could tell"),
    "unknown": text(
        "the path is there; this run does not know the line resistances yet, so a wire more or less cannot be told"
    ),
    "too close": text(
        "the path is there; so small a winding, or so coarse a reading, does not tell a wire more or less"
    ),
    "swinging": text("the path is there; the rotor is free to swing, and it is read again once the shaft is locked"),
    "unchanged": text("nothing was touched since this connection was proved"),
    "full voltage": text(
        "the drive knows full voltage only; its own protections watch for a wire that is missing or out of order"
    ),
    "aligned": text("the locked rotor stands where the connection's current turns it"),
    "sequence": text("each channel shows its own phase, but they follow each other the other way round"),
    "one line": text("the current flows in the line that the probe is round; the others are for the inverter to watch"),
    "weak": text("the signal is too weak beside the instrument's resolution"),
    "one probe": text("there is a voltage; which two terminals it is taken from makes no difference to its frequency"),
}


def wire(terminal: str, colours: Colours) -> Text:
    """Return a terminal with its wire's colour where that is known."""
    colour = colours.get(terminal)
    if not colour:
        return Text("{terminal}", {"terminal": terminal})
    return Text("{terminal} ({colour})", {"terminal": terminal, "colour": text(colour)})


def either(words: Sequence[Text]) -> Text:
    """Return alternatives as one sentence."""
    if len(words) == 1:
        return words[0]
    return text("{first}, or {others}", first=words[0], others=either(words[1:]))


def found(entries: Sequence[Mapping[str, Any]], colours: Colours) -> Text:
    """Return what a check found, from the records of the mistakes that explain it."""
    if len(entries) > 1 and all(entry["kind"] == Kind.OPEN.value and not entry.get("earlier") for entry in entries):
        wires = [wire(terminal, colours) for entry in entries for terminal in entry["terminals"]]
        return text("one of these is open, its wire off or its phase broken: {wires}", wires=wires)
    sentences = [_said(entry, colours) for entry in entries]
    # Joined to one pole or to the other is one sentence.
    return either([words for k, words in enumerate(sentences) if words not in sentences[:k]])


def _said(entry: Mapping[str, Any], colours: Colours) -> Text:
    words = mistake(entry, colours)
    return text("at the connection before, {words}", words=words) if entry.get("earlier") else words


def mistake(entry: Mapping[str, Any], colours: Colours) -> Text:
    """Return a mistake's sentence from its record."""
    wires = [wire(terminal, colours) for terminal in entry.get("terminals", ())]
    place = wire(entry["at"], colours) if entry.get("at") else None
    match entry["kind"]:
        case Kind.OPEN.value:
            return text("{wire} is open: the wire is off, or its phase is broken", wire=wires[0])
        case Kind.JOINED.value:
            return text("{wire} is connected, and should be open", wire=wires[0])
        case Kind.TOUCHING.value:
            return text("the instrument's two leads touch each other")
        case Kind.OTHER_POLE.value:
            return text("{wire} is on the instrument's other pole", wire=wires[0])
        case Kind.EXCHANGED.value if len(wires) == 2:
            return text("{one} and {other} are interchanged", one=wires[0], other=wires[1])
        case Kind.EXCHANGED.value:
            return text("the instrument's two leads are interchanged")
        case Kind.VOLTAGE_REVERSED.value:
            return text("{lead}: tip and reference, or high and low, are interchanged", lead=_lead(entry))
        case Kind.VOLTAGE_LEAD.value if place is not None:
            return text("{lead} is on {place} instead of {wanted}", lead=_lead(entry), place=place, wanted=wires[0])
        case Kind.VOLTAGE_LEAD.value:
            return text("{lead} does not touch {wanted}", lead=_lead(entry), wanted=wires[0])
        case Kind.CURRENT_PROBE.value if place is None:
            return text("channel {channel}: the current probe is round no wire", channel=entry["channel"])
        case Kind.CURRENT_PROBE.value if entry["at"] in entry["terminals"]:
            return text(
                "channel {channel}: the current probe's arrow points away from the motor", channel=entry["channel"]
            )
        case Kind.CURRENT_PROBE.value:
            return text(
                "channel {channel}: the current probe is round the wire of {place} instead of {wanted}",
                channel=entry["channel"],
                place=place,
                wanted=wires[0],
            )
        case Fault.SILENT.value:
            return text(
                "channel {channel} shows no voltage: its tip or its reference touches nothing", channel=entry["channel"]
            )
        case Fault.REVERSED.value:
            return text("channel {channel}: tip and reference are interchanged", channel=entry["channel"])
        case Fault.TIP.value:
            return text("the tip of channel {channel} is on {place}", channel=entry["channel"], place=wires[0])
        case Fault.REFERENCE.value:
            return text(
                "the reference of channel {channel} is on {place}, not on the artificial star point",
                channel=entry["channel"],
                place=wires[0],
            )
        case Fault.JOINED.value:
            return text("{one} and {other} are connected to each other", one=wires[0], other=wires[1])
        case Fault.SEQUENCE.value:
            return text("two channels or two wires are interchanged, or the dynamometer turns the other way")
        case "third":
            return text(
                "{wire} is connected as well, or a lead of supply or voltmeter is on it instead of where it should be",
                wire=wires[0],
            )
        case "no voltage":
            return text("no channel shows a voltage: the star point's wires, or the coupling")
        case "refused":
            return text(
                "the {instrument} switches itself off: look for a wire that is off or in another's place",
                instrument=Text(entry["by"]),
            )
        case "order":
            return text("two of the three wires are interchanged, or the dynamometer turns the other way")
        case _:
            raise ValueError(f"a wiring record names the mistake {entry['kind']!r}, which is not known to this version")


def _lead(entry: Mapping[str, Any]) -> Text:
    channel, side = entry.get("channel"), entry.get("side")
    if channel is None:
        names = {"positive": text("the voltmeter's high lead"), "negative": text("the voltmeter's low lead")}
        return names.get(str(side), text("voltmeter"))
    names = {
        "positive": text("the tip of channel {channel}", channel=channel),
        "negative": text("the reference of channel {channel}", channel=channel),
    }
    return names.get(str(side), text("channel {channel}", channel=channel))


def outcome(entry: Mapping[str, Any], colours: Colours) -> Text:
    """Return a check's outcome in words from its record: the reason where it is not proved, the mistake where it was wrong."""
    said = OUTCOMES[entry["outcome"]]
    if entry["outcome"] == Outcome.WRONG.value:
        return Text("{said}: {found}", {"said": said, "found": found(entry["possible"], colours)})
    reason = REASONS.get(entry["reason"])
    return said if reason is None else Text("{said}: {reason}", {"said": said, "reason": reason})
