"""What the line's page shows below its sockets: yield on an axis, pace, the course of what fails most."""

from collections.abc import Callable
from contextlib import closing

import pytest
from playwright.sync_api import Page, expect

from bench.eol.line.batch_log import BatchMotor
from bench.eol.line.panel_channel import PanelChannel
from tests.bench.panel.browser.conftest import Panel
from tests.bench.panel.browser.test_run_page import SCREENS, assert_accessible
from tests.bench.panel.browser.test_statistics_page import keep, motors
from tests.studies.pages.played_run import played_line

pytestmark = pytest.mark.slow

#: Shares of the axis' width at which its marks stand.
MARKS = """() => { const axis = document.querySelector('.mb-yield-axis'), all = axis.getBoundingClientRect();
    return [...axis.querySelectorAll('[data-mark=range], [data-mark=point]')].map((at) => { const box = at.getBoundingClientRect();
        return [(box.left - all.left) / all.width, (box.right - all.left) / all.width]; }); }"""


def test_a_line_shows_yield_pace_and_the_course_of_what_fails_most(panel: Panel, new_page: Callable[[], Page]) -> None:
    keep(panel.records, ("B-0817", "LG-400W", [*motors(40, 1), ("LAST/1", {"stator_resistance": 13.0})]))
    page = new_page()
    with played_line(panel.runs / "line"):
        page.goto(f"{panel.url}/line")
        yielded = page.locator("[data-count='First-pass yield']")
        expect(yielded).to_contain_text("50.0 %")
        expect(page.locator("[data-count='A motor every']")).to_contain_text(" s")
        # One of two passed: the interval (95 %, Clopper and Pearson) is 1.3 … 98.7 %, on an axis from 0.
        (low, high), (left, right) = page.evaluate(MARKS)
        assert low == pytest.approx(0.013, abs=0.005)
        assert high == pytest.approx(0.987, abs=0.005)
        assert 0.5 * (left + right) == pytest.approx(0.5, abs=0.01)
        course = page.locator("[data-part=course]")
        expect(course).to_contain_text("Stator resistance, latest motors: 41")
        expect(course.locator("canvas").first).to_be_visible()
        expect(course).not_to_contain_text("No rule is broken.")
        assert_accessible(page)
        for width, height in SCREENS:
            page.set_viewport_size({"width": width, "height": height})
            page.wait_for_function("document.documentElement.scrollWidth <= innerWidth")
        page.set_viewport_size({"width": 1400, "height": 900})
    expect(page.get_by_text("The batch was cut off.")).to_be_visible()
    expect(page.get_by_label("Socket 5")).to_contain_text("not judged: the batch was cut off")
    expect(page.locator(".mb-tile[data-state=measuring]")).to_have_count(0)


def test_of_two_batches_one_is_chosen_and_abort_is_of_that_one(panel: Panel, new_page: Callable[[], Page]) -> None:
    page, stopped = new_page(), list[str]()
    folder = panel.runs / "west"
    folder.mkdir(parents=True)
    with played_line(panel.runs / "east"), closing(PanelChannel("west", "pump", ["7", "8"], None)) as west:
        west.open(folder, stopped.append, lambda _serial, _person: None)
        west.begun(BatchMotor(1, "W-1"), "7")
        page.goto(f"{panel.url}/line")
        batches = page.get_by_role("navigation", name="Batches")
        expect(batches.get_by_role("link", name="west")).to_contain_text("measures: socket 7")
        expect(page.get_by_label("Socket 5")).to_be_visible()
        batches.get_by_role("link", name="west").click()
        expect(page.get_by_label("Socket 7")).to_contain_text("W-1")
        expect(batches.locator("[aria-current=page]")).to_contain_text("west")
        assert_accessible(page)
        abort = page.get_by_role("button", name="Abort the batch")
        expect(abort).to_contain_text("this batch only")
        abort.click()
        expect(page.get_by_text("The batch ends: stopped by").first).to_be_visible()
    assert len(stopped) == 1
