"""A plot as SVG: its words are letters of the page's and the PDF's fonts, as in the drawings of connections."""

import math
from collections.abc import Iterator, Sequence
from html import escape
from typing import Any

import numpy as np

from procedures.core.axes import Axes, CurveStyle, FloatArray, PlotCurve
from reports.fonts import CHINESE_FAMILY, LATIN_FAMILY
from reports.plots.layout import LINE, WIDTH, PlotLayout, Say, named
from reports.plots.model import Plot
from reports.plots.ticks import label_of, ticks
from reports.tables.figures import scale_of

#: Points of an inch, in which everything is drawn.
_INCH = 72.0
#: Steps between ticks, at most, and the share of the figure's width that so many need.
_STEPS, _ROOM = 6, 0.32
#: What is left free beside the curves, as a share of what they span.
_MARGIN = 0.05
_LABEL, _FIGURES = 8.0, 7.5
#: Line styles first, shades of grey second: they survive black and white.
_MANNERS: dict[CurveStyle, str] = {
    CurveStyle.READING: "",
    CurveStyle.RECORD: 'stroke="#9e9e9e" stroke-width="0.9"',
    CurveStyle.FIT: 'stroke="#000" stroke-width="1.1"',
    CurveStyle.SECOND: 'stroke="#262626" stroke-width="1.1" stroke-dasharray="5.5 2.2"',
    CurveStyle.THIRD: 'stroke="#262626" stroke-width="1.3" stroke-dasharray="1.3 1.8"',
    CurveStyle.BROAD: 'stroke="#ccc" stroke-width="3"',
    CurveStyle.RESIDUAL: 'stroke="#595959" stroke-width="0.7"',
    CurveStyle.BARS: 'stroke="#000" stroke-width="0.7"',
}
_MARK = '<circle cx="{x:.2f}" cy="{y:.2f}" r="1.6" fill="#fff" stroke="#000" stroke-width="1"/>'


def svg(plot: Plot, say: Say) -> str:
    """Return the plot as an SVG element without prolog; two languages stand side by side."""
    layout = PlotLayout(plot, say)
    width, height = WIDTH * _INCH, layout.height * _INCH
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.1f}pt" height="{height:.1f}pt" '
        f'viewBox="0 0 {width:.1f} {height:.1f}" font-family="{LATIN_FAMILY}, {CHINESE_FAMILY}, sans-serif" fill="none">'
    ]
    for number, (axes, (left, bottom, wide, high), columns) in enumerate(layout.places()):
        frame = _Frame(axes, left * width, height * (1.0 - bottom - high), wide * width, high * height)
        identity = f"clip-{plot.name}-{number}"
        parts += frame.grid(wide)
        parts.append(
            f'<clipPath id="{identity}"><rect x="{frame.left:.2f}" y="{frame.top:.2f}" width="{frame.width:.2f}" '
            f'height="{frame.height:.2f}"/></clipPath><g clip-path="url(#{identity})">'
        )
        parts += [part for curve in axes.curves for part in frame.curve(curve)]
        parts.append("</g>")
        parts += frame.words(say, layout.left * _INCH, columns)
    return "\n".join([*parts, "</svg>"])


class _Frame:
    """One pair of axes at its place (pt): values to places."""

    def __init__(self, axes: Axes, left: float, top: float, width: float, height: float) -> None:
        self._axes = axes
        self.left, self.top, self.width, self.height = left, top, width, height
        self._x, self.x_unit = _scale([curve.x for curve in axes.curves], axes.x_unit)
        self._y, self.y_unit = _scale([curve.y for curve in axes.curves], axes.y_unit)
        self._xs = _limits([curve.x / self._x for curve in axes.curves], from_zero=axes.x_from_zero)
        self._ys = _limits([curve.y / self._y for curve in axes.curves], from_zero=axes.y_from_zero)

    def grid(self, share: float) -> Iterator[str]:
        """Give frame, grid, ticks and their figures; `share` is that of the axes of the figure's width."""
        bottom, right = self.top + self.height, self.left + self.width
        most = max(1, min(_STEPS, round(_STEPS * share / _ROOM)))
        line = '<path d="M{0:.2f} {1:.2f}L{2:.2f} {3:.2f}" stroke="{4}" stroke-width="{5}"/>'
        for value, words in _figures(ticks(*self._xs, most, whole=not self._axes.x_unit)):
            x = float(self._across(np.array(value)))
            yield line.format(x, self.top, x, bottom, "#e0e0e0", 0.5)
            yield line.format(x, bottom, x, bottom + 3, "#000", 0.6)
            yield _word(words, x, bottom + 11, _FIGURES, "middle")
        for value, words in _figures(ticks(*self._ys, _STEPS)):
            y = float(self._up(np.array(value)))
            yield line.format(self.left, y, right, y, "#e0e0e0", 0.5)
            yield line.format(self.left - 3, y, self.left, y, "#000", 0.6)
            yield _word(words, self.left - 5, y + 2.7, _FIGURES, "end")
        yield (
            f'<rect x="{self.left:.2f}" y="{self.top:.2f}" width="{self.width:.2f}" height="{self.height:.2f}" '
            'stroke="#000" stroke-width="0.6"/>'
        )

    def curve(self, curve: PlotCurve) -> Iterator[str]:
        """Give a curve: marks, or a line in as many pieces as it has."""
        x, y = self._across(curve.x / self._x), self._up(curve.y / self._y)
        there = np.isfinite(x) & np.isfinite(y)
        if curve.manner in (CurveStyle.READING, CurveStyle.TO_COME):
            yield from (_MARK.format(x=a, y=b) for a, b in zip(x[there].tolist(), y[there].tolist(), strict=True))
            return
        for piece in np.split(np.arange(x.size), np.flatnonzero(~there)):
            kept = piece[there[piece]]
            if kept.size > 1:
                points = " ".join(f"{a:.2f},{b:.2f}" for a, b in zip(x[kept].tolist(), y[kept].tolist(), strict=True))
                yield f'<polyline points="{points}" stroke-linejoin="round" {_MANNERS[curve.manner]}/>'

    def words(self, say: Say, room: float, columns: int) -> Iterator[str]:
        """Give the labels and the legend; `room` (pt) is what is free on the left of the axes."""
        middle, bottom = self.left + 0.5 * self.width, self.top + self.height
        yield _word(_label(" / ".join(say(self._axes.x_label)), self.x_unit), middle, bottom + 23, _LABEL, "middle")
        centre = self.top + 0.5 * self.height
        for number, words in enumerate(_label("\n".join(say(self._axes.y_label)), self.y_unit).split("\n")):
            x = self.left - room + 8.0 + number * LINE * _INCH
            yield _word(words, x, centre, _LABEL, "middle", upright=True)
        entries = named(self._axes)
        rows = math.ceil(len(entries) / columns)
        shown = [curve for curve in self._axes.curves if curve.name in entries]
        for number, curve in enumerate(shown):
            x = self.left + number // rows * self.width / columns
            y = self.top - 6.0 - (rows - 1 - number % rows) * LINE * _INCH
            if curve.manner in (CurveStyle.READING, CurveStyle.TO_COME):
                yield _MARK.format(x=x + 10.0, y=y)
            else:
                yield f'<path d="M{x:.2f} {y:.2f}h20" {_MANNERS[curve.manner]}/>'
            yield _word(" / ".join(say(curve.name)), x + 26.0, y + 2.7, _FIGURES, "start")

    def _across(self, values: FloatArray) -> FloatArray:
        low, high = self._xs
        return self.left + self.width * (values - low) / (high - low)

    def _up(self, values: FloatArray) -> FloatArray:
        low, high = self._ys
        return self.top + self.height * (high - values) / (high - low)


def _figures(places: Sequence[float]) -> Iterator[tuple[float, str]]:
    step = places[1] - places[0] if len(places) > 1 else abs(places[0]) if places else 1.0
    return ((place, label_of(place, step)) for place in places)


def _word(words: str, x: float, y: float, size: float, anchor: str, *, upright: bool = False) -> str:
    turned = f' transform="rotate(-90 {x:.2f} {y:.2f})"' if upright else ""
    return f'<text x="{x:.2f}" y="{y:.2f}" font-size="{size}" text-anchor="{anchor}" fill="#000"{turned}>{escape(words)}</text>'


def _limits(arrays: Sequence[FloatArray], *, from_zero: bool) -> tuple[float, float]:
    finite = [array[np.isfinite(array)] for array in arrays]
    values = np.concatenate([array.ravel() for array in finite]) if finite else np.empty(0)
    low, high = (float(values.min()), float(values.max())) if values.size else (0.0, 1.0)
    if high <= low:
        half = 0.05 * abs(low) or 0.5
        low, high = low - half, high + half
    zero = from_zero and high > 0.0
    # Of what is drawn: a curve far from zero would run along the frame.
    margin = _MARGIN * (high - (min(low, 0.0) if zero else low))
    return (0.0 if zero else low - margin), high + margin


def _label(words: str, unit: str) -> str:
    return f"{words}, {unit}" if unit else words


def _scale(arrays: Sequence[Any], unit: str) -> tuple[float, str]:
    largest = max((float(np.max(np.abs(a))) for a in arrays if np.size(a)), default=0.0)
    if unit == "s":
        return next(((f, u) for f, u in ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs")) if largest >= f), (1e-6, "µs"))
    if not math.isfinite(largest) or not largest:
        return 1.0, unit
    scale = scale_of(largest, unit)
    return scale.factor, scale.unit
