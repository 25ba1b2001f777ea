import json
import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from playwright.sync_api import Error, Page, expect

from tests.bench.panel.browser.conftest import Panel
from tests.bench.panel.conftest import Server

Serve = Callable[..., Server]
NewPage = Callable[[], Page]
#: Of each drawing of the connections that is to be seen, whether it is wider than it is high.
ACROSS = """[...document.querySelectorAll('.mb-draw svg[role=img]')].map((each) => each.getBoundingClientRect())
    .filter((box) => box.width).map((box) => box.width > box.height).join()"""

#: Whether each drawing ends above its card's end.
WITHIN = """[...document.querySelectorAll('.mb-draw svg[role=img]')].every((each) =>
    each.getBoundingClientRect().bottom <= (each.closest('.mb-step').getClientRects()[0]
        ?? each.closest('.mb-grid').getBoundingClientRect()).bottom)"""


def choose(page: Page, motor: str, *procedures: str) -> None:
    """Choose a motor and these procedures alone, each by the beginning of its title."""
    page.get_by_label("Motor type").click()
    page.get_by_text(f"{motor} (virtual)").click()
    page.get_by_role("button", name="None").click()
    expect(page.get_by_role("checkbox", checked=True)).to_have_count(0)
    for title in procedures:
        page.get_by_role("checkbox", name=re.compile(f"^{title}")).click()


def begin(page: Page, server: Server, *procedures: str, motor: str = "lg-400w") -> str:
    """Order a run at the start page and return its name."""
    page.goto(server.url)
    page.get_by_label("Operator's name").fill("J. Doe")
    page.get_by_label("Serial number").fill("SN-0815")
    choose(page, motor, *procedures)
    page.get_by_role("button", name="Start", exact=True).click()
    page.wait_for_url("**/runs/**")
    return page.url.rpartition("/")[2]


def answer_until_end(page: Page) -> None:
    """Confirm whatever is asked, as a person does who reads nothing."""
    ended, done = page.locator("[data-next]"), page.locator("[data-done]:not([disabled], [aria-disabled])")
    for _ in range(300):
        done.or_(ended).first.wait_for()
        if ended.is_visible():
            return
        # It may go away under the pointer: the next question is coming.
        with suppress(Error):
            done.click(timeout=500)
    raise AssertionError("the run did not end")


def kinds(server: Server, run: str) -> list[str]:
    lines = (server.runs / run / "journal.jsonl").read_text().splitlines()
    return [json.loads(line)["kind"] for line in lines]


@pytest.mark.slow
def test_the_connections_are_drawn_and_told(panel: Panel, new_page: NewPage) -> None:
    page = new_page()
    begin(page, panel, "Pole pairs by stable positions")
    picture = page.get_by_role("img", name=re.compile("^Connections"))
    while not picture.is_visible():
        page.get_by_role("button", name="Done").click()
        page.wait_for_timeout(100)
    assert "A (white) → supply, plus" in str(picture.get_attribute("aria-label"))
    page.wait_for_function(f"{ACROSS} === 'true'")
    page.set_viewport_size({"width": 390, "height": 844})
    page.wait_for_function(f"{ACROSS} === 'false'")
    page.set_viewport_size({"width": 1400, "height": 900})


@pytest.mark.slow
def test_a_small_screen_shows_the_whole_drawing_and_keeps_abort_in_reach(panel: Panel, new_page: NewPage) -> None:
    page = new_page()
    page.set_viewport_size({"width": 820, "height": 600})
    begin(page, panel, "Stator resistance ·")
    picture = page.get_by_role("img", name=re.compile("^Conn"))
    for _ in range(4):
        expect(page.get_by_role("button", name="Done")).to_be_visible()
        page.wait_for_function(WITHIN)
        page.get_by_role("button", name="Done").click()
        page.wait_for_timeout(300)
    expect(picture).to_be_visible()
    page.mouse.wheel(0, 5000)
    expect(page.get_by_role("button", name="Abort the run")).to_be_in_viewport()
    page.set_viewport_size({"width": 1400, "height": 900})


def test_abort_takes_the_way_down_and_cannot_be_overlooked(panel: Panel, new_page: NewPage) -> None:
    page = new_page()
    run = begin(page, panel, "Pole pairs by stable positions")
    energised, done = page.locator("[data-state=on]"), page.locator("[data-done]")
    for _ in range(200):
        if energised.is_visible():
            break
        # A click that comes before the next question is shown answers none.
        with suppress(Error):
            done.click(timeout=200)
        page.wait_for_timeout(100)
    expect(energised).to_contain_text("DC supply")
    page.get_by_role("button", name="Abort the run").click()
    expect(page.get_by_role("alert").filter(has_text="ABORTED")).to_contain_text("J. Doe")
    assert "made_safe" in kinds(panel, run)
    expect(page.get_by_role("button", name="Continue where it ended")).to_be_visible()


@pytest.mark.slow
def test_a_reloaded_and_a_second_browser_in_chinese_show_the_run_where_it_is(panel: Panel, new_page: NewPage) -> None:
    page = new_page()
    begin(page, panel, "Pole pairs by stable positions")
    task = page.get_by_text("Take the motor's shaft off the dynamometer")
    expect(task).to_be_visible()
    page.reload()
    expect(task).to_be_visible()
    expect(page.get_by_text("You have the control")).to_be_visible()
    second = new_page()
    second.goto(page.url)
    expect(second.get_by_text("Take the motor's shaft off the dynamometer")).to_be_visible()
    expect(second.get_by_text("J. Doe has the control")).to_be_visible()
    expect(second.get_by_role("button", name="Done")).to_have_count(0)
    second.get_by_role("button", name="Take the control").click()
    expect(page.get_by_role("button", name="Done")).to_have_count(0)
    second.get_by_role("button", name="中文").click()
    expect(second.get_by_role("button", name="完成")).to_be_visible()
    answer_until_end(second)
    expect(page.get_by_role("rowheader", name=re.compile("^Pole pairs"))).to_be_visible()
    expect(second.get_by_role("rowheader", name=re.compile("^极对数"))).to_be_visible()


@pytest.mark.slow
def test_who_has_no_name_is_called_so_in_each_readers_language(panel: Panel, new_page: NewPage) -> None:
    page, other = new_page(), new_page()
    run = begin(page, panel, "Pole pairs by stable positions")
    other.goto(f"{panel.url}/runs/{run}")
    other.get_by_role("button", name="中文", exact=True).click()
    other.get_by_role("button", name="取得控制权").click()
    expect(page.get_by_text("Another browser has the control")).to_be_visible()
    other.get_by_role("button", name=re.compile("中止")).click()
    expect(page.get_by_role("alert").filter(has_text="ABORTED: interrupted by a person at the panel")).to_be_visible()


def test_a_restarted_server_finds_the_run_again(panel: Panel, new_page: NewPage) -> None:
    page = new_page()
    run = begin(page, panel, "Pole pairs by stable positions")
    page.get_by_role("button", name="Done").click()
    panel.stop()
    panel.start()
    again = new_page()
    again.goto(panel.url)
    expect(again.get_by_text(f"A run is in progress: {run}")).to_be_visible()
    again.get_by_role("button", name="Show it").click()
    again.wait_for_url("**/runs/**")
    step = str(again.locator("[data-step]").get_attribute("data-step"))
    again.get_by_role("button", name="Done").click()
    expect(again.locator("[data-step]")).not_to_have_attribute("data-step", step)
    assert kinds(panel, run).count("run_started") == 1


def test_what_cannot_begin_says_why_on_the_page(serve: Serve, new_page: NewPage, tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    station.write_text('[station]\nname = "S"\n\n[instruments.supply]\ndriver = "nothing"\n')
    server, page = serve("--station", str(station)), new_page()
    page.goto(server.url)
    page.get_by_role("button", name="Check the instruments").click()
    expect(page.get_by_text("is no driver for this role")).to_be_visible()


def test_a_start_that_lacks_something_says_so_at_its_place(panel: Panel, new_page: NewPage) -> None:
    page = new_page()
    page.goto(panel.url)
    start, motor = page.get_by_role("button", name="Start", exact=True), page.get_by_role("combobox", name="Motor type")
    refused = page.get_by_role("alert").filter(has_text="Choose the motor's type.")
    expect(start).to_be_enabled()
    start.click()
    expect(refused).to_be_visible()
    expect(motor).to_be_focused()
    expect(page.locator(".q-field--error").get_by_role("combobox", name="Motor type")).to_be_visible()
    choose(page, "lg-400w")
    expect(refused).to_have_count(0)
    expect(page.locator(".q-field--error")).to_have_count(0)
    start.click()
    lacking = page.get_by_role("alert").filter(has_text="Choose at least one procedure.")
    expect(lacking).to_be_visible()
    expect(page.get_by_role("checkbox", disabled=False).first).to_be_focused()
    page.keyboard.press("Space")
    expect(lacking).to_have_count(0)
