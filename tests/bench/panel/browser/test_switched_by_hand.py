"""Instruments that a person sets and switches: a station without a single interface."""

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.bench.panel.browser.test_browser import begin
from tests.bench.panel.conftest import Server

pytestmark = pytest.mark.slow

Serve = Callable[..., Server]
NewPage = Callable[[], Page]
STATION = """
[station]
name = "By hand"

[instruments.supply]
driver = "manual"
maximum_voltage = 30.0
maximum_current = 3.0
voltage_accuracy = { gain = 0.005, offset = 0.05, source = "assumed" }
current_accuracy = { gain = 0.01, offset = 0.02, source = "assumed" }
"""
METER = """
[station]
name = "A meter"

[instruments.lcr_meter]
driver = "manual"
resistance_accuracy = { gain = 0.003, offset = 0.0001, source = "assumed" }
inductance_accuracy = { gain = 0.002, source = "assumed" }
"""


def serve_by_hand(serve: Serve, folder: Path) -> Server:
    station = folder / "station.toml"
    station.write_text(STATION)
    return serve("--station", str(station))


def confirm_until(page: Page, words: str) -> None:
    """Confirm by the keyboard until the heading says these words."""
    heading = page.get_by_role("heading", level=1)
    for _ in range(20):
        expect(page.locator("[data-done]:not([aria-disabled])")).to_be_visible()
        said = heading.inner_text().replace("\u00a0", " ")
        if re.search(words, said):
            return
        page.keyboard.press("Enter")
        expect(heading).not_to_have_text(said)
    raise AssertionError(f"never asked: {words}")


def enter(page: Page, typed: str) -> None:
    """Type into the field of the present step, and enter it once the step takes it."""
    page.locator("input[data-focus]").fill(typed)
    expect(page.locator("[data-done]:not([aria-disabled])")).to_contain_text(f"Enter {typed}")
    page.keyboard.press("Enter")


def type_until(page: Page, words: str) -> None:
    """Confirm and type until a reading of these words is asked for, or without any until the run has ended."""
    heading, field = page.get_by_role("heading", level=1), page.locator("input[data-focus]")
    ended = page.get_by_role("button", name="Measure the next motor")
    ready = page.locator("[data-done]:not([aria-disabled])")
    for _ in range(40):
        expect(ready.or_(ended).first).to_be_visible()
        if ended.is_visible():
            assert not words, "the run has ended"
            return
        said = heading.inner_text().replace("\u00a0", " ")
        if words and words in said:
            return
        step = str(page.locator("[data-step]").get_attribute("data-step"))
        if field.is_visible():
            field.fill("25" if "temperature" in said else "32 m" if "resistance" in said else "50 u")
        page.keyboard.press("Enter")
        page.wait_for_function(
            "step => document.querySelector('[data-step]')?.dataset.step !== step || document.querySelector('[data-next]')",
            arg=step,
        )
    raise AssertionError(f"never asked: {words}")


def correct(page: Page, which: str, typed: str) -> None:
    """Correct an earlier reading, found by its words."""
    page.get_by_role("button", name="Correct a reading").click()
    page.get_by_role("button", name=re.compile(which)).last.click()
    page.locator("input[data-focus]").fill(typed)
    expect(page.locator("[data-done]:not([aria-disabled])")).to_contain_text("Correct to")
    page.keyboard.press("Enter")
    expect(page.get_by_role("status").filter(has_text="Corrected: ")).to_be_visible()


def test_on_the_way_down_a_person_confirms_what_is_switched_off_by_hand(
    serve: Serve, new_page: NewPage, tmp_path: Path
) -> None:
    server, page = serve_by_hand(serve, tmp_path), new_page()
    begin(page, server, "Pole pairs by stable positions")
    confirm_until(page, "Read and enter: .*current")
    page.keyboard.press("Control+Escape")
    expect(page.get_by_role("heading", level=1)).to_contain_text("Switch the supply's output off")
    expect(page.get_by_role("status").filter(has_text="Aborting: switch it off by hand now")).to_be_visible()
    expect(page.locator("[data-done]:not([aria-disabled])")).to_be_focused()
    page.keyboard.press("Enter")
    expect(page.get_by_role("alert").filter(has_text="ABORTED")).to_be_visible()
    # A person's word is no reading: it is never shown in green.
    expect(page.locator("[data-left=unread]")).to_contain_text("Switched off, not read back: DC supply")


@pytest.mark.parametrize("way", ["touch", "digit", "arrows", "scanner"])
def test_a_choice_is_made_by_touch_keys_or_code_and_no_other_is_taken(
    serve: Serve, new_page: NewPage, tmp_path: Path, way: str
) -> None:
    server, page = serve_by_hand(serve, tmp_path), new_page()
    name = begin(page, server, "Pole pairs by stable positions")
    confirm_until(page, "Read and enter: .*current")
    enter(page, "1")
    confirm_until(page, "See and choose: .*regulation")
    heading, answers = page.get_by_role("heading", level=1), page.get_by_role("radio")
    ready = page.locator("[data-done]:not([aria-disabled])")
    expect(answers).to_have_count(4)
    expect(answers.and_(page.locator(":checked"))).to_have_count(0)
    # Nobody has chosen yet, and a code of something else chooses nothing.
    expect(ready).to_be_visible()
    page.keyboard.press("Enter")
    expect(page.get_by_role("alert").filter(has_text="Choose one of the answers first.")).to_be_visible()
    page.keyboard.type("7\n")
    expect(page.locator("[data-untaken]:visible")).to_contain_text("'7' was not taken")
    match way:
        case "touch":
            page.get_by_text("constant current (CC)").click()
        case "digit":
            page.keyboard.press("1")
        case "arrows":
            expect(answers.first).to_be_focused()
            page.keyboard.press("ArrowDown")
        case "scanner":
            page.evaluate("document.activeElement.blur()")
            page.keyboard.type("CC\n")
    if way != "scanner":
        expect(answers.nth(1)).to_be_checked()
        expect(ready).to_contain_text("Enter constant current (CC)")
        page.keyboard.press("Enter")
    expect(heading).not_to_contain_text("regulation")
    journal = (server.runs / name / "journal.jsonl").read_text().splitlines()
    typed = [event["data"] for event in map(json.loads, journal) if event["kind"] == "reading_typed"]
    refused, taken = [one for one in typed if "regulation" in one["quantity"]]
    assert (refused["value"], refused["refused"]) == (None, "Choose one of the answers first.")
    assert (taken["typed"], taken["value"]) == ("1", 1.0)
    assert "1 constant current (CC), 2 constant voltage (CV)" in taken["quantity"]
    # What was chosen can be corrected, by its words.
    confirm_until(page, "Read and enter")
    page.get_by_role("button", name="Correct a reading").click()
    page.get_by_role("button", name=re.compile("regulation.*constant current")).click()
    page.get_by_role("radio", name="constant voltage").check()
    expect(ready).to_contain_text("Correct to constant voltage (CV)")


def test_what_the_station_file_lacks_cannot_be_chosen_before_anything_is_opened(
    serve: Serve, new_page: NewPage, tmp_path: Path
) -> None:
    server, page = serve_by_hand(serve, tmp_path), new_page()
    page.goto(server.url)
    expect(page.get_by_role("checkbox", name=re.compile("^Stator resistance ·"))).to_be_disabled()
    expect(page.get_by_text("missing: LCR meter").first).to_be_visible()
    expect(page.get_by_role("checkbox", name=re.compile("^Pole pairs by stable positions"))).to_be_checked()


def test_a_reading_is_corrected_in_a_run_that_goes_on(serve: Serve, new_page: NewPage, tmp_path: Path) -> None:
    station = tmp_path / "meter.toml"
    station.write_text(METER)
    server, page = serve("--station", str(station)), new_page()
    name = begin(page, server, "Stator resistance ·")
    type_until(page, "reading 3 of 3")
    correct(page, "B–C|A–B", "32.3 m")
    page.keyboard.press("Control+Escape")
    page.get_by_role("button", name="Continue where it ended").click()
    expect(page.locator("[data-done]:not([aria-disabled])")).to_be_visible()
    # The procedure begins anew: its readings are typed again, and what was corrected before counts no more.
    type_until(page, "reading 3 of 3")
    correct(page, "reading 1 of 3", "32.6 m")
    type_until(page, "")
    journal = (server.runs / name / "journal.jsonl").read_text().splitlines()
    events = [json.loads(line) for line in journal]
    corrected = [one["data"] for one in events if one["kind"] == "reading_corrected"]
    assert [(one["was"], one["value"], one["by"]) for one in corrected] == [
        (0.032, 0.0323, "J. Doe"),
        (0.032, 0.0326, "J. Doe"),
    ]
    (result,) = [one["data"] for one in events if one["kind"] == "procedure_finished"]
    # (32.2 + 32 + 32) mΩ / 6: of the first pair's three one is 32.6.
    assert result["result"]["parameters"][0]["note_value"] == pytest.approx(0.0962 / 6.0)
