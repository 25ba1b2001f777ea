"""The report as one HTML file that needs nothing else: style, plots and, where Chinese is spoken, letters are in it."""

import base64
from collections.abc import Mapping
from importlib import resources
from typing import Any

from reports.document.render import words_of
from reports.fonts import CHINESE_FAMILY, chinese_subset

_TEMPLATE = "page.html.j2"
#: Characters from here on are those that a browser may have no font for.
_CHINESE = 0x2E80


def page(rendered: Mapping[str, Any]) -> str:
    """Return a rendered document as HTML; whatever came from files or people is escaped."""
    from jinja2 import Environment, StrictUndefined

    folder = resources.files("reports.document")
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    template = environment.from_string((folder / _TEMPLATE).read_text(encoding="utf-8"))
    style = (folder / "page.css").read_text(encoding="utf-8")
    return template.render(report=rendered, style=style, font_family=CHINESE_FAMILY, font=_font(rendered))


def _font(rendered: Mapping[str, Any]) -> str:
    """Return the Chinese letters that the page needs as base64; empty for a page without."""
    if not any(ord(character) >= _CHINESE for words in words_of(rendered) for character in words):
        return ""
    return base64.b64encode(chinese_subset(words_of(rendered))).decode("ascii")
