"""The report as PDF, set by Typst from the rendered document; nothing of the document is read as markup."""

import json
from collections.abc import Mapping
from importlib import resources
from typing import Any

from reports.document.render import words_of
from reports.fonts import FOLDER, uncovered


def paper(rendered: Mapping[str, Any]) -> bytes:
    """Return a rendered document as PDF.

    The font that comes with the program is enough for Chinese on a bare machine; for characters that it lacks the
    system's fonts are searched as well.
    """
    import typst

    template = (resources.files("reports.document") / "paper.typ").read_bytes()
    fonts = typst.Fonts(
        include_system_fonts=bool(uncovered(words_of(rendered))), include_embedded_fonts=False, font_paths=[FOLDER]
    )
    inputs = {"report": json.dumps(rendered, ensure_ascii=False)}
    result = typst.Compiler(template, font_paths=fonts, sys_inputs=inputs).compile(format="pdf")
    if not isinstance(result, bytes):
        raise TypeError(f"Typst gave {type(result).__name__} instead of one PDF")
    return result
