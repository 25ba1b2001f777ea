"""A document in its languages, as plain lists and strings that page and PDF are filled from."""

from collections.abc import Iterator, Mapping
from typing import Any
from xml.etree import ElementTree as Xml

from reports.document.model import (
    Block,
    Cell,
    Document,
    Drawings,
    Facts,
    Notices,
    Paragraph,
    PlotFigure,
    ReportSection,
    Signatures,
    Table,
)
from reports.document.speech import Speech
from reports.plots.draw import svg
from reports.tables.figures import with_minus


def render(document: Document, speech: Speech, drawn: Mapping[str, str] | None = None) -> dict[str, Any]:
    """Return the document as JSON-able data; every text is a list with one string a language, plots are SVG.

    `drawn` holds plots that were drawn before in these languages, by name.
    """
    return {
        "languages": speech.codes,
        "title": speech.say(document.title),
        "subtitle": clean(document.subtitle),
        "origin": clean(document.origin),
        "running": clean(document.running),
        "sections": [_section(section, speech, drawn or {}) for section in document.sections],
    }


def words_of(rendered: Any) -> Iterator[str]:
    """Give every string of a rendered document that a reader sees as letters; those of pictures are in `letters`."""
    if isinstance(rendered, str):
        yield rendered
    elif isinstance(rendered, Mapping):
        for key, value in rendered.items():
            if key != "svg":
                yield from words_of(value)
    elif isinstance(rendered, list):
        for item in rendered:
            yield from words_of(item)


def clean(words: str) -> str:
    """Return words without what no document can hold: control characters and halves of surrogate pairs."""
    kept = "".join(c if c in "\n\t" or (ord(c) >= 32 and not 0x7F <= ord(c) < 0xA0) else " " for c in words)
    return kept.encode("utf-8", "backslashreplace").decode("utf-8")


def _section(section: ReportSection, speech: Speech, drawn: Mapping[str, str]) -> dict[str, Any]:
    return {
        "title": _say(section.title, speech),
        "anchor": section.anchor,
        "level": section.level,
        "blocks": [_block(block, speech, drawn) for block in section.blocks],
    }


def _say(words: Cell, speech: Speech) -> list[str]:
    return [with_minus(clean(said)) for said in speech.say(words)]


def _block(block: Block, speech: Speech, drawn: Mapping[str, str]) -> dict[str, Any]:
    if isinstance(block, Facts):
        return {"kind": "facts", "items": [[_say(name, speech), _say(value, speech)] for name, value in block.items]}
    if isinstance(block, Table):
        return _table(block, speech)
    if isinstance(block, Paragraph):
        return {"kind": "paragraph", "words": _say(block.words, speech), "small": block.small, "code": block.code}
    if isinstance(block, Notices):
        items = [{"id": clean(identifier), "words": _say(words, speech)} for identifier, words in block.items]
        return {"kind": "notices", "items": items, "grave": block.grave}
    if isinstance(block, PlotFigure):
        caption = _say(block.plot.caption, speech)
        picture = drawn.get(block.plot.name) or svg(block.plot, speech.say)
        return {"kind": "figure", "svg": picture, "letters": _letters(picture), "caption": caption}
    if isinstance(block, Drawings):
        return _drawings(block, speech)
    return _signatures(block, speech)


def _drawings(block: Drawings, speech: Speech) -> dict[str, Any]:
    items = []
    for draw, caption in block.items:
        picture = clean(draw(speech.together))
        items.append({"svg": picture, "letters": _letters(picture), "caption": _say(caption, speech)})
    return {"kind": "drawings", "items": items}


def _letters(picture: str) -> list[str]:
    """Return a picture's words: they are letters of the page, which a page needs for its font."""
    return [words for words in Xml.fromstring(picture).itertext() if not words.isspace()]  # noqa: S314  our own


def _signatures(block: Signatures, speech: Speech) -> dict[str, Any]:
    return {"kind": "signatures", "lines": [_say(line, speech) for line in block.lines]}


def _table(table: Table, speech: Speech) -> dict[str, Any]:
    return {
        "kind": "table",
        "title": _say(table.title, speech) if table.title is not None else None,
        "remark": _say(table.remark, speech) if table.remark is not None else None,
        "columns": [
            {"title": _say(column.title, speech), "right": column.right, "wide": column.wide}
            for column in table.columns
        ],
        "rows": [
            {"cells": [_say(cell, speech) for cell in row.cells], "faint": row.faint, "total": row.total}
            for row in table.rows
        ],
    }
