"""A run's plot on the page: at its place before it comes, moving nothing, on every screen."""

from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from bench.journal.stored_result import store_text
from drivers.interfaces.text import text
from procedures.techniques.shaft.plots import coast_plot, ramp_plot
from tests.bench.panel.browser.conftest import Panel
from tests.bench.panel.browser.test_run_page import assert_accessible, assert_fits
from tests.bench.panel.shown_run import ShownRun

pytestmark = pytest.mark.slow

COAST = text("Coast-down")
#: What stands in the chart that is to be seen, in the browser.
DRAWN = """() => { const chart = [...document.querySelectorAll('.mb-plot-chart')].find(each => each.offsetParent);
  const at = chart ? getElement(chart.id.slice(1))?.chart : null;
  return at ? at.getOption().series.map(each => each.data.length) : []; }"""


def test_a_plot_comes_and_goes_and_moves_nothing(panel: Panel, new_page: Callable[[], Page]) -> None:
    page = new_page()
    with ShownRun(panel.runs / "shown", "inertia", "3.5/3", "Let it coast: record speed over time") as run:
        page.goto(f"{panel.url}/runs/shown")
        expect(page.get_by_role("heading", level=1)).to_have_text("Measuring: keep your hands off the motor")
        before = assert_fits(page)
        run.show(ramp_plot(COAST, 0.0, 60.0))
        place = page.locator(".mb-plot")
        expect(place.get_by_text("Coast-down")).to_be_visible()
        size = place.bounding_box()
        times = 0.05 * np.arange(30)
        speeds = 300.0 * np.exp(-0.4 * times)
        for time, speed in zip(times.tolist(), speeds.tolist(), strict=True):
            run.time = time
            run.read("dynamometer", "measure", speed=speed, torque=0.0, power=0.0)
        page.wait_for_function(f"({DRAWN})()[0] === 30")
        assert place.bounding_box() == size
        run.show(coast_plot(COAST, times, speeds))
        expect(place.get_by_text("Residual:")).to_be_visible()
        page.wait_for_function(f"({DRAWN})().length === 5")
        assert place.bounding_box() == size
        assert assert_fits(page) == before
        assert_accessible(page)
        # What is asked then has the drawing's place; the plot stands beside it.
        run.record("energising", instrument="dynamometer", call="driving_speed", arguments=[300.0])
        source = {"role": "tachometer", "found": "on", "feeds": False, "error": None}
        run.tell([{**source, "values": [[250.0, "rad/s"]]}])
        run.ask("confirm", instrument="dynamometer", task=store_text(text("Drive the shaft at {n} rpm", n=2865)))
        expect(page.locator(".mb-side-plot").get_by_text("Coast-down")).to_be_visible()
        expect(place).to_be_hidden()
        gauge = page.locator(".mb-words .mb-gauge")
        expect(gauge).to_contain_text("too low")
        run.tell([{**source, "values": [[301.0, "rad/s"]]}])
        expect(gauge).to_contain_text("✓ inside")
        expect(gauge).to_have_attribute("data-place", "inside")
        # What has been read back for longer than that says nothing any more.
        expect(gauge).to_contain_text("no reading")
        assert assert_fits(page)[1::2] == before[1::2]
