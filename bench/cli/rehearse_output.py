"""A rehearsal for people: what was assumed, the script, the largest set points against their limits, how long it takes."""

import math
import sys
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from bench.by_hand.words import called
from bench.rehearsal.rehearse import SCRIPT, Rehearsed
from bench.rehearsal.script import ProcedureScript, ScriptLine
from bench.run.console import console_on
from bench.safety.limits.bounds import RPM, SetPoint
from drivers.interfaces.text import Text, Translate, text, word

if TYPE_CHECKING:
    from rich.console import Console

_SWITCHED = {"on": text("switched on"), "off": text("switched off")}


def print_rehearsal(done: Rehearsed, translate: Translate) -> None:
    """Print it on standard output."""
    console = console_on(sys.stdout)

    def say(words: Text, indent: int = 0, style: str | None = None) -> None:
        console.print(" " * indent + words.render(translate), markup=False, style=style, soft_wrap=True)

    say(
        text(
            "Rehearsal of {motor} on a virtual twin of {station}; no instrument of the station was opened",
            motor=done.request.motor.nameplate.name,
            station=done.station.name,
        ),
        style="bold",
    )
    for difference in done.twin.differences:
        say(difference, 2)
    if done.twin.assumed:
        say(text("The motor file has no [virtual] motor or drive. These values were assumed:"))
        for one in done.twin.assumed:
            why = one.why.render(translate)
            figure = f"{one.value:.4g} {one.unit}".removesuffix(" 1")
            console.print(f"  {one.name} = {figure} ({why})", markup=False, soft_wrap=True)
    for procedure in done.script.procedures:
        _print_procedure(console, procedure, translate)
    _print_highest(console, done, translate)
    if done.watchdogs:
        say(text("If all processes of the bench die at once:"))
    for watchdog in done.watchdogs:
        say(watchdog.words, 2)
    for name, message in done.script.violations:
        console.print(f"✗ {name}: {message}", markup=False, soft_wrap=True)
    for procedure in done.script.procedures:
        if procedure.cause:
            say(
                text(
                    "✗ {procedure} would not finish: {cause}",
                    procedure=word(procedure.name),
                    cause=procedure.cause,
                )
            )
    say(
        text(
            "Expected: {bench:.0f} s on the bench, {hands:.0f} s of it manual work",
            bench=done.view.bench_time,
            hands=done.hand_time,
        )
    )
    say(
        text("✓ No limit is exceeded")
        if done.good
        else text("✗ This run would fail: {cause}", cause=done.view.cause or text("a limit would be exceeded"))
    )
    say(text("Rehearsal: {file}", file=str(done.path / SCRIPT)))


def _print_procedure(console: "Console", procedure: ProcedureScript, translate: Translate) -> None:
    head = text(
        "{name}, §{section}: {bench:.0f} s, {hands:.0f} s of it manual work",
        name=word(procedure.name),
        section=procedure.section,
        bench=procedure.duration,
        hands=procedure.hand_time,
    )
    console.print()
    console.print(head.render(translate), style="bold", markup=False)
    for step in procedure.steps:
        console.print(f"  §{step.identifier}  {step.sentence}", markup=False, soft_wrap=True)
        for line in _together(step.lines, translate):
            console.print(f"    {line}", markup=False, soft_wrap=True)


def _together(lines: Sequence[ScriptLine], translate: Translate) -> Iterator[str]:
    """Say what happens in a step, the set points of one call in one line."""
    points: list[SetPoint] = []
    for line, following in zip(lines, [*lines[1:], None], strict=False):
        if line.kind == "action":
            yield from _asked(line)
            continue
        if line.kind == "perhaps":
            words = text(
                "May be asked, as readings have it: connect and read once more {lines}", lines=", ".join(line.words)
            )
            yield f"☞ {words.render(translate)}"
            continue
        if line.set_point is None:
            yield _said(line, translate)
            continue
        points.append(line.set_point)
        if following is None or not _of_one_call(line, following) or points[0].parameter == _parameter(following):
            times = f"  ×{line.times}" if line.times > 1 else ""
            said = ", ".join(_against_limit(point, translate) for point in points)
            yield f"{line.instrument}: {_called(line, translate)} {said}{times}"
            points = []


def _of_one_call(line: ScriptLine, following: ScriptLine) -> bool:
    return following.set_point is not None and (following.instrument, following.call) == (line.instrument, line.call)


def _parameter(line: ScriptLine) -> str:
    return line.set_point.parameter if line.set_point else ""


def _asked(line: ScriptLine) -> Iterator[str]:
    """Say what hands are asked for, each of its lines with the number that it has on the drawing."""
    head, *rest = line.words
    yield f"☞ {head}" + (f"  ×{line.times}" if line.times > 1 else "")
    yield from (f"    {number}. {words}" for number, words in enumerate(rest, 1))


def _said(line: ScriptLine, translate: Translate) -> str:
    times = f"  ×{line.times}" if line.times > 1 else ""
    if line.kind in _SWITCHED:
        return f"{line.instrument}: {_SWITCHED[line.kind].render(translate)}{times}"
    return f"{line.instrument}: {_called(line, translate)} {', '.join(line.words)}".rstrip() + times


def _called(line: ScriptLine, translate: Translate) -> str:
    """Return a call by the name of its method, in another language than English by what people call it."""
    words = called(line.call)
    message = words.render(translate)
    return line.call if message == str(words) else message


def _against_limit(point: SetPoint, translate: Translate) -> str:
    value = _figure(point.value, point.unit)
    message = f"{word(point.parameter).render(translate)} {value}"
    if not math.isinf(point.bound):
        limit = text("(at most {limit}, {whose})", limit=_figure(point.bound, point.unit), whose=point.owner)
        message += f" {limit.render(translate)}"
    return message + ("" if point.allowed else "  ✗")


def _figure(value: float, unit: str) -> str:
    """Return a value with its unit, a speed in rpm as well."""
    return f"{value:.4g} {unit}" + (f" ({value / RPM:.4g} rpm)" if unit == "rad/s" else "")


def _print_highest(console: "Console", done: Rehearsed, translate: Translate) -> None:
    from rich.table import Table

    if not done.script.highest:
        return
    table = Table(
        *(heading.render(translate) for heading in _HEADINGS), title=text("Largest set points").render(translate)
    )
    for (instrument, parameter), point in sorted(done.script.highest.items()):
        limited = not math.isinf(point.bound)
        table.add_row(
            instrument,
            word(parameter).render(translate),
            _figure(point.value, point.unit),
            _figure(point.bound, point.unit) if limited else "–",
            point.owner.render(translate) if limited else "–",
        )
    console.print()
    console.print(table)
    if done.script.reached:
        found = ", ".join(f"{name} {value:.4g} {unit}" for (name, unit), value in sorted(done.script.reached.items()))
        console.print(text("Largest readings on the twin: {found}", found=found).render(translate), markup=False)


_HEADINGS = (text("instrument"), text("set point"), text("largest"), text("limit"), text("set by"))
