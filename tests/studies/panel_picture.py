"""Pictures of the panel: `python -m tests.studies.panel_picture run|end|line FILE.png` (needs Chromium).

`run` is a step of the shipped lg-400w in which its terminals are connected, `end` a whole run's end, `line` four sockets.
"""

import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

from playwright.sync_api import Locator, Page, expect, sync_playwright

from tests.bench.panel.conftest import CHROMIUM, FLAGS, Server

_ROOT = Path(__file__).parents[2]
#: Steps that a run has at most before the one that is looked for.
_MOST = 200
_MOTORS = 10


def _until(seen: Locator, page: Page) -> None:
    """Confirm what is asked until something is to be seen. Raises RuntimeError where it does not come."""
    done = page.locator("[data-done]")
    for _ in range(_MOST):
        if seen.is_visible():
            return
        if done.is_visible() and done.is_enabled() and not seen.is_visible():
            # At once: a click waits until the page is at rest, and may confirm what is looked for.
            done.dispatch_event("click")
        page.wait_for_timeout(300)
    raise RuntimeError(f"{seen} did not come")


def _run(page: Page, server: Server) -> None:
    page.goto(server.url)
    page.get_by_label("Motor type").click()
    page.get_by_text("lg-400w (virtual)").click()
    page.get_by_label("Operator's name").fill("J. Doe")
    page.get_by_role("button", name="None").click()
    page.get_by_role("checkbox", name=re.compile("^dq inductance, time constant")).first.click()
    page.get_by_role("button", name="Start", exact=True).click()
    _until(page.get_by_text(re.compile("Channel 1: tip on")), page)
    page.wait_for_timeout(1000)


def _end(page: Page, server: Server) -> None:
    motor = server.runs.parent / "motor.toml"
    shutil.copy(_ROOT / "docs" / "examples" / "eol" / "motor.toml", motor)
    with motor.open("a", encoding="utf-8") as file:
        file.write("\n[tolerance]\nstator_resistance = 0.03\nd_axis_inductance = 0.05\nflux_linkage = 0.05\n")
    arguments = ("run", "all", "--station", "virtual", "--operator", "virtual", "--motor", str(motor), "--seed", "1")
    arguments = (*arguments, "--runs", str(server.runs), "--serial-number", "SN-001", "--person", "J. Doe")
    subprocess.run([sys.executable, "-m", "motorbench", *arguments], capture_output=True, check=True)
    page.goto(f"{server.url}/runs/{next(server.runs.glob('*/journal.jsonl')).parent.name}")
    expect(page.get_by_role("figure").first).to_be_visible()
    page.wait_for_timeout(1500)


def _line(page: Page, server: Server) -> None:
    page.goto(f"{server.url}/line")
    page.get_by_role("radio", name="lg-400w-end-of-line").click()
    page.get_by_label("Operator's name").fill("J. Doe")
    page.get_by_role("button", name="Begin", exact=True).click()
    expect(page.get_by_text("Scan the first motor.")).to_be_visible()
    for number in range(_MOTORS):
        page.keyboard.type(f"LG{number + 1:06d}")
        page.keyboard.press("Enter")
        page.wait_for_timeout(500)
    expect(page.locator('[data-count="Waiting"] .mb-count')).to_have_text("0")
    expect(page.locator(".mb-tile[data-state=measuring]")).to_have_count(0)


PICTURES: Mapping[str, Callable[[Page, Server], None]] = {"run": _run, "end": _end, "line": _line}


def take(what: str, target: Path) -> None:
    """Bring the panel of a virtual bench there and take the picture."""
    expect.set_options(timeout=60_000)
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        plans = _ROOT / "docs" / "examples" / "eol"
        kept = ("--plans", str(plans), "--records", str(Path(folder) / "records.sqlite"))
        server = Server(Path(folder) / "runs", "--virtual", *kept)
        server.start()
        try:
            browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
            page = browser.new_page(viewport={"width": 1280, "height": 800})
            PICTURES[what](page, server)
            page.screenshot(path=target)
            for name in ("Abort the run", "Abort the batch"):
                abort = page.get_by_role("button", name=re.compile(name))
                if abort.is_visible():
                    abort.click()
                    page.wait_for_timeout(2000)
            browser.close()
        finally:
            server.stop()


if __name__ == "__main__":
    if len(sys.argv) != 3 or sys.argv[1] not in PICTURES:
        raise SystemExit(__doc__)
    take(sys.argv[1], Path(sys.argv[2]))
