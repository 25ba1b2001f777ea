"""Parts of pages that hold texts of files and people: made of elements, for what stands in markup could act in it."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeAlias, TypeVar
from xml.etree import ElementTree as Xml

from nicegui import ui
from nicegui.elements.mixins.text_element import TextElement

from bench.panel.pages.reader import Reader
from drivers.interfaces.text import Text, text

#: The code that is Done to a scanner.
CONFIRMS = "DONE"

#: Words and the address that they lead to, each.
Links: TypeAlias = tuple[tuple[str, str], ...]
_Element = TypeVar("_Element", bound=ui.element)


def named(element: _Element, name: str) -> _Element:
    """Give an element the name that a screen reader says."""
    element.props["aria-label"] = name
    return element


def kept(element: _Element, asked: Text) -> _Element:
    """Make the browser keep a field's text when the page is loaded anew, and restore it to the field of the same question."""
    element.props["data-kept"] = str(asked)
    return element


def expansion(title: str) -> ui.expansion:
    """Build a part that opens by its title, which is also what a screen reader says of its arrow."""
    part = ui.expansion(title).classes("w-full text-base")
    part.props["toggle-aria-label"] = title
    return part


def untaken_note(reader: Reader) -> None:
    """Build the place where the browser says which scanned code it did not take."""
    words = text(
        "'{code}' was not taken: only the code {confirms} confirms. Nothing was done.", code="{code}", confirms=CONFIRMS
    )
    note = ui.label().classes("mb-note").props("role=alert")
    note.props["data-untaken"] = reader.say(words)
    note.props["data-idle"] = reader.say(text("'{code}' was not taken: nothing waits for it now.", code="{code}"))
    note.props["data-code"] = CONFIRMS
    late_note(reader)


def late_note(reader: Reader) -> None:
    """Build the place where the browser says which code came while the page could not take it."""
    late = text(
        "'{code}' came while the connection was interrupted: check whether it was taken, otherwise scan it again.",
        code="{code}",
    )
    ui.label().classes("mb-note").props("role=alert").props["data-late"] = reader.say(late)


def table(
    head: Sequence[str],
    lines: Iterable[Sequence[str | Links]],
    *,
    numeric: frozenset[int] = frozenset(),
    stacked: bool = False,
) -> None:
    """Build a table; columns of `numeric` stand to the right, a cell is words or links.

    One that is `stacked` has a phone show each line as a list, so that no column is out of sight.
    """
    with ui.element("table").classes("mb-table mb-stacked" if stacked else "mb-table"):
        with ui.element("thead"), ui.element("tr"):
            for number, title in enumerate(head):
                _cell("th", title, numeric=number in numeric).props("scope=col")
        with ui.element("tbody"):
            for line in lines:
                with ui.element("tr"):
                    for number, words in enumerate(line):
                        _cell("td", words, numeric=number in numeric).props["data-head"] = head[number]


def plot(options: dict[str, Any], on_point: Callable[[str, str], object] | None = None) -> ui.echart:
    """Build and return a plot, which a screen reader says by its own description; `on_point` takes a pressed point's series and name."""
    words = options["aria"]["label"]["description"]
    chart = named(ui.echart(options).classes("w-full h-80").props("role=img"), words)
    if on_point is not None:
        chart.on_point_click(lambda event: on_point(str(event.series_name or ""), str(event.name or "")))
    return chart


def beside() -> ui.element:
    """Build a place for two parts, beside each other where there is room."""
    return ui.element("div").classes("mb-beside")


def link_row(links: Links) -> None:
    """Build links beside each other."""
    with ui.element("div").classes("flex").style("flex-wrap: wrap; gap: 4px 16px"):
        for words, address in links:
            ui.link(words, address).classes("mb-link text-base")


def _cell(tag: str, words: str | Links, *, numeric: bool) -> TextElement:
    cell = TextElement(tag=tag, text=words if isinstance(words, str) else "")
    if not isinstance(words, str):
        with cell:
            link_row(words)
    return cell.classes("num") if numeric else cell


def drawing(svg: str) -> None:
    """Build a drawing of ours from its SVG, element by element."""
    _drawn(Xml.fromstring(svg))  # noqa: S314  our own


def _drawn(part: Xml.Element) -> None:
    element = TextElement(tag=part.tag.rpartition("}")[2], text=part.text or "")
    for name, value in part.attrib.items():
        element.props[name] = value
    with element:
        for inner in part:
            _drawn(inner)
