"""The PDF: its text, its letters, and that nothing in it is read as markup."""

from collections.abc import Callable
from typing import Any

import pytest

from bench.i18n.language import catalogue
from reports import fonts
from reports.document.paper import paper
from reports.document.render import words_of
from tests.pdf import pages_of
from tests.reports.document.test_page import hostile

Rendered = Callable[..., dict[str, Any]]


def text_of(content: bytes) -> str:
    """The PDF's text without blanks, which a PDF has only where a line was set so."""
    pages = pages_of(content)
    return "".join("".join(page.extract_text().split()).replace("\u200b", "") for page in pages)


def embedded(content: bytes) -> set[str]:
    found = set()
    for page in pages_of(content):
        for entry in page["/Resources"].get("/Font", {}).values():
            found.add(str(entry.get_object()["/BaseFont"]).partition("+")[2])
    return found


def test_english(rendered: Rendered) -> None:
    content = paper(rendered())
    said = text_of(content)
    for words in ("3.3.1-d/1", "3.3.1-d/4", "3.1.2.1/3", "d-axisinductance", "E10", "ef" * 32, "Measuredby"):
        assert words in said
    assert embedded(content) <= {"NotoSans-Regular", "NotoSans-Bold", "NotoSansCJKsc-Regular-Identity-H"}
    assert len(pages_of(content)) >= 2


@pytest.mark.parametrize("languages", [("zh",), ("en", "zh")])
def test_chinese_without_any_font_of_the_system(languages: tuple[str, ...], rendered: Rendered) -> None:
    made = rendered(*languages)
    assert not fonts.uncovered(words_of(made))
    content = paper(made)
    said = text_of(content)
    assert "电机参数测量报告" in said
    assert ("Motorparameterreport" in said) == ("en" in languages)
    assert "NotoSansCJKsc-Regular-Identity-H" in embedded(content)


@pytest.mark.parametrize(
    "name", ['#panic("x")', "$ x $ *bold* _it_ @ref <label>", "#{sys.inputs}", "\\u{41}", "// no comment"]
)
def test_names_are_no_markup(name: str, rendered: Rendered) -> None:
    assert "".join(name.split()) in text_of(paper(rendered(**hostile(name))))


@pytest.mark.parametrize("name", ["", "\x00\x01\ud800", "a" * 400, "𠮷田🙂", "line\nbreak\ttab"])
def test_names_of_any_kind(name: str, rendered: Rendered) -> None:
    assert paper(rendered(**hostile(name))).startswith(b"%PDF")


def test_every_translation_has_its_letters() -> None:
    # Signs that only the terminal and the panel use are no letters.
    lacking = {c for said in catalogue("zh").values() for c in fonts.uncovered([said]) if c.isalnum()}
    assert not lacking


def test_what_the_fonts_lack_is_known() -> None:
    assert fonts.uncovered(["Ω µ · … λ 测", "𠮷 x"]) == {"𠮷"}
    assert fonts.chinese_subset(["only Latin, Ω"]) == b""
    assert fonts.chinese_subset(["测"])[:4] == b"OTTO"


def test_a_figure_is_not_broken_over_two_lines(rendered: Rendered) -> None:
    pages = pages_of(paper(rendered(station="low_limit=-0.25")))
    said = "".join(page.extract_text() for page in pages)
    assert "low_\u200blimit=\u200b-0.25" in said
