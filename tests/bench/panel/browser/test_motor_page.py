"""A motor of the line: from a point of a chart to its tests, what changed since the one before, and its run."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from bench.cli.main import main
from bench.eol.store.database import open_database
from bench.eol.store.records import Records
from bench.eol.verdict import Verdict
from tests.bench.panel.browser.conftest import Panel
from tests.bench.panel.browser.test_run_page import assert_accessible
from tests.bench.panel.browser.test_statistics_page import keep, motors, part, record

pytestmark = pytest.mark.slow

NewPage = Callable[[], Page]


def measured(folder: Path) -> Path:
    """A motor's run as a batch keeps it: some folders below the runs."""
    command = ["run", "stator-resistance", "--station", "virtual", "--motor", "lg-400w", "--person", "Wang"]
    with pytest.raises(SystemExit, match="0"):
        main([*command, "--serial-number", "P-001", "--runs", str(folder)])
    return max(folder.iterdir())


def reworked(panel: Panel) -> None:
    """Keep a motor that failed, was wound anew and passed at another socket; its second test has a run."""
    keep(panel.records, ("A", "LG-400W", motors(30, 1)))
    run = measured(panel.runs / "A" / "000")
    engine = open_database(str(panel.records))
    first = record(101, "A", "REWORK/1", "LG-400W", {"stator_resistance": 12.0, "cogging_torque": 0.0300})
    again = record(102, "A", "REWORK/1", "LG-400W", {"stator_resistance": 10.1, "cogging_torque": 0.0301})
    Records(engine).save(replace(first, socket="1", cause="stator_resistance too high"))
    Records(engine).save(replace(again, socket="2", run=str(run)))
    engine.dispose()


def test_a_reworked_motor_says_what_changed_and_leads_to_its_run(panel: Panel, new_page: NewPage) -> None:
    reworked(panel)
    page = new_page()
    page.goto(f"{panel.url}/statistics?batch=A&parameter=stator_resistance")
    # The point beyond the limits is in the table of broken rules, as a link.
    link = part(page, "chart").get_by_role("link", name="REWORK/1").first
    link.focus()
    page.keyboard.press("Enter")
    expect(page.get_by_role("heading", level=1)).to_have_text("Motor REWORK/1")
    second, first = page.locator("[data-test='2']"), page.locator("[data-test='1']")
    expect(second.locator("[data-changed]")).to_contain_text("by more than both uncertainties: Stator resistance")
    expect(second.locator("[data-changed]")).not_to_contain_text("Cogging")
    expect(second.get_by_role("row").nth(1)).to_contain_text("⚠ −1.9")
    expect(second.get_by_role("row").nth(1)).to_contain_text("fail → pass")
    expect(second).to_contain_text("Socket: 1 → 2")
    expect(first).to_contain_text("stator_resistance too high")
    assert_accessible(page)
    page.set_viewport_size({"width": 390, "height": 844})
    # On a phone no column is out of sight.
    for words in ("9.4000 … 10.6000 Ω", "⚠ −1.9000 Ω", "fail → pass"):
        expect(second.get_by_role("cell", name=words)).to_be_in_viewport(ratio=1)
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    page.set_viewport_size({"width": 1400, "height": 900})
    second.get_by_role("link", name="Its run").click()
    expect(page.get_by_text("Run completed. It switched nothing on.")).to_be_visible()
    expect(page.get_by_role("rowheader", name="Stator resistance")).to_be_visible()
    # It is measured again at its line only.
    expect(page.get_by_role("button", name="Report", exact=True)).to_be_visible()
    expect(page.get_by_role("button", name="Measure the next motor")).to_have_count(0)


def test_a_figure_that_was_withheld_is_shown_without_a_value(panel: Panel, new_page: NewPage) -> None:
    engine = open_database(str(panel.records))
    kept = record(1, "A", "W-1", "LG-400W", {"stator_resistance": 10.0})
    nothing = replace(kept.measured[0], value=math.nan, expanded=math.nan, verdict=Verdict.NOT_JUDGED)
    Records(engine).save(replace(kept, verdict=Verdict.ERROR, measured=(nothing,)))
    engine.dispose()
    page = new_page()
    page.goto(f"{panel.url}/motors?serial_number=W-1")
    row = page.locator("[data-test='1']").get_by_role("row").nth(1)
    for words in ("– Ω", "not judged", "9.4 … 10.6 Ω"):
        expect(row).to_contain_text(words)


def test_a_pressed_point_opens_its_motor_and_the_next_is_scanned(panel: Panel, new_page: NewPage) -> None:
    reworked(panel)
    page = new_page()
    page.goto(f"{panel.url}/statistics?batch=A&parameter=stator_resistance")
    chart = part(page, "chart").locator("canvas").first
    expect(chart).to_be_visible()
    at = page.evaluate(
        """() => { const part = document.querySelector('[data-part=chart] [role=img]');
        const chart = getElement(part.id.slice(1)).chart, series = chart.getOption().series[0];
        const place = series.data.indexOf(12);
        return chart.convertToPixel({seriesIndex: 0}, [place, 12]); }"""
    )
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + at[0], box["y"] + at[1])
    expect(page.get_by_role("heading", level=1)).to_have_text("Motor REWORK/1")
    expect(page.get_by_role("heading", level=2)).to_have_count(2)
    page.get_by_label("Scan a serial number").fill("P-001")
    page.keyboard.press("Enter")
    expect(page.get_by_role("heading", level=1)).to_have_text("Motor P-001")
    expect(page.get_by_text("Test 1: pass")).to_be_visible()
    page.get_by_label("Scan a serial number").fill("nobody")
    page.keyboard.press("Enter")
    expect(page.get_by_role("alert")).to_contain_text("There is no record of the serial number nobody.")


def test_a_bar_leads_to_its_motors_by_pointer_and_by_keyboard(panel: Panel, new_page: NewPage) -> None:
    keep(panel.records, ("A", "LG-400W", [*motors(60, 1), ("FAR/1", {"stator_resistance": 12.5})]))
    page = new_page()
    page.goto(f"{panel.url}/statistics?batch=A&parameter=stator_resistance")
    histogram = part(page, "distribution").locator("canvas").first
    expect(histogram).to_be_visible()
    histogram.scroll_into_view_if_needed()
    # The last bar is the only motor far off.
    at = page.evaluate(
        """() => { const part = document.querySelector('[data-part=distribution] [role=img]');
        const chart = getElement(part.id.slice(1)).chart, data = chart.getOption().series[0].data;
        const [x, count] = data[data.length - 1].value;
        return chart.convertToPixel({seriesIndex: 0}, [x, count / 2]); }"""
    )
    box = histogram.bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + at[0], box["y"] + at[1])
    expect(part(page, "distribution").get_by_role("link")).to_have_text(["FAR/1"])
    failures = part(page, "failures").get_by_role("combobox", name="Motors of a bar")
    failures.focus()
    page.keyboard.press("Enter")
    page.get_by_role("option", name="Stator resistance: 1").click()
    link = part(page, "failures").get_by_role("link", name="FAR/1")
    expect(link).to_be_visible()
    assert_accessible(page)
    link.click()
    expect(page.get_by_role("heading", level=1)).to_have_text("Motor FAR/1")


def test_the_grouping_of_yields_keeps_the_focus(panel: Panel, new_page: NewPage) -> None:
    keep(panel.records, ("A", "LG-400W", motors(30, 1)))
    page = new_page()
    page.goto(f"{panel.url}/statistics")
    grouping = part(page, "yield-by").get_by_role("combobox")
    grouping.focus()
    page.keyboard.press("Enter")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    expect(part(page, "yield-by").get_by_role("columnheader").first).not_to_have_text("Socket")
    expect(part(page, "yield-by").get_by_role("combobox")).to_be_focused()


def test_only_runs_below_the_runs_are_shown(panel: Panel, new_page: NewPage) -> None:
    page = new_page()
    for name in ("A//x", "A/../x", "A/.hidden/x", "..%2Fx", "/etc"):
        page.goto(f"{panel.url}/runs/{name}")
        expect(
            page.get_by_text("no run was found")
            .or_(page.get_by_text("a run's name is"))
            .or_(page.get_by_text("404"))
            .first
        ).to_be_visible()
