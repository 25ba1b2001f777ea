"""Yields on the page of statistics: of all motors, and by where, when and by which plan they were judged first."""

from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING

from nicegui import ui

from bench.eol.statistics_messages import GROUPING_WORDS, VERDICTS, interval, percentage
from bench.eol.verdict import Verdict
from bench.panel.pages.parts import table
from bench.panel.pages.reader import Reader
from drivers.interfaces.text import Text, text

if TYPE_CHECKING:
    from bench.eol.line_statistics import Yield
    from bench.eol.yields import MotorYields


def show_yields(yields: "Yield", reader: Reader) -> None:
    """Show first-pass, final and rolled yield, and how many tests came to no verdict."""
    say, motors = reader.say, yields.motors
    with ui.row().classes("gap-x-8 items-start"):
        for key, words, share in (
            ("first_pass", text("First pass"), motors.first_pass),
            ("final", text("Final"), motors.final),
        ):
            numbers = {"hits": share.hits, "count": share.count}
            below = [text("95 % interval: {interval} %", interval=interval(share))] if share.count else []
            if share.count == motors.final.count:
                below.append(text("{hits} of the {count} motors judged", **numbers))
            else:
                below.append(text("{hits} of the {count} never judged before", **numbers))
            _share(reader, key, words, percentage(share.share), *below)
        _share(
            reader,
            "rolled",
            text("Rolled"),
            percentage(motors.rolled.share),
            text("first attempts at each procedure, multiplied"),
        )
        others = [(VERDICTS[v], yields.verdicts[v]) for v in (Verdict.ERROR, Verdict.ABORTED) if yields.verdicts[v]]
        others += [(text("tested again"), motors.retested)] if motors.retested else []
        if others:
            counted = " · ".join(f"{say(words)}: {count}" for words, count in others)
            ui.label(counted).classes("text-base w-full")


def show_grouped_yields(
    motors: "MotorYields", by: str, reader: Reader, choose: Callable[[str], Awaitable[None]]
) -> None:
    """Show a choice of groupings, and the yields by the chosen one."""
    options = {grouping: reader.say(words) for grouping, words in GROUPING_WORDS.items()}
    select = ui.select(options, value=by, on_change=lambda event: choose(str(event.value)))
    select.props("outlined dense").classes("w-72 mb-2").props["aria-label"] = reader.say(text("Yield by …"))
    head = [GROUPING_WORDS[by], text("Motors"), text("First pass, %"), text("95 % interval"), text("Final, %")]
    head.append(text("95 % interval"))
    rows = [
        [
            group.name,
            str(group.final.count),
            percentage(group.first_pass.share),
            interval(group.first_pass),
            percentage(group.final.share),
            interval(group.final),
        ]
        for groups in motors.groups.values()
        for group in groups
    ]
    table([reader.say(words) for words in head], rows, numeric=frozenset({1, 2, 3, 4, 5}))


def _share(reader: Reader, key: str, words: Text, share: str, *below: Text) -> None:
    with ui.element("div") as box:
        box.props["data-yield"] = key
        ui.label(reader.say(words)).classes("text-base")
        ui.label("–" if share == "–" else f"{share} %").classes("mb-yield")
        for sentence in below:
            ui.label(reader.say(sentence)).classes("text-base")
