"""Places of axes and legends: they follow from the words alone, so that nothing need be drawn to be placed."""

import math
from collections.abc import Callable, Iterator, Sequence

from drivers.interfaces.text import Text, text
from procedures.core.axes import Axes
from reports.plots.model import Plot

#: Says a text in each of a document's languages.
Say = Callable[[Text], Sequence[str]]
#: Width of a plot, height of one row of axes, and what is left free around axes for their labels (inches).
WIDTH, _ROW_HEIGHT = 6.9, 1.55
_LEFT, _RIGHT, _ABOVE, _BELOW = 0.66, 0.12, 0.22, 0.42
#: One line of words, and what stands before a legend's entry (inches).
LINE, _HANDLE = 0.16, 0.55
#: Most entries of a legend side by side.
_COLUMNS = 4
#: Tells how many languages are spoken.
_SAMPLE = text("Time")


class PlotLayout:
    """A plot's height (inches), what is free on the left of its axes, and the places of these."""

    def __init__(self, plot: Plot, say: Say) -> None:
        self._plot = plot
        # A second language takes a second line beside the upright axis.
        self.left = _LEFT + (LINE if len(say(_SAMPLE)) > 1 else 0.0)
        self._width = WIDTH / max(len(row) for row in plot.rows)
        self._inner = self._width - self.left - _RIGHT
        self._columns = [min((_legend_columns(axes, say, self._inner) for axes in row), default=1) for row in plot.rows]
        self._above = [
            _ABOVE + LINE * (max(1, *(math.ceil(len(named(axes)) / columns) for axes in row)) - 1)
            for row, columns in zip(plot.rows, self._columns, strict=True)
        ]
        self.height = sum(_ROW_HEIGHT * share + _BELOW for share in plot.heights) + sum(self._above)

    def places(self) -> Iterator[tuple[Axes, tuple[float, float, float, float], int]]:
        """Give each pair of axes with its place, in shares of the figure, and its legend's columns."""
        top = self.height
        rows = zip(self._plot.rows, self._plot.heights, self._above, self._columns, strict=True)
        for row, share, above, columns in rows:
            bottom = top - above - _ROW_HEIGHT * share
            for column, axes in enumerate(row):
                left = (column * self._width + self.left) / WIDTH
                size = (self._inner / WIDTH, _ROW_HEIGHT * share / self.height)
                yield axes, (left, bottom / self.height, *size), columns
            top = bottom - _BELOW


def named(axes: Axes) -> list[Text]:
    """Return the names that stand in the legend: one curve alone needs none, nor one whose name begins with a low line."""
    if len(axes.curves) < 2:
        return []
    return [curve.name for curve in axes.curves if not curve.name.template.startswith("_")]


def _legend_columns(axes: Axes, say: Say, room: float) -> int:
    """Return how many entries of the legend fit side by side into `room` (inches)."""
    longest = max((_length(" / ".join(say(name))) for name in named(axes)), default=0.0)
    return max(1, min(_COLUMNS, int(room / (longest + _HANDLE))))


def _length(words: str) -> float:
    """Return about how long words are in the legend's letters (inches); Chinese ones are nearly twice as wide."""
    return sum(0.11 if ord(character) >= 0x2E80 else 0.06 for character in words)
