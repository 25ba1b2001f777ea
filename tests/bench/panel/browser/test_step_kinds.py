"""Each kind of step by a foot switch and by a scanner alone, wherever the focus is."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from bench.journal.stored_result import store_text
from bench.operators.panel_answers import told_options
from drivers.interfaces.text import text
from drivers.manual.supply import MODES, REGULATION
from procedures.core.actions import ALIGN_D, MarkRestPositions, TurnToRest
from tests.bench.panel.browser.conftest import Panel
from tests.bench.panel.browser.test_keyboard_and_scanner import scan
from tests.bench.panel.browser.test_run_page import assert_accessible, assert_fits
from tests.bench.panel.shown_run import ShownRun

pytestmark = pytest.mark.slow

OFF = {"role": "supply", "found": "off", "feeds": True, "values": [[0.0, "V"]], "error": None}
NUMBER = {"quantity": store_text(text("resistance")), "unit": "Ω", "minimum": 0.0, "maximum": 2e8, "proposed": None}
CHOICE = {**NUMBER, "quantity": store_text(REGULATION), "unit": "", "options": told_options([*MODES.values()])}


def action(name: str, lines: list[Any], **more: object) -> tuple[str, Mapping[str, Any]]:
    return "action", {"action": name, "lines": [store_text(line) for line in lines], **more}


#: What is asked, what is typed and pressed, what is scanned instead, and what the run is answered.
KINDS: Mapping[str, tuple[tuple[str, Mapping[str, Any]], str, str, object]] = {
    "connect": (action("Connect", ALIGN_D.lines({})), "", "DONE", None),
    "turn": (action("TurnToRest", TurnToRest().lines({}), at_shaft=True), "", "done", None),
    "type": (("number", {**NUMBER, "options": []}), "31.8 m", "31.8 m", "31.8 mΩ"),
    "choose": (("number", CHOICE), "2", "CV", "2"),
    "set": (
        ("confirm", {"instrument": "supply", "task": store_text(text("Switch the supply's output on."))}),
        "",
        "DONE",
        None,
    ),
    "doubt": (("doubt", {"lines": [store_text(text("resistance"))]}), "", "DONE", True),
    "mark": (
        ("angles", action("MarkRestPositions", MarkRestPositions().lines({}))[1]),
        "0 90 180",
        "0 90 180",
        ["0", "90", "180"],
    ),
}


@pytest.fixture
def shown(panel: Panel) -> Iterator[ShownRun]:
    with (
        ShownRun(panel.runs / "kinds", "stator-resistance", "3.2.2/3", "Measure the three line resistances") as run,
        run.reading_back([OFF]),
    ):
        yield run
    for path in (panel.runs / "kinds").iterdir():
        path.unlink()
    (panel.runs / "kinds").rmdir()


def come_to(page: Page, panel: Panel) -> None:
    """Open the run and have the control of it, also where a browser before this one had it."""
    page.goto(f"{panel.url}/runs/kinds")
    expect(page.get_by_text("Measuring …")).to_be_visible()
    page.get_by_role("button", name="Take the control").click()
    expect(page.get_by_text("You have the control")).to_be_visible()


@pytest.mark.parametrize("way", ["foot", "scanner"])
def test_every_kind_of_step_is_answered_without_a_pointer(
    panel: Panel, shown: ShownRun, new_page: Callable[[], Page], way: str
) -> None:
    page = new_page()
    come_to(page, panel)
    ready = page.locator("[data-done]:not([disabled], [aria-disabled])")
    waiting = page.get_by_text("Measuring …")
    # While it measures there is nothing to confirm, and nothing is kept for later.
    scan(page, "DONE") if way == "scanner" else page.keyboard.press("Enter")
    for kind, ((question, more), typed, code, answer) in KINDS.items():
        answered = len(shown.answers)
        shown.ask(question, **more)
        expect(ready).to_be_visible()
        assert len(shown.answers) == answered, kind
        # Wherever the focus was left.
        page.evaluate("document.activeElement.blur()")
        if way == "scanner":
            scan(page, code)
        else:
            page.keyboard.type(typed)
            if typed:
                page.wait_for_timeout(200)
            page.keyboard.press("Enter")
        expect(waiting).to_be_visible()
        assert shown.answers[answered:] == [answer], kind
    assert len(shown.answers) == len(KINDS)


def test_every_kind_of_step_stands_after_the_page_was_loaded_anew_and_a_held_foot_switch_counts_once(
    panel: Panel, shown: ShownRun, new_page: Callable[[], Page]
) -> None:
    page = new_page()
    come_to(page, panel)
    ready = page.locator("[data-done]:not([disabled], [aria-disabled])")
    heading = page.get_by_role("heading", level=1)
    for kind, ((question, more), typed, _, answer) in KINDS.items():
        answered = len(shown.answers)
        shown.ask(question, **more)
        expect(ready).to_be_visible()
        asked = heading.inner_text()
        page.reload()
        expect(heading).to_have_text(asked)
        expect(page.get_by_text("You have the control")).to_be_visible()
        expect(ready).to_be_visible()
        page.keyboard.type(typed)
        page.wait_for_timeout(200)
        page.keyboard.down("Enter")
        expect(page.get_by_text("Measuring …")).to_be_visible()
        # The next question comes while the foot is still on the switch.
        shown.ask(*KINDS["connect"][0][:1], **KINDS["connect"][0][1])
        expect(ready).to_be_visible()
        for _ in range(5):
            page.keyboard.down("Enter")
            page.wait_for_timeout(100)
        assert shown.answers[answered:] == [answer], kind
        page.keyboard.up("Enter")
        page.keyboard.press("Enter")
        expect(page.get_by_text("Measuring …")).to_be_visible()
        assert shown.answers[answered:] == [answer, None], kind


def test_what_is_typed_and_not_entered_outlives_the_change_of_language(
    panel: Panel, shown: ShownRun, new_page: Callable[[], Page]
) -> None:
    page = new_page()
    come_to(page, panel)
    field = page.locator("input[data-focus]")
    for kind, typed, entered in (("type", "31.8", "输入 31.8 mΩ"), ("mark", "0 90 180", "完成")):
        (question, more), _, _, _ = KINDS[kind]
        shown.ask(question, **more)
        expect(field).to_be_focused()
        if kind == "type":
            page.get_by_role("radio", name="mΩ").click()
        field.fill(typed)
        page.get_by_role("button", name="中文").click()
        expect(page.locator("html[lang=zh]")).to_be_attached()
        expect(field).to_have_value(typed)
        expect(page.locator("[data-done]")).to_contain_text(entered)
        page.get_by_role("button", name="English").click()
        expect(page.locator("html[lang=en]")).to_be_attached()
        expect(field).to_have_value(typed)
        expect(page.locator("[data-done]:not([disabled], [aria-disabled])")).to_be_visible()
        page.keyboard.press("Enter")
        expect(page.get_by_text("Measuring …")).to_be_visible()
    assert shown.answers == ["31.8 mΩ", ["0", "90", "180"]]


def test_a_half_filled_motor_form_outlives_the_change_of_language(panel: Panel, new_page: Callable[[], Page]) -> None:
    page = new_page()
    page.goto(f"{panel.url}/motor")
    page.get_by_label("Rated current").fill("2.5")
    page.get_by_role("button", name="中文").click()
    expect(page.locator("html[lang=zh]")).to_be_attached()
    expect(page.get_by_label("额定电流")).to_have_value("2.5")


def test_the_answers_of_a_choice_fit_and_are_accessible_on_four_screens(
    panel: Panel, shown: ShownRun, new_page: Callable[[], Page]
) -> None:
    page = new_page()
    come_to(page, panel)
    shown.ask("number", **CHOICE)
    expect(page.get_by_role("radio").first).to_be_visible()
    for width, height in ((1280, 800), (1920, 1080), (800, 1280), (390, 844)):
        page.set_viewport_size({"width": width, "height": height})
        for answer in page.locator(".mb-option").all():
            assert answer.evaluate("at => at.getBoundingClientRect().height") >= 48.0
            assert answer.evaluate("at => at.scrollWidth <= at.clientWidth")
        assert_fits(page)
    assert_accessible(page)
    page.set_viewport_size({"width": 1400, "height": 900})
