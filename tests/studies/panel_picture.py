"""A picture of the panel in mid-run: `python -m tests.studies.panel_picture FILE.png` (needs Chromium)."""

import re
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import expect, sync_playwright

from tests.bench.panel.conftest import CHROMIUM, FLAGS, Server


def take(target: Path) -> None:
    """Click through a run of the shipped ipmsm until a step's connections and reading are to be seen; take the picture."""
    expect.set_options(timeout=30_000)
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        server = Server(Path(folder) / "runs", "--virtual")
        server.start()
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        page = browser.new_page(viewport={"width": 1280, "height": 940})
        page.goto(server.url)
        page.get_by_label("Motor type").click()
        page.get_by_text("ipmsm (virtual)").click()
        page.get_by_label("Operator's name").fill("J. Doe")
        page.get_by_role("button", name="None").click()
        for title in ("Pole pairs by stable positions", "dq inductance, time constant"):
            page.get_by_role("checkbox", name=re.compile(f"^{title}")).click()
        page.get_by_role("button", name="Start", exact=True).click()
        probes = page.get_by_text("Fit the oscilloscope's probes")
        while not probes.is_visible():
            page.locator("[data-done]").click()
            page.wait_for_timeout(300)
        page.wait_for_timeout(800)
        page.screenshot(path=target)
        page.get_by_role("button", name="Abort the run").click()
        expect(page.get_by_role("alert").filter(has_text="ABORTED")).to_be_visible()
        browser.close()
        server.stop()


if __name__ == "__main__":
    take(Path(sys.argv[1]))
