"""Messages about the wiring checks' findings; the record in a result is data, and these sentences are made from it."""

from collections.abc import Mapping, Sequence
from typing import Any

from drivers.interfaces.text import Text, text, word
from procedures.estimation.emf.probed_phases import ProbingFault
from procedures.estimation.winding.wiring import Kind, WiringOutcome

Colours = Mapping[str, str]

#: Outcomes as records of earlier versions name them.
_EARLIER_OUTCOMES = {"proved": WiringOutcome.VERIFIED.value, "not proved": WiringOutcome.UNVERIFIED.value}
OUTCOMES: Mapping[str, Text] = {
    WiringOutcome.VERIFIED.value: text("connection verified"),
    WiringOutcome.UNVERIFIED.value: text("connection not verified"),
    WiringOutcome.UNEXPLAINED.value: text("connection not as expected, cause not found"),
    WiringOutcome.WRONG.value: text("connection wrong"),
}

#: Why a connection is not verified, or what else there is to say of a check.
REASONS: Mapping[str, Text] = {
    "alike": text("the three line readings are alike, so the third terminal was open each time"),
    "unlike": text(
        "the three line readings differ: this may be an unbalanced winding, or a third terminal that is connected as well"
    ),
    "by hand": text("the instrument is set and read by a person, so no extra reading is taken to check the connection"),
    "no instrument": text("no instrument is connected that could check it"),
    "unknown": text(
        "current flows; the line resistances are not known yet in this run, so a missing or additional wire cannot be detected"
    ),
    "too close": text(
        "current flows; the winding's resistance is too small, or the reading too coarse, to detect a missing or additional wire"
    ),
    "swinging": text("current flows; the rotor is free to move, so the resistance is checked once the shaft is locked"),
    "unchanged": text("nothing was changed since this connection was verified"),
    "full voltage": text(
        "the drive runs at full voltage only; a missing or interchanged wire is detected by its own protection"
    ),
    "aligned": text("the locked rotor stands at the angle to which this connection aligns it"),
    "sequence": text("each channel shows its own phase; the phases follow each other in reverse order"),
    "one line": text("the current flows in the probed line; the other two are monitored by the inverter"),
    "weak": text("the signal is too small for the instrument's resolution"),
    "link current": text(
        "the short carries a current; whether all three terminals are in it cannot be detected without voltage probes"
    ),
    "one probe": text("there is a voltage; its frequency is the same between any two terminals"),
}


def wire(terminal: str, colours: Colours) -> Text:
    """Return a terminal with its wire's colour where that is known."""
    colour = colours.get(terminal)
    if not colour:
        return Text("{terminal}", {"terminal": terminal})
    return Text("{terminal} ({colour})", {"terminal": terminal, "colour": word(colour)})


def either(words: Sequence[Text]) -> Text:
    """Return alternatives as one sentence."""
    if len(words) == 1:
        return words[0]
    return text("{first}, or {others}", first=words[0], others=either(words[1:]))


def found(entries: Sequence[Mapping[str, Any]], colours: Colours) -> Text:
    """Return what a check found, from the records of the mistakes that explain it."""
    if len(entries) > 1 and all(entry["kind"] == Kind.OPEN.value and not entry.get("earlier") for entry in entries):
        wires = [wire(terminal, colours) for entry in entries for terminal in entry["terminals"]]
        return text("one of these is open (wire off, or phase broken): {wires}", wires=wires)
    sentences = [_said(entry, colours) for entry in entries]
    # Joined to one pole or to the other is one sentence.
    return either([words for k, words in enumerate(sentences) if words not in sentences[:k]])


def _said(entry: Mapping[str, Any], colours: Colours) -> Text:
    words = mistake(entry, colours)
    return text("in the previous connection, {words}", words=words) if entry.get("earlier") else words


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
            return text(
                "channel {channel}: the current probe is round no wire, or switched off", channel=entry["channel"]
            )
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
        case ProbingFault.SILENT.value:
            return text(
                "channel {channel} shows no voltage: its tip or its reference is not connected, or the probe is "
                "defective: test it on the oscilloscope's calibrator",
                channel=entry["channel"],
            )
        case "tenth":
            return text(
                "channel {channel} shows a tenth of what the others show: the switch on its probe and the factor that is set for "
                "the channel differ",
                channel=entry["channel"],
            )
        case "channel":
            return text(
                "channel {channel} is AC coupled, or its zero, its range or its probe's factor is not as set",
                channel=entry["channel"],
            )
        case ProbingFault.REVERSED.value:
            return text("channel {channel}: tip and reference are interchanged", channel=entry["channel"])
        case ProbingFault.TIP.value:
            return text("the tip of channel {channel} is on {place}", channel=entry["channel"], place=wires[0])
        case ProbingFault.REFERENCE.value:
            return text(
                "the reference of channel {channel} is on {place}, not on the artificial star point",
                channel=entry["channel"],
                place=wires[0],
            )
        case ProbingFault.JOINED.value:
            return text("{one} and {other} are connected to each other", one=wires[0], other=wires[1])
        case ProbingFault.SEQUENCE.value:
            return text("two channels or two wires are interchanged, or the dynamometer turns the other way")
        case "not joined":
            return text("the terminals are not joined: the shorting link, or the contactor, is open")
        case "third":
            return text(
                "{wire} is connected as well, or a lead of the supply or the voltmeter is on it by mistake",
                wire=wires[0],
            )
        case "contacts":
            return text(
                "contacts of the clamps are in the reading, and are others each time: clean them, and put the voltmeter's leads on the "
                "motor's terminals themselves, not on the supply's clamps"
            )
        case "no voltage":
            return text("no channel shows a voltage: check the star point's wires and the coupling")
        case "refused":
            return text(
                "the {instrument} switches itself off: look for a wire that is off or interchanged with another",
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
    """Return a check's outcome in words from its record: the reason where it is not verified, the mistake where it was wrong."""
    said = OUTCOMES[_EARLIER_OUTCOMES.get(entry["outcome"], entry["outcome"])]
    if entry["outcome"] == WiringOutcome.WRONG.value:
        return Text("{said}: {found}", {"said": said, "found": found(entry["possible"], colours)})
    reason = REASONS.get(entry["reason"])
    return said if reason is None else Text("{said}: {reason}", {"said": said, "reason": reason})
