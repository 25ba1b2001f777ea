"""The statement whether hands may touch the motor: it says no more than is known at this moment."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from time import monotonic
from typing import Any

from bench.journal.stored_result import restore_text
from bench.panel.live.live_run import LiveRun
from bench.panel.live.live_view import LiveView
from bench.safety.read_back import Found
from bench.station.shutdown_sequence import OFF_BY
from drivers.interfaces.text import Text, text
from reports.labels import role_name
from reports.tables.figures import figure

#: What was read back for so long (s) ago still says that outputs are off; beyond the second, nothing is known any more.
FRESH, KNOWN = 1.0, 2.0
#: What may be touched although it is energised: from this direct voltage (V) on no hand comes near. Up to it, separated extra-low
#: voltage needs no basic protection in dry places (IEC 60364-4-41, 414.4.5; one source).
EXTRA_LOW = 60.0
#: Readings, in English, that say nothing more of what is energised.
_UNSAID = ("electrical speed", "power")


class StateKind(StrEnum):
    """The states that a page tells apart."""

    OFF = "off"
    ON = "on"
    #: Nothing can be read back: a person sees to it.
    UNREAD = "unread"
    UNKNOWN = "unknown"
    ABORTING = "aborting"


@dataclass(frozen=True)
class ShownState:
    """The known state, in a sentence and its reasons; `waits` says why nothing may be confirmed, None if it may."""

    kind: StateKind
    headline: Text
    detail: Text
    waits: Text | None = None


def bench_state(run: LiveRun, now: float | None = None) -> ShownState:
    """Return what is known of a run's bench at a time (s, monotonic)."""
    view, line = run.view, run.line
    if view.going_down is not None or run.abort_asked_at is not None:
        return _going_down(run)
    age = (monotonic() if now is None else now) - line.sources_at
    asked = line.question
    sources = [one for one in line.sources if one["feeds"]]
    if view.energised:
        return _energised(view, line.sources if age <= KNOWN else (), asked)
    if asked is None:
        return _working(sources, age, turned=view.layout.shaft_turned)
    silent = [one for one in sources if one["found"] == Found.SILENT]
    if age > KNOWN or silent:
        return _unknown(silent, age)
    if on := [one for one in line.sources if one["found"] == Found.ON]:
        wait = None if asked["kind"] != "action" else text("Done: waits until it is off")
        return ShownState(
            StateKind.ON, text("On: {what}. Do not touch.", what=_told(on)), _rest(line.sources, on), wait
        )
    unread = [one for one in sources if one["found"] != Found.OFF]
    if unread or not sources:
        return _unread(unread, line.sources)
    return _off(line.sources, age)


def state_at_end(view: LiveView) -> tuple[StateKind, Text]:
    """Return what a run that has ended left, as its journal proves it: this is no statement about now."""
    if not view.ended or view.energised or any(event.error for event in view.made_safe.values()):
        return StateKind.UNKNOWN, text("Outputs not proved off: look at the bench.")
    sources = {role.value for role in OFF_BY} & {role for role, _ in view.made_safe}
    if not sources:
        return StateKind.UNREAD, text("It switched nothing on.")
    unread = sources - {event.instrument for event in view.made_safe.values() if event.value is not None}
    if unread:
        return StateKind.UNREAD, text("Switched off, not read back: {what}", what=[*map(role_name, sorted(unread))])
    return StateKind.OFF, text("Outputs were off at its end.")


def _off(found: Sequence[Mapping[str, Any]], age: float) -> ShownState:
    read = _told([one for one in found if one["values"]])
    seconds = f"{age:.1f}"
    if age > FRESH:
        headline = text("Outputs were off {age} s ago. Do not touch.", age=seconds)
        return ShownState(StateKind.UNREAD, headline, text("Reading back again: {what}", what=read))
    if any(unit == "rad/s" for one in found for _, unit in one["values"]):
        headline, detail = text("Outputs off. You may touch the leads."), text("Read back {age} s ago: {what}")
    else:
        headline = text("Outputs off.")
        detail = text("Read back {age} s ago: {what}. Speed not measured: check that the shaft is at rest.")
    return ShownState(StateKind.OFF, headline, Text(detail.template, {"age": seconds, "what": read}))


def _unread(unread: Sequence[Mapping[str, Any]], found: Sequence[Mapping[str, Any]]) -> ShownState:
    read = [one for one in found if one["values"]]
    if not unread:
        return ShownState(
            StateKind.UNREAD,
            text("This run switches nothing on."),
            text("It has no source, so none was read back. Check yourself that others are off."),
        )
    headline = text("Check yourself that it is off: {what}", what=_names(unread))
    if all(one["found"] == Found.BY_HAND for one in unread):
        why = text("It is switched by hand, and cannot be read back.")
    else:
        why = text("It cannot be read back.")
    detail = text("{why} Off: {what}", why=why, what=_told(read)) if read else why
    return ShownState(StateKind.UNREAD, headline, detail)


def _unknown(silent: Sequence[Mapping[str, Any]], age: float) -> ShownState:
    headline = text("Not known whether outputs are off. Do not touch.")
    if silent:
        detail = text(
            "{what} does not answer: {error}. Switch it off at its front, then 'Ask again'.",
            what=_names(silent),
            error=restore_text(silent[0]["error"]),
        )
    elif math.isinf(age):
        detail = text("Nothing has been read back yet.")
    else:
        detail = text("Nothing was read back for {age} s. Switch off at the front, then 'Ask again'.", age=f"{age:.0f}")
    return ShownState(StateKind.UNKNOWN, headline, detail, text("Done: waits for a known state"))


def _working(sources: Sequence[Mapping[str, Any]], age: float, *, turned: bool) -> ShownState:
    """Say what is known while a procedure has the instruments: only it may ask them. `turned` is a shaft that a hand turns for it."""
    waits = text("Measuring …")
    headline = text("Measuring. Keep your hands off.")
    if turned:
        headline = text("Measuring. Hands at the shaft only, touch no lead.")
    if not sources or all(one["found"] in (Found.BY_HAND, Found.UNREADABLE) for one in sources):
        return ShownState(StateKind.UNREAD, headline, text("Nothing is read back."), waits)
    seconds = f"{age:.0f}"
    if age <= KNOWN:
        detail = text("Commanded off; read back as off {age} s ago.", age=f"{age:.1f}")
        return ShownState(StateKind.UNREAD, headline, detail, waits)
    detail = text("Commanded off, but not read back for {age} s: the measurement has the instruments.", age=seconds)
    return ShownState(StateKind.UNKNOWN, headline if turned else text("Measuring. Do not touch."), detail, waits)


def _energised(view: LiveView, found: Sequence[Mapping[str, Any]], asked: Mapping[str, Any] | None) -> ShownState:
    on = sorted(view.energised)
    # What was read back as off stood there before it was switched on.
    read = {one["role"]: one for one in found if one["values"] and one["found"] != Found.OFF}
    messages: list[Text] = [
        _values(role, read[role]["values"]) if role in read else _last_read(view, role) for role in on
    ]
    rest = _rest(found, [{"role": role} for role in on])
    if asked is None:
        return ShownState(
            StateKind.ON, text("Energised: {what}. Do not touch.", what=messages), rest, text("Measuring …")
        )
    volts = [abs(value) for role in on for value, unit in read.get(role, {}).get("values", ()) if unit == "V"]
    if asked["kind"] == "command":
        return ShownState(StateKind.ON, text("Energised: {what}. Do not touch.", what=messages), rest)
    if asked["kind"] in ("number", "doubt", "confirm"):
        return ShownState(StateKind.ON, text("Energised: {what}. Touch no lead.", what=messages), rest)
    if not asked.get("at_shaft") or any(value >= EXTRA_LOW for value in volts):
        waits = text("Done: waits until it is off")
        return ShownState(StateKind.ON, text("Energised: {what}. Do not touch.", what=messages), rest, waits)
    least = text("less than {volts:g} V", volts=EXTRA_LOW) if volts else text("voltage not read back")
    return ShownState(
        StateKind.ON,
        text("Energised on purpose: work at the shaft, touch no lead."),
        text("{what}: {least}", what=messages, least=least),
    )


def _going_down(run: LiveRun) -> ShownState:
    view = run.view
    done: list[Text] = []
    for role in dict.fromkeys([*view.energised, *(role for role, _ in view.made_safe)]):
        outcomes = [one for (who, _), one in view.made_safe.items() if who == role]
        if any(one.error for one in outcomes):
            done.append(text("{role}: not proved off ✗", role=role_name(role)))
        elif role in view.energised or not outcomes:
            done.append(text("{role}: being switched off …", role=role_name(role)))
        else:
            done.append(text("{role}: off ✓", role=role_name(role)))
    aborting = run.abort_asked_at is not None
    detail = Text("{what}", {"what": done}) if done else text("Asked to stop; the sources are switched off.")
    if run.line.question is not None and run.line.question["kind"] == "confirm":
        by_hand = (
            text("Aborting: switch it off by hand now.") if aborting else text("Ending: switch it off by hand now.")
        )
        return ShownState(StateKind.ABORTING, by_hand, detail)
    headline = text("Aborting: switching off …") if aborting else text("Ending: switching off …")
    return ShownState(StateKind.ABORTING, headline, detail, text("The run is being ended"))


def _last_read(view: LiveView, role: str) -> Text:
    since = view.energised[role]
    values: dict[str, float] = {}
    for (instrument, quantity), kept in view.readings.items():
        # The field's speed is no shaft's, and power is what the others make; of several currents the largest says how much it is.
        if instrument != role or quantity in _UNSAID or not kept.times or kept.times[-1] < since:
            continue
        values[kept.unit] = max(values.get(kept.unit, 0.0), kept.values[-1], key=abs)
    return _values(role, [(value, unit) for unit, value in values.items()]) if values else role_name(role)


def _rest(found: Sequence[Mapping[str, Any]], but: Sequence[Mapping[str, Any]]) -> Text:
    named = {one["role"] for one in but}
    off = [one for one in found if one["role"] not in named and one["found"] == Found.OFF]
    return text("Off: {what}", what=_told(off)) if off else text("Nothing else was read back.")


def _told(found: Sequence[Mapping[str, Any]]) -> list[Text]:
    return [_values(one["role"], one["values"]) for one in found]


def _names(found: Sequence[Mapping[str, Any]]) -> list[Text]:
    return [role_name(one["role"]) for one in found]


def _values(role: str, values: Sequence[Sequence[Any]]) -> Text:
    shown = [_shown(float(value), str(unit)) for value, unit in values]
    return Text("{role} {values}", {"role": role_name(role), "values": shown})


def _shown(value: float, unit: str) -> str:
    """Return a reading whose unit stays on its line."""
    if unit == "rad/s":
        return f"{figure(value * 30.0 / math.pi, 0)}\u00a0rpm"
    return f"{figure(value, 2)}\u00a0{unit}"
