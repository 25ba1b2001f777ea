"""What a run's page claims: how it ended, what it left, and how old a reading is."""

from collections.abc import Callable

from playwright.sync_api import Page, expect

from tests.bench.panel.browser.conftest import Panel
from tests.bench.panel.browser.test_run_page import assert_accessible, assert_fits
from tests.bench.panel.shown_run import ShownRun

STEP = ("stator-resistance", "3.2.2/3", "Measure the three line resistances")


def test_a_failed_runs_reason_stands_outside_of_what_is_green(panel: Panel, new_page: Callable[[], Page]) -> None:
    page = new_page()
    with ShownRun(panel.runs / "failed", *STEP) as run:
        run.record("made_safe", instrument="supply", item="supply_off", outcome="safe")
        run.record("made_safe", instrument="supply", item="voltage_decayed", outcome="safe", value=0.01, unit="V")
        run.record("run_finished", status="failed", cause="the bridge overflowed", bench_time=1.0, wall_time=1.0)
    page.goto(f"{panel.url}/runs/failed")
    reason = page.get_by_role("alert").filter(has_text="the bridge overflowed")
    expect(reason).to_contain_text("Run failed.")
    left = page.locator("[data-left=off]")
    expect(left).to_contain_text("Outputs were off at its end.")
    expect(left).not_to_contain_text("the bridge overflowed")
    assert left.evaluate("at => getComputedStyle(at).color") != reason.evaluate("at => getComputedStyle(at).color")
    assert_accessible(page)


def test_a_reading_is_live_only_while_it_is(panel: Panel, new_page: Callable[[], Page]) -> None:
    page = new_page()
    with ShownRun(panel.runs / "read", *STEP) as run:
        run.read("lcr_meter", "measure", resistance=0.0318)
        # A page that comes later, or is loaded anew, does not make the reading young.
        page.goto(f"{panel.url}/runs/read")
        expect(page.locator("[data-age]")).to_contain_text("s old")
        page.reload()
        page.wait_for_selector("[data-reading]")
        expect(page.locator("[data-age]")).not_to_be_empty()
        assert "live" not in page.locator("[data-age]").inner_text()
        driver = {
            "driver": "manual",
            "address": "",
            "identity": {"maker": "", "model": "", "serial_number": "", "firmware": ""},
        }
        run.record("instrument_opened", instrument="lcr_meter", **driver)
        expect(page.locator("[data-age]")).to_contain_text("typed")
        assert_fits(page)
