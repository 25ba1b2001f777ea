"""A plot of a report as data: axes in rows, with a caption."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from drivers.interfaces.text import Text
from procedures.core.axes import Axes


@dataclass(frozen=True)
class Plot:
    """Axes in rows; `heights` are the rows' shares. `name` is unique in a report, `caption` says what is seen."""

    name: str
    caption: Text
    rows: Sequence[Sequence[Axes]]
    heights: Sequence[float] = field(default_factory=lambda: (1.0,))
