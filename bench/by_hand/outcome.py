"""The result of a command, in words."""

import math
from collections.abc import Mapping
from typing import Any, TypeGuard

from bench.by_hand.commands import commands_of
from bench.by_hand.hand_work import HAND_WORK, USAGE
from bench.by_hand.requests import TypedCommand
from bench.by_hand.values import spoken, words_of
from bench.journal.encoding import plain
from bench.journal.events.instruments import ReadingTaken
from bench.journal.step_readings import quantities_read
from drivers.interfaces import Role, Waveform
from drivers.interfaces.text import Text, lines, text, word
from reports.labels import role_name
from reports.tables.figures import scale_of

_BETWEEN = " · "


def outcome_of(call: TypedCommand, given: object) -> Text:
    """Return what a command gave, or that it was done."""
    said = {"role": role_name(call.command.role.value), "typed": call.typed}
    if given is None:
        return text("Done: {typed}", **said)
    return text("{role}: {given}", role=said["role"], given=_given(call, given))


def kept(call: TypedCommand, given: object) -> dict[str, Any]:
    """Return what a command gave as the run's findings keep it: figures by quantity, or what else it was."""
    result: dict[str, Any] = {"command": call.typed, "instrument": call.command.role.value}
    if figures := _figures(call, given):
        return result | {"figures": {str(quantity): [value, unit] for quantity, unit, value in figures}}
    if _is_record(given):
        return result | {"record": [int(one.channel) for one in given.values()]}
    return result | {"given": _shown(given)}


def kept_words(read: Mapping[str, Any]) -> Text:
    """Return what the findings keep of a command as people read it."""
    if "figures" in read:
        figures = [
            text("{quantity} {figure}", quantity=word(quantity), figure=figure(value, unit))
            for quantity, (value, unit) in read["figures"].items()
        ]
        return lines(figures, _BETWEEN)
    if "record" in read:
        return text("a record of channels {channels}", channels=[str(one) for one in read["record"]])
    return word(str(read["given"]))


def _is_record(given: object) -> TypeGuard[Mapping[int, Waveform]]:
    return isinstance(given, Mapping) and any(isinstance(one, Waveform) for one in given.values())


def _figures(call: TypedCommand, given: object) -> list[tuple[Text, str, float]]:
    role = call.command.role.value
    event = ReadingTaken(instrument=role, call=call.command.method, arguments=(), named={}, value=plain(given))
    return [one for one in quantities_read(event) if not math.isnan(one[2])]


def _given(call: TypedCommand, given: object) -> Text:
    if _is_record(given):
        return lines([_wave(wave) for wave in given.values()], _BETWEEN)
    read = [
        text("{quantity} {figure}", quantity=quantity, figure=figure(value, unit))
        for quantity, unit, value in _figures(call, given)
    ]
    return lines(read or [word(_shown(given))], _BETWEEN)


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
