"""Instruments that a person sets and switches: a station without a single interface."""

import re
from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import Page, expect

from tests.bench.panel.browser.test_browser import begin
from tests.bench.panel.conftest import Server

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


def serve_by_hand(serve: Serve, folder: Path) -> Server:
    station = folder / "station.toml"
    station.write_text(STATION)
    return serve("--station", str(station))


def confirm_until(page: Page, words: str) -> None:
    """Confirm by the keyboard until the heading says these words."""
    heading = page.get_by_role("heading", level=1)
    for _ in range(20):
        expect(page.locator("[data-done]:not([aria-disabled])")).to_be_visible()
        said = heading.inner_text()
        if re.search(words, said):
            return
        page.keyboard.press("Enter")
        expect(heading).not_to_have_text(said)
    raise AssertionError(f"never asked: {words}")


def test_on_the_way_down_a_person_confirms_what_is_switched_off_by_hand(
    serve: Serve, new_page: NewPage, tmp_path: Path
) -> None:
    server, page = serve_by_hand(serve, tmp_path), new_page()
    page.bring_to_front()
    begin(page, server, "Pole pairs by stable positions")
    confirm_until(page, "Read and enter: .*current")
    page.keyboard.press("Control+Escape")
    expect(page.get_by_role("heading", level=1)).to_contain_text("Switch the supply's output off")
    expect(page.get_by_role("status").filter(has_text="Aborting: switch it off by hand now")).to_be_visible()
    expect(page.locator("[data-done]:not([aria-disabled])")).to_be_focused()
    page.keyboard.press("Enter")
    expect(page.get_by_role("alert").filter(has_text="ABORTED")).to_be_visible()
    expect(page.get_by_text("Outputs off.")).to_be_visible()


def test_a_choice_takes_only_the_numbers_that_it_names(serve: Serve, new_page: NewPage, tmp_path: Path) -> None:
    server, page = serve_by_hand(serve, tmp_path), new_page()
    page.bring_to_front()
    begin(page, server, "Pole pairs by stable positions")
    confirm_until(page, "Read and enter: .*current")
    page.keyboard.type("1")
    page.keyboard.press("Enter")
    confirm_until(page, "regulation")
    page.keyboard.type("0.4")
    page.keyboard.press("Enter")
    expect(page.get_by_role("alert").filter(has_text="0.4 is not a whole number")).to_be_visible()
    page.keyboard.type("cc")
    page.keyboard.press("Enter")
    expect(page.get_by_role("heading", level=1)).not_to_contain_text("regulation")


def test_what_the_station_file_lacks_cannot_be_chosen_before_anything_is_opened(
    serve: Serve, new_page: NewPage, tmp_path: Path
) -> None:
    server, page = serve_by_hand(serve, tmp_path), new_page()
    page.goto(server.url)
    expect(page.get_by_role("checkbox", name=re.compile("^Stator resistance ·"))).to_be_disabled()
    expect(page.get_by_text("missing: LCR meter").first).to_be_visible()
    expect(page.get_by_role("checkbox", name=re.compile("^Pole pairs by stable positions"))).to_be_checked()
