"""The HTML page: whole in itself, and proof against names that want to be markup."""

import re
from collections.abc import Callable
from html.parser import HTMLParser
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from procedures.core.nameplate import Nameplate, WindingConnection
from reports.document.page import page

Rendered = Callable[..., dict[str, Any]]
HOSTILE = "<script>alert(1)</script>\"'><img src=x onerror=alert(1)>{{ 7*7 }}"


class Page(HTMLParser):
    """The elements of a page, its text, and what its attributes refer to."""

    def __init__(self, content: str) -> None:
        super().__init__()
        self.elements: list[str] = []
        self.text = ""
        self.ids: list[str] = []
        self.references: list[str] = []
        self.handlers: list[str] = []
        self.feed(content)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append(tag)
        for name, value in attrs:
            if name in ("src", "href", "xlink:href", "action", "data") and value:
                self.references.append(value)
            if name == "id" and value:
                self.ids.append(value)
            if name.startswith("on"):
                self.handlers.append(name)

    def handle_data(self, data: str) -> None:
        self.text += data


def hostile(name: str) -> dict[str, Any]:
    return {
        "nameplate": Nameplate(name, WindingConnection.WYE, 29.0, serial_number=name, wire_colours={"A": name}),
        "operator": name,
        "station": name,
        "cause": name,
        "motor_file": name,
        "name": name,
    }


def test_it_needs_nothing_else(rendered: Rendered) -> None:
    content = page(rendered())
    seen = Page(content)
    assert not {"script", "link", "img", "iframe", "object"} & set(seen.elements)
    assert all(reference.startswith("#") for reference in seen.references)
    assert not re.search(r"url\((?!#|data:)", content)
    assert "default-src 'none'" in content
    assert "svg" in seen.elements


def test_every_part_can_be_found(rendered: Rendered) -> None:
    made = rendered()
    seen = Page(page(made))
    for section in made["sections"]:
        assert section["anchor"] in seen.ids
        assert f"#{section['anchor']}" in seen.references
    for words in ("3.3.1-d/1", "3.3.1-d/4", "3.1.2.1/3", "d-axis inductance", "q-axis inductance", "E10", "ef" * 32):
        assert words in seen.text


@pytest.mark.parametrize("languages", [("en",), ("zh",), ("en", "zh")])
def test_hostile_names_stay_text(languages: tuple[str, ...], rendered: Rendered) -> None:
    seen = Page(page(rendered(*languages, **hostile(HOSTILE))))
    assert not {"script", "img"} & set(seen.elements)
    assert not seen.handlers
    assert seen.text.count(HOSTILE) >= 6


@pytest.mark.slow
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=10, deadline=None)
@given(name=st.text(max_size=60))
def test_any_name_at_all(name: str, rendered: Rendered) -> None:
    plain = Page(page(rendered()))
    seen = Page(page(rendered(**hostile(name))))
    assert seen.elements.count("svg") == plain.elements.count("svg")
    assert not {"script", "img"} & set(seen.elements)


def test_chinese_brings_its_letters(rendered: Rendered) -> None:
    english, chinese = page(rendered("en")), page(rendered("zh"))
    assert "@font-face" not in english
    assert "@font-face" in chinese
    assert 'lang="zh-Hans"' in chinese
    assert "电机参数测量报告" in Page(chinese).text
    assert "Motor parameter report" not in Page(chinese).text


def test_two_languages_side_by_side(rendered: Rendered) -> None:
    content = page(rendered("en", "zh"))
    seen = Page(content)
    for words in ("Motor parameter report", "电机参数测量报告", "d-axis inductance", "d 轴电感"):
        assert words in seen.text
    assert re.search(r'<span class="in" lang="en">Results</span><span class="in" lang="zh-Hans">结果</span>', content)


def test_a_chinese_name_in_an_english_report(rendered: Rendered) -> None:
    content = page(rendered("en", **hostile("三相电机")))
    assert "@font-face" in content
    assert "三相电机" in content
