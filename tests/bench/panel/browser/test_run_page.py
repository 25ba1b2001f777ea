import json
import os
import re
import signal
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Locator, Page, expect

from tests.bench.panel.browser.conftest import PATIENCE, Panel
from tests.bench.panel.browser.test_browser import begin
from tests.bench.panel.browser.test_keyboard_and_scanner import scan
from tests.bench.panel.conftest import Server

Serve = Callable[..., Server]
NewPage = Callable[[], Page]
#: Hints below fields that reach into what stands below them.
OVERLAPPING = """() => [...document.querySelectorAll('.q-field__bottom')].filter((hint) => { const box = hint.getBoundingClientRect();
    return box.height && [...document.querySelectorAll('.q-field__control')].some((field) => { const other = field.getBoundingClientRect();
        return !field.closest('.q-field').contains(hint) && other.left < box.right && other.right > box.left
            && other.top < box.bottom - 1 && other.bottom > box.top + 1; }); }).map((hint) => hint.textContent)"""
SCREENS = ((1280, 800), (1920, 1080), (800, 1280), (390, 844))
BY_HAND = """
[station]
name = "By hand"

[instruments.lcr_meter]
driver = "manual"
resistance_accuracy = { gain = 0.003, offset = 0.0001, source = "assumed" }
inductance_accuracy = { gain = 0.002, source = "assumed" }
"""
WCAG = {"runOnly": {"type": "tag", "values": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]}}


def assert_accessible(page: Page) -> None:
    found = Axe().run(page, options=WCAG).response["violations"]
    told = [f"{one['id']}: {[node['html'][:160] for node in one['nodes']]}" for one in found]
    assert not told, "\n".join(told)


def place(button: Locator) -> Mapping[str, float]:
    box = button.bounding_box()
    assert box is not None
    return box


def assert_fits(page: Page) -> list[Mapping[str, float]]:
    """Look at the page on each screen; return where Done and ABORT stand."""
    places = []
    for width, height in SCREENS:
        page.set_viewport_size({"width": width, "height": height})
        page.wait_for_function("document.documentElement.scrollWidth <= innerWidth")
        for button in (page.locator(".mb-act .mb-done").first, page.locator(".mb-stop").last):
            expect(button).to_be_in_viewport(ratio=1)
            places.append(place(button))
    page.set_viewport_size({"width": 1280, "height": 800})
    return places


def heading(page: Page) -> Locator:
    return page.get_by_role("heading", level=1)


def next_step(page: Page) -> None:
    """Confirm by the keyboard alone, and wait for what comes then."""
    before = heading(page).inner_text()
    page.keyboard.press("Enter")
    expect(heading(page)).not_to_have_text(before)
    expect(page.locator("[data-done]:not([aria-disabled])")).to_be_visible()


def test_a_step_by_keyboard_alone_on_four_screens(panel: Panel, new_page: NewPage) -> None:
    page = new_page()
    begin(page, panel, "Pole pairs by stable positions")
    expect(page.locator("[data-state=off]").last).to_contain_text("Read back")
    expect(page.locator("[data-done]:not([aria-disabled])")).to_be_focused()
    first = assert_fits(page)
    assert_accessible(page)
    # Enter counts wherever the focus is, except on another button or link.
    page.evaluate("document.activeElement.blur()")
    next_step(page)
    page.get_by_role("link", name="Runs").focus()
    before = heading(page).inner_text()
    page.get_by_role("button", name="Mute").focus()
    page.keyboard.press("Enter")
    expect(page.get_by_role("button", name="Mute")).to_have_attribute("aria-pressed", "true")
    expect(heading(page)).to_have_text(before)
    page.evaluate("document.activeElement.blur()")
    while page.locator(".mb-status [data-state=on]").count() == 0:
        next_step(page)
        assert page.locator("[data-state=on], [data-state=off], [data-state=unknown], [data-state=unread]").count()
    expect(page.locator(".mb-status [data-state=on]")).to_contain_text("DC supply")
    assert assert_fits(page) == first
    assert_accessible(page)
    page.keyboard.press("Control+Escape")
    expect(page.get_by_role("alert").filter(has_text="ABORTED")).to_be_visible()
    assert_accessible(page)


@pytest.mark.slow
def test_a_number_is_typed_in_its_unit_and_held_back_where_it_is_far_off(
    serve: Serve, new_page: NewPage, tmp_path: Path
) -> None:
    station = tmp_path / "station.toml"
    station.write_text(BY_HAND)
    server, page = serve("--station", str(station)), new_page()
    begin(page, server, "Stator resistance ·")
    field, done = page.locator("input[data-focus]"), page.locator("[data-done]:not([aria-disabled])")
    expect(done).to_be_visible()
    while not (field.is_visible() and "resistance" in heading(page).inner_text()):
        next_step(page)
    expect(field).to_be_focused()
    page.keyboard.type("31,8m")
    expect(done).to_contain_text("Enter 31,8mΩ")
    assert_fits(page)
    assert_accessible(page)
    place_before = field.get_attribute("aria-label")
    page.keyboard.press("Enter")
    expect(field).not_to_have_attribute("aria-label", str(place_before))
    # What was typed before says in which unit one reads.
    expect(page.get_by_role("radio", name="mΩ")).to_have_attribute("aria-checked", "true")
    expect(page.get_by_role("region", name="Readings")).to_contain_text("31.8 mΩ")
    expect(done).to_be_visible()
    page.keyboard.type("3.18")
    expect(done).to_contain_text("Enter 3.18 mΩ")
    page.keyboard.press("Enter")
    held = page.get_by_role("alert").filter(has_text="more than five times off")
    expect(held).to_be_visible()
    assert place(held)["width"] > place(held)["height"]
    expect(page.get_by_role("button", name="Keep 3.18 mΩ")).to_be_visible()
    assert_accessible(page)
    # Enter returns to the field; what is typed then takes the place of what stood there.
    expect(done).to_contain_text("Type it again")
    page.keyboard.press("Enter")
    expect(field).to_be_focused()
    page.keyboard.type("many")
    expect(done).to_contain_text("Enter many")
    page.keyboard.press("Enter")
    expect(page.get_by_role("alert").filter(has_text="is not a number")).to_be_visible()
    field.fill("3.18")
    expect(done).to_contain_text("Enter 3.18 mΩ")
    page.keyboard.press("Enter")
    page.get_by_role("button", name="Keep 3.18 mΩ").click()
    expect(page.get_by_role("region", name="Readings")).to_contain_text("3.18 mΩ")
    # Any of them is corrected: chosen by its words, typed anew, announced.
    expect(done).to_be_visible()
    page.get_by_role("button", name="Correct a reading").click()
    expect(heading(page)).to_have_text("Which reading is to be corrected?")
    assert_fits(page)
    assert_accessible(page)
    page.get_by_role("button", name="reading 2 of 3").click()
    expect(field).to_be_focused()
    page.keyboard.type("31.9")
    expect(done).to_contain_text("Correct to 31.9 mΩ")
    assert_accessible(page)
    page.keyboard.press("Enter")
    expect(page.get_by_role("status").filter(has_text="reading 2 of 3 is 31.9 mΩ now")).to_be_visible()
    expect(page.get_by_role("region", name="Readings")).to_contain_text("31.9 mΩ")
    expect(page.get_by_role("region", name="Readings")).not_to_contain_text("3.18 mΩ")
    expect(heading(page)).to_contain_text("reading 3 of 3")
    expect(page.get_by_role("button", name="Correct a reading")).to_be_visible()
    page.keyboard.press("Control+Escape")
    expect(page.get_by_role("alert").filter(has_text="ABORTED")).to_be_visible()


def test_a_lost_connection_is_seen_and_comes_back_by_itself(panel: Panel, new_page: NewPage) -> None:
    page = new_page()
    begin(page, panel, "Pole pairs by stable positions")
    done, off, lost = (
        page.locator("[data-done]"),
        page.locator("[data-state=off]").last,
        re.compile(r"Connection lost \d"),
    )
    expect(off).to_be_visible()
    expect(done).to_be_focused()
    step = heading(page).inner_text()
    page.evaluate("window.same = true")
    # A server that was only slow finds the page as it was.
    os.kill(panel.pid, signal.SIGSTOP)
    try:
        expect(page.get_by_text(lost)).to_be_visible()
        expect(page.get_by_text("ABORT cannot reach the bench: press its red stop button")).to_be_visible()
        expect(off).to_be_hidden()
        expect(page.get_by_role("button", name="Abort the run")).to_be_hidden()
        expect(done).to_be_hidden()
        scan(page, "DONE")
    finally:
        os.kill(panel.pid, signal.SIGCONT)
    expect(page.get_by_text(lost)).to_be_hidden()
    expect(done).to_be_focused()
    assert page.evaluate("window.same") is True
    # What nobody could take confirms nothing, and is named.
    late = page.get_by_role("alert").filter(has_text="came while the connection was interrupted")
    expect(late).to_contain_text("'DONE' came")
    assert heading(page).inner_text() == step
    scan(page, "SN-1")
    expect(late).to_have_count(0)
    panel.stop()
    expect(page.get_by_text(lost)).to_be_visible()
    scan(page, "DONE")
    panel.start()
    expect(off).to_be_visible()
    expect(page.get_by_text(lost)).to_be_hidden()
    expect(done).to_be_visible()
    expect(late).to_contain_text("'DONE' came")
    assert heading(page).inner_text() == step


@pytest.mark.slow
def test_a_run_ends_that_no_browser_shows_any_more(panel: Panel, new_page: NewPage) -> None:
    page = new_page()
    run = panel.runs / begin(page, panel, "Pole pairs by stable positions")
    expect(page.locator("[data-done]")).to_be_visible()
    page.goto("about:blank")
    until = time.monotonic() + 3.0 * PATIENCE
    while not (run / "result.json").exists():
        assert time.monotonic() < until, "the run goes on"
        page.wait_for_timeout(500.0)
    result = json.loads((run / "result.json").read_text(encoding="utf-8"))
    assert result["status"] == "aborted"
    assert "no panel has been open" in result["cause"]


@pytest.mark.slow
def test_a_browser_that_slept_shows_nothing_old_as_off(panel: Panel, new_page: NewPage) -> None:
    page = new_page()
    begin(page, panel, "Pole pairs by stable positions")
    off = page.locator("[data-state=off]").last
    expect(off).to_be_visible()
    os.kill(panel.pid, signal.SIGSTOP)
    try:
        # In a computer's sleep the clock of the day goes on, and the page's own may not.
        page.evaluate("(now => { Date.now = () => now() + 60000; })(Date.now.bind(Date))")
        expect(page.get_by_text(re.compile(r"Connection lost 6\d"))).to_be_visible()
        expect(off).to_be_hidden()
    finally:
        os.kill(panel.pid, signal.SIGCONT)
    expect(off).to_be_visible()


@pytest.mark.slow
def test_what_was_typed_outlives_a_killed_server(serve: Serve, new_page: NewPage, tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    station.write_text(BY_HAND)
    server, page = serve("--station", str(station)), new_page()
    begin(page, server, "Stator resistance ·")
    field, done = page.locator("input[data-focus]"), page.locator("[data-done]:not([aria-disabled])")
    lost = page.get_by_text(re.compile(r"Connection lost \d"))
    expect(done).to_be_visible()
    while not (field.is_visible() and "resistance" in heading(page).inner_text()):
        next_step(page)
    page.keyboard.type("0.0318")
    page.keyboard.press("Enter")
    expect(heading(page)).to_contain_text("reading 2 of 3")
    expect(page.locator("[data-age]")).to_be_visible()
    # The unit is another than the page chooses by itself, and must not be lost without the number.
    page.get_by_role("radio", name="Ω", exact=True).click()
    field.fill("0.03")
    expect(done).to_contain_text("Enter 0.03 Ω")
    server.kill()
    expect(lost).to_be_visible()
    # An age that nobody counts on is none.
    expect(page.locator("[data-age]")).to_be_hidden()
    server.start()
    expect(lost).to_be_hidden()
    expect(page.get_by_role("radio", name="Ω", exact=True)).to_have_attribute("aria-checked", "true")
    expect(field).to_have_value("0.03")
    expect(done).to_contain_text("Enter 0.03 Ω")
    expect(field).to_be_focused()
    page.keyboard.type("19")
    expect(done).to_contain_text("Enter 0.0319 Ω")
    page.keyboard.press("Enter")
    expect(heading(page)).to_contain_text("reading 3 of 3")
    readings = page.get_by_role("region", name="Readings")
    expect(readings).to_contain_text("31.8 mΩ")
    expect(readings).to_contain_text("31.9 mΩ")
    expect(page.get_by_role("region", name="Progress")).to_contain_text("Stator resistance")
    page.keyboard.press("Control+Escape")
    expect(page.get_by_role("alert").filter(has_text="ABORTED")).to_be_visible()


@pytest.mark.slow
def test_the_other_pages_are_accessible_and_fit(panel: Panel, new_page: NewPage) -> None:
    page = new_page()
    for path in ("/", "/motor", "/history", "/statistics", "/line"):
        page.goto(f"{panel.url}{path}")
        expect(page.get_by_role("link", name="Runs")).to_be_visible()
        page.wait_for_load_state("networkidle")
        assert_accessible(page)
        for width, height in SCREENS:
            page.set_viewport_size({"width": width, "height": height})
            page.wait_for_function("document.documentElement.scrollWidth <= innerWidth")
            assert page.evaluate(OVERLAPPING) == []
        page.set_viewport_size({"width": 1400, "height": 900})
