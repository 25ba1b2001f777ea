"""The yields that `motorbench eol stats` prints for people."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from bench.cli.plain_table import plain_table
from bench.eol.line_statistics import Yield
from bench.eol.statistics_messages import GROUPING_WORDS, VERDICTS, interval, percentage
from bench.eol.verdict import Verdict
from bench.eol.yields import Grouping, GroupYield
from drivers.interfaces.text import Text, Translate, text

if TYPE_CHECKING:
    from rich.table import Table


def yields_table(yields: Yield, confidence: float, translate: Translate) -> "Table":
    """Return the table of yields of all motors."""
    surely = text("{confidence:.0%} interval", confidence=confidence)
    table = plain_table(translate, text("Yield"), text("Motors"), Text("%"), surely)
    motors = yields.motors
    for words, share in ((text("First pass"), motors.first_pass), (text("Final"), motors.final)):
        table.add_row(
            words.render(translate), f"{share.hits} / {share.count}", percentage(share.share), interval(share)
        )
    table.add_row(text("Rolled").render(translate), "", percentage(motors.rolled.share), "")
    if motors.retested:
        table.add_row(text("tested again").render(translate), str(motors.retested), "", "")
    for verdict, count in yields.verdicts.items():
        if verdict in (Verdict.ERROR, Verdict.ABORTED) and count:
            table.add_row(VERDICTS[verdict].render(translate), str(count), "", "")
    return table


def groups_table(grouping: Grouping, groups: Sequence[GroupYield], translate: Translate) -> "Table":
    """Return the table of yields by one grouping."""
    table = plain_table(
        translate,
        GROUPING_WORDS[grouping],
        text("Motors"),
        text("First pass, %"),
        text("interval"),
        text("Final, %"),
        text("interval"),
    )
    for group in groups:
        table.add_row(
            group.name,
            str(group.final.count),
            percentage(group.first_pass.share),
            interval(group.first_pass),
            percentage(group.final.share),
            interval(group.final),
        )
    return table
