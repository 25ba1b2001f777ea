"""A run's parameters as a picture: each with its interval, the note's figure and the type's tolerance on one axis of per cent."""

from collections.abc import Iterable, Sequence

from nicegui import ui
from nicegui.elements.mixins.text_element import TextElement

from bench.panel.pages.parts import named
from bench.panel.pages.reader import Reader
from drivers.interfaces.text import Text, text
from procedures.core.result import Withheld
from procedures.plausibility.type_tolerance import Conformity
from reports.labels import phrase
from reports.tables.deviation import DeviationRow, OnAxis, axis_end

_TICKS = (-1.0, -0.5, 0.0, 0.5, 1.0)


def parameter_picture(rows: Sequence[DeviationRow], withheld: Iterable[Withheld], reader: Reader) -> None:
    """Build it, a table whose last column is the axis, or the reason where a figure is withheld."""
    _Picture(rows, reader).build(withheld)


class _Picture:
    def __init__(self, rows: Sequence[DeviationRow], reader: Reader) -> None:
        self._rows = rows
        self._reader = reader
        self._end = axis_end(rows)

    def build(self, withheld: Iterable[Withheld]) -> None:
        with ui.element("table").classes("mb-picture"):
            self._head()
            with ui.element("tbody"):
                for row in self._rows:
                    self._row(row)
                for reason in withheld:
                    self._lacking(reason)
        if self._rows:
            self._legend()

    def _head(self) -> None:
        say = self._reader.say
        with ui.element("thead"), ui.element("tr"):
            _words("th", say(text("Parameter"))).props("scope=col")
            _words("th", say(text("Value"))).props("scope=col").classes("num")
            if not self._rows:
                _words("th", say(text("Reason"))).props("scope=col")
                return
            with ui.element("th").props("scope=col"):
                _words("div", say(self._meaning())).classes("mb-axis-title")
                with ui.element("div").classes("mb-axis-ticks").props("aria-hidden=true"):
                    for share in _TICKS:
                        words = f"{share * self._end:+g} %".replace("-", "−") if share else "0"
                        _words("span", words).style["left"] = f"{50.0 + 50.0 * share}%"

    def _meaning(self) -> Text:
        types = {row.of_type for row in self._rows if row.on_axis is not None}
        if types == {True}:
            return text("deviation from the type's value")
        if types == {False}:
            return text("deviation from the measured value")
        return text("deviation from the type's value, or from the measured value where the type has none")

    def _row(self, row: DeviationRow) -> None:
        say = self._reader.say
        with ui.element("tr"):
            with ui.element("th").props("scope=row").classes("mb-quantity"):
                _words("div", say(row.label)).classes("mb-quantity-name")
                if row.condition:
                    _words("div", say(phrase(row.condition))).classes("mb-small")
                if row.also:
                    _words("div", " ".join(f"= {also}".replace(" ", "\u00a0") for also in row.also)).classes("mb-small")
                if row.verdict is not None and row.verdict is not Conformity.WITHIN:
                    _words("div", f"⚠ {say(self._verdict(row))}").classes("mb-verdict")
            with ui.element("td").classes("num"):
                _words("span", row.value).classes("mb-value")
                spread = f" ± {row.expanded}" if row.expanded else ""
                _words("span", f"{spread} {row.unit}".rstrip())
            with ui.element("td").classes("mb-axis-cell"):
                if row.on_axis is not None:
                    self._axis(row, row.on_axis)
                elif row.exact is not None:
                    _words("span", say(row.exact))

    def _lacking(self, reason: Withheld) -> None:
        say = self._reader.say
        with ui.element("tr"):
            with ui.element("th").props("scope=row").classes("mb-quantity"):
                _words("div", say(reason.label)).classes("mb-quantity-name")
            with ui.element("td").classes("num"):
                _words("span", f"⚠ {say(text('withheld'))}").classes("mb-verdict")
            with ui.element("td").classes("mb-axis-cell"):
                _words("span", say(reason.message))

    def _verdict(self, row: DeviationRow) -> Text:
        tolerance = row.tolerance or 0.0
        if row.verdict is Conformity.OUTSIDE:
            return text("outside the type's ±{tolerance:g} %", tolerance=tolerance)
        return text("not proved within the type's ±{tolerance:g} %", tolerance=tolerance)

    def _axis(self, row: DeviationRow, on_axis: OnAxis) -> None:
        low, high = on_axis.interval
        axis = named(ui.element("div").props("role=img").classes("mb-axis"), self._reader.say(_told(on_axis)))
        axis.props["data-verdict"] = "outside" if row.verdict is Conformity.OUTSIDE else ""
        with axis:
            if row.tolerance is not None:
                _mark("tolerance", *self._span(-row.tolerance, row.tolerance))
            _mark("reference", 50.0)
            if high > low:
                _mark("interval", *self._span(low, high))
            _mark("dot", self._at(on_axis.value))
            if on_axis.note is not None:
                _mark("formula", self._at(on_axis.note))
            for beyond in {on_axis.value, on_axis.note} - {None}:
                if beyond is not None and abs(beyond) > self._end:
                    words = _words("span", f"{beyond:+.0f} %".replace("-", "−")).classes("mb-beyond")
                    words.props["data-side"] = "right" if beyond > 0.0 else "left"

    def _at(self, share: float) -> float:
        return min(max(50.0 + 50.0 * share / self._end, 0.0), 100.0)

    def _span(self, low: float, high: float) -> tuple[float, float]:
        left = self._at(low)
        return left, self._at(high) - left

    def _legend(self) -> None:
        say = self._reader.say
        entries = [("interval", text("measured, 95 % interval"))]
        if any(row.on_axis is not None and row.on_axis.note is not None for row in self._rows):
            entries.append(("formula", text("the note's formula, same readings")))
        if any(row.tolerance is not None for row in self._rows):
            entries.append(("tolerance", text("type's value with its tolerance")))
        with ui.element("div").classes("mb-legend"):
            for mark, words in entries:
                # A mark and its words stay in one line.
                with ui.element("div"):
                    with ui.element("span").classes("mb-legend-key"), ui.element("span").classes("mb-axis mb-sample"):
                        _mark(mark, 50.0) if mark == "formula" else _mark(mark, 10.0, 80.0)
                        if mark == "interval":
                            _mark("dot", 50.0)
                    _words("span", say(words))


def _told(on_axis: OnAxis) -> Text:
    """Return in words what a row's axis shows."""
    values = {"value": on_axis.value, "low": on_axis.interval[0], "high": on_axis.interval[1], "note": on_axis.note}
    if on_axis.note is None:
        return Text(text("{value:+.2g} %, interval {low:+.2g} % to {high:+.2g} %").template, values)
    message = text("{value:+.2g} %, interval {low:+.2g} % to {high:+.2g} %, the note's formula {note:+.2g} %")
    return Text(message.template, values)


def _words(tag: str, words: str) -> TextElement:
    return TextElement(tag=tag, text=words)


def _mark(kind: str, left: float, width: float | None = None) -> None:
    mark = ui.element("i")
    mark.props["data-mark"] = kind
    mark.style["left"] = f"{left:.2f}%"
    if width is not None:
        mark.style["width"] = f"{width:.2f}%"
