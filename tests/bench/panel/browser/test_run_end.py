"""What a run's page claims: how it ended, what it left, and how old a reading is."""

from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from bench.cli.main import main
from tests.bench.panel.browser.conftest import Panel
from tests.bench.panel.browser.test_browser import begin
from tests.bench.panel.browser.test_run_page import assert_accessible, assert_fits, next_step
from tests.bench.panel.shown_run import ShownRun

STEP = ("stator-resistance", "3.2.2/3", "Measure the three line resistances")
#: The smallest words of the drawing that is to be seen (px), and whether state and Done are in front of it.
DRAWN = """() => {
    const svg = [...document.querySelectorAll('.mb-draw svg[role=img]')].find((at) => at.getBoundingClientRect().width);
    const sizes = [...svg.querySelectorAll('text')].map((at) => parseFloat(getComputedStyle(at).fontSize) * at.getScreenCTM().a);
    const seen = [...document.querySelectorAll('.mb-state, .mb-stop, .mb-done')].filter((at) => at.offsetParent).every((at) => {
        const box = at.getBoundingClientRect();
        return at.contains(document.elementFromPoint(box.left + box.width / 2, box.top + box.height / 2)); });
    return [Math.min(...sizes), seen];
}"""


@pytest.mark.slow
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


@pytest.mark.slow
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
        page.set_viewport_size({"width": 1400, "height": 900})


@pytest.mark.slow
def test_a_drawing_beside_many_lines_is_enlarged_and_hides_no_state(panel: Panel, new_page: Callable[[], Page]) -> None:
    page = new_page()
    page.set_viewport_size({"width": 1280, "height": 800})
    begin(page, panel, "dq inductance, time constant")
    expect(page.locator("[data-done]:not([aria-disabled])")).to_be_visible()
    while not page.get_by_text("arrow towards the motor").first.is_visible():
        next_step(page)
    larger = page.get_by_role("button", name="Enlarge the drawing")
    larger.click()
    expect(larger).to_have_attribute("aria-pressed", "true")
    smallest, seen = page.evaluate(DRAWN)
    assert smallest >= 0.72 * 16.0
    assert seen
    assert_accessible(page)
    page.keyboard.press("Escape")
    expect(larger).to_have_attribute("aria-pressed", "false")
    assert page.evaluate(DRAWN)[0] < smallest
    larger.click()
    page.get_by_role("button", name="Done", exact=True).click()
    # The next thing to do is not hidden.
    expect(page.locator("html.mb-large")).to_have_count(0)
    page.keyboard.press("Control+Escape")
    expect(page.get_by_role("alert").filter(has_text="ABORTED")).to_be_visible()
    page.set_viewport_size({"width": 1400, "height": 900})


def test_a_phone_shows_how_each_run_ended_without_scrolling_sideways(
    panel: Panel, new_page: Callable[[], Page]
) -> None:
    page = new_page()
    with ShownRun(panel.runs / "listed", *STEP) as run:
        run.record("run_finished", status="failed", cause="the bridge overflowed", bench_time=1.0, wall_time=1.0)
    page.set_viewport_size({"width": 390, "height": 844})
    page.goto(f"{panel.url}/history")
    row = page.locator("tr").filter(has=page.get_by_role("link", name="listed"))
    expect(row.get_by_role("cell").last).to_be_in_viewport(ratio=1)
    expect(row.get_by_role("cell").last).not_to_be_empty()
    assert page.locator(".mb-runs").evaluate("at => at.parentElement.scrollWidth <= at.parentElement.clientWidth")
    page.set_viewport_size({"width": 1400, "height": 900})


@pytest.mark.slow
def test_a_residual_is_judged_by_what_it_is_and_every_plot_is_named(panel: Panel, new_page: Callable[[], Page]) -> None:
    before = set(panel.runs.glob("*"))
    command = ["run", "dq-inductance-extremes", "pole-pairs-static", "--station", "virtual", "--motor", "ipmsm"]
    with pytest.raises(SystemExit, match="0"):
        main([*command, "--runs", str(panel.runs)])
    (ended,) = set(panel.runs.glob("*")) - before
    page = new_page()
    page.goto(f"{panel.url}/runs/{ended.name}")
    fits = page.get_by_role("region", name="How well the models fit")
    expect(fits.get_by_role("figure", name="dq inductance, smallest and largest")).to_contain_text("✓ no pattern found")
    plots = page.get_by_role("region", name="Plots")
    expect(plots.get_by_role("figure", name="Pole pairs by stable positions")).to_be_visible()
    assert_accessible(page)


@pytest.mark.slow
def test_a_residual_with_a_pattern_is_marked_and_its_cause_named(
    panel: Panel, new_page: Callable[[], Page], tmp_path: Path
) -> None:
    before, hum = set(panel.runs.glob("*")), tmp_path / "hum.toml"
    hum.write_text("[channels.4]\nhum = 0.05\nhum_frequency = 50\n")
    command = ["run", "dq-inductance-time-constant", "--station", "virtual", "--motor", "ipmsm", "--seed", "3"]
    with pytest.raises(SystemExit, match="0"):
        main([*command, "--disturbances", str(hum), "--runs", str(panel.runs)])
    (ended,) = set(panel.runs.glob("*")) - before
    page = new_page()
    page.goto(f"{panel.url}/runs/{ended.name}")
    fits = page.get_by_role("region", name="How well the models fit")
    expect(fits.get_by_role("figure").first).to_contain_text("⚠ a pattern: hum (modelled)")
    assert_accessible(page)
