"""Tables over speeds that `motorbench analyze` prints: flux linkages, and decelerations of a coast-down."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from drivers.interfaces.text import Translate, text, word

if TYPE_CHECKING:
    from rich.table import Table


def speeds_table(rows: Sequence[Mapping[str, Any]], translate: Translate) -> "Table":
    """Return the speeds' rows of an analysis' details as a table; intervals are from the scatter alone."""
    from rich import box
    from rich.table import Table

    table = Table(
        box=box.SIMPLE_HEAD,
        pad_edge=False,
        title=text("By speed, intervals from the scatter alone").render(translate),
        title_justify="left",
    )
    for name in (text("Speed, rpm"), "f, Hz", text("Flux linkage, mWb"), "95 %"):
        table.add_column(word(name).render(translate), justify="right", no_wrap=True)
    for row in rows:
        low, high = (1e3 * bound for bound in row["coverage_interval"])
        table.add_row(
            "–" if row["speed_rpm"] is None else f"{row['speed_rpm']:.1f}",
            f"{row['electrical_frequency']:.3f}",
            text("not given").render(translate) if row["withheld"] else f"{1e3 * row['flux_linkage']:.5g}",
            "–" if row["withheld"] else f"{low:.5g} … {high:.5g}",
        )
    return table


def decelerations_table(rows: Sequence[Mapping[str, Any]], translate: Translate) -> "Table":
    """Return a coast-down's decelerations of an analysis' details as a table, with the friction torques where the inertia is known."""
    from rich import box
    from rich.table import Table

    from reports.tables.figures import decimals_for, figure

    title = text("By speed, without a law of friction").render(translate)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, title=title, title_justify="left")
    columns = {
        "deceleration": (text("Deceleration, rad/s²"), 1.0),
        "friction_torque": (text("Friction torque, mN·m"), 1e3),
    }
    columns = {key: each for key, each in columns.items() if any(key in row for row in rows)}
    for name in (text("Speed, rpm"), *(name for heading, _ in columns.values() for name in (heading, "95 %"))):
        table.add_column(word(name).render(translate), justify="right", no_wrap=True)
    for row in rows:
        cells = [f"{row['speed_rpm']:.5g}"]
        for key, (_, factor) in columns.items():
            if row["withheld"]:
                cells += [text("not given").render(translate), "–"]
                continue
            decimals = decimals_for(factor * row[key]["standard_uncertainty"], factor * row[key]["value"])
            bounds = (figure(factor * bound, decimals) for bound in row[key]["coverage_interval"])
            cells += [figure(factor * row[key]["value"], decimals), " … ".join(bounds)]
        table.add_row(*cells)
    return table
