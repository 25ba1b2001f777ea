"""The table of flux linkage over speeds that `motorbench analyze back-emf --speeds` prints."""

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
