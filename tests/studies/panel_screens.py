"""Pictures of every kind of step on four screens: `python -m tests.studies.panel_screens DIRECTORY` (needs Chromium)."""

import re
import sys
import tempfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

from playwright.sync_api import Browser, Error, Page, sync_playwright

from tests.bench.panel.conftest import CHROMIUM, FLAGS, Server

SCREENS: Mapping[str, tuple[int, int]] = {
    "1280": (1280, 800),
    "1920": (1920, 1080),
    "tablet": (800, 1280),
    "phone": (390, 844),
}
#: Procedures by the beginnings of their titles, and what stands on the page when a kind of step is reached.
STEPS: Mapping[str, tuple[str, str]] = {
    "hand": ("dq inductance, time constant", "Connect, in this order"),
    "energised": ("Pole pairs by stable positions", "Energised on purpose"),
    "typed": ("Stator resistance ·", "Read and enter"),
    "turning": ("dq inductance, smallest and largest", "Turn the shaft by hand"),
    "measuring": ("dq inductance, smallest and largest", "Go on turning"),
}


def begin(page: Page, server: Server, title: str) -> None:
    """Order a run of one procedure."""
    page.goto(server.url)
    page.get_by_label("Motor type").click()
    page.get_by_text("ipmsm (virtual)").click()
    page.get_by_label("Operator's name").fill("J. Doe")
    page.get_by_label("Serial number").fill("SN-001")
    page.get_by_role("button", name="None").click()
    page.get_by_role("checkbox", name=re.compile(f"^{re.escape(title)}")).first.click()
    page.get_by_role("button", name="Start", exact=True).click()
    page.wait_for_url("**/runs/**")


def reach(page: Page, words: str) -> None:
    """Confirm what is asked until the page says these words."""
    for _ in range(400):
        if page.get_by_text(words).first.is_visible():
            return
        # Where nothing is asked just now, there is nothing to press.
        with suppress(Error):
            page.locator("[data-done]").click(timeout=300)
        page.wait_for_timeout(50)
    raise SystemExit(f"never reached: {words}")


def shoot(page: Page, name: str, folder: Path) -> None:
    """Take the page's pictures, and say where it is wider than its screen."""
    for screen, (width, height) in SCREENS.items():
        page.set_viewport_size({"width": width, "height": height})
        page.wait_for_timeout(500)
        wide = page.evaluate("document.documentElement.scrollWidth") - width
        if wide > 0:
            print(f"{name}_{screen}: {wide} px too wide")
        page.screenshot(path=folder / f"{name}_{screen}.png")
    page.set_viewport_size({"width": 1280, "height": 800})


def take(folder: Path, only: list[str]) -> None:
    """Click through runs of the shipped ipmsm and take the pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as runs, sync_playwright() as playwright:
        server = Server(Path(runs) / "runs", "--virtual")
        server.start()
        try:
            _take(playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS), server, folder, only)
        finally:
            server.stop()


def _take(browser: Browser, server: Server, folder: Path, only: list[str]) -> None:
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.set_default_timeout(30_000)
    page.on("pageerror", lambda error: print("page:", error))
    page.on("console", lambda message: print("console:", message.text) if message.type == "error" else None)
    for name, (title, words) in STEPS.items():
        if only and name not in only:
            continue
        begin(page, server, title)
        reach(page, words)
        page.wait_for_timeout(700)
        shoot(page, name, folder)
        if name == "hand":
            _after(page, "chinese", lambda: page.get_by_role("button", name="中文").click(), folder)
            page.get_by_role("button", name="English").click()
            page.wait_for_timeout(500)
        page.locator(".mb-stop:not([disabled])").click()
        page.get_by_text("ABORTED").first.wait_for()
        if name == "hand":
            shoot(page, "aborted", folder)
    for path, name in (("/", "start"), ("/history", "runs"), ("/statistics", "statistics"), ("/line", "line")):
        if not only or name in only:
            page.goto(server.url + path)
            _after(page, name, lambda: None, folder)
    if not only or "lost" in only:
        begin(page, server, STEPS["hand"][0])
        reach(page, STEPS["hand"][1])
        server.stop()
        page.wait_for_timeout(5000)
        shoot(page, "lost", folder)
        server.start()
        page.locator(".mb-stop:not([disabled])").click(timeout=20_000)
        page.get_by_text("ABORTED").first.wait_for()


def _after(page: Page, name: str, action: Callable[[], object], folder: Path) -> None:
    action()
    page.wait_for_timeout(800)
    shoot(page, name, folder)


if __name__ == "__main__":
    take(Path(sys.argv[1]), sys.argv[2:])
