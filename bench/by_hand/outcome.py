"""What came of a command, as people read it."""

from collections.abc import Mapping
from enum import Enum
from typing import Any

from bench.by_hand.commands import commands_of
from bench.by_hand.hand_work import HAND_WORK, USAGE
from bench.by_hand.requests import Call
from bench.by_hand.values import spoken, words_of
from bench.journal.encoding import plain
from bench.journal.events.instruments import ReadingTaken
from bench.journal.step_readings import quantities_read
from drivers.interfaces import Role, Waveform
from drivers.interfaces.text import Text, lines, text
from reports.labels import role_name
from reports.tables.figures import scale_of

_BETWEEN = " · "


def outcome_of(call: Call, given: object) -> Text:
    """Return what a command gave, or that it was done."""
    said = {"role": role_name(call.command.role.value), "typed": call.typed}
    if given is None:
        return text("Done: {typed}", **said)
    return text("{role}: {given}", role=said["role"], given=_given(call, given))


def _given(call: Call, given: object) -> Text:
    if isinstance(given, Mapping) and any(isinstance(one, Waveform) for one in given.values()):
        return lines([_wave(wave) for wave in given.values()], _BETWEEN)
    if isinstance(given, Enum):
        return text(str(given.value))
    role = call.command.role.value
    event = ReadingTaken(instrument=role, call=call.command.method, arguments=(), named={}, value=plain(given))
    read = [
        text("{quantity} {figure}", quantity=quantity, figure=figure(value, unit))
        for quantity, unit, value in quantities_read(event)
        if value == value
    ]
    return lines(read or [Text("{given}", {"given": _shown(given)})], _BETWEEN)


def _wave(wave: Waveform) -> Text:
    said = {
        "channel": wave.channel,
        "points": len(wave.values),
        "low": figure(float(wave.values.min()), wave.unit),
        "high": figure(float(wave.values.max()), wave.unit),
    }
    if wave.clipped:
        return text("channel {channel}: {points} points, {low} … {high}, beyond the screen", **said)
    return text("channel {channel}: {points} points, {low} … {high}", **said)


def figure(value: float, unit: str) -> str:
    """Return a value with five digits, in the unit and with the prefix in which people say it."""
    value, unit = spoken(value, unit)
    scale = scale_of(value, unit)
    return f"{value / scale.factor:.5g} {scale.unit}".rstrip()


def _shown(given: object) -> str:
    value: Any = plain(given)
    if isinstance(value, Mapping) and "value" in value:
        return figure(float(value["value"]), str(value.get("unit", "")))
    return str(value)


def help_on(role: Role | None, roles: tuple[Role, ...], ranges: Mapping[str, float]) -> Text:
    """Return what can be typed: for one role its commands with their values, else everything by its first word."""
    if role is not None:
        return lines(Text("  {words}", {"words": _usage(role, name, dict(ranges))}) for name in commands_of(role))
    return lines(
        [
            text(
                "INSTRUMENT COMMAND VALUES, as supply energised 5 V 1 A; help INSTRUMENT lists its commands: {roles}",
                roles=[one.value for one in roles],
            ),
            text("off, or off INSTRUMENT: what is on goes off"),
            text("finish: everything off, and the run ends"),
            *USAGE.values(),
            text("by hand: {words}", words=[word for word in HAND_WORK if word not in USAGE]),
        ]
    )


def _usage(role: Role, method: str, ranges: dict[str, float]) -> Text:
    command = commands_of(role)[method]
    key = f"{role.value}.{method}"
    shown = [words_of(argument, ranges, key) for argument in command.arguments]
    return lines([Text("{key}", {"key": f"{role.value} {method}"}), *shown], " ")
