import gc
import json
import os
import select
import shutil
import signal
import warnings
from collections.abc import Callable, Generator, Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from playwright.sync_api import Browser, ConsoleMessage, Error, Page, expect, sync_playwright

from bench.eol.store.spool import FOLDER as UNSTORED
from bench.operators.operator_channel import FILE
from bench.panel.launch import LINE
from tests.bench.panel.conftest import CHROMIUM, FLAGS, Server

#: What moves on a page is drawn by the processor here, and nobody watches.
STILL = """
document.addEventListener("DOMContentLoaded", () => {
    const style = document.createElement("style");
    style.textContent = "*, *::before, *::after { animation: none !important; transition: none !important; }";
    document.head.append(style);
});
"""
#: From within, for then the page keeps its process.
LEAVE = """
() => {
    if (location.protocol === "http:") {
        sessionStorage.clear();
        localStorage.clear();
    }
    location.replace("about:blank");
}
"""
#: A run ends, and whatever a page is to show comes, within this time (s), however busy the machine.
PATIENCE = 60.0


class Panel(Server):
    """A server of virtual benches that many tests ask; each finds nothing going on, no records, plans or motors."""

    def __init__(self, folder: Path) -> None:
        self.records, self.plans, self.motors = folder / "records.sqlite", folder / "plans", folder / "motors"
        kept = ("--records", str(self.records), "--plans", str(self.plans), "--motors", str(self.motors))
        super().__init__(folder / "runs", "--virtual", *kept)

    def tidy(self) -> None:
        """End what goes on and forget what was kept, records without a database too; runs that have ended stay."""
        for announced in [*self.runs.glob(f"*/{FILE}"), *self.runs.glob(f"*/{LINE}")]:
            self._end(announced)
        for path in self.records.parent.glob(f"{self.records.name}*"):
            path.unlink()
        for folder in (self.plans, self.motors, self.runs / UNSTORED):
            shutil.rmtree(folder, ignore_errors=True)

    def _end(self, announced: Path) -> None:
        """Have a run's process end, and see it ended; one that was at its end already may leave its announcement behind."""
        with suppress(FileNotFoundError, ProcessLookupError):
            process = os.pidfd_open(json.loads(announced.read_text(encoding="utf-8"))["pid"])
            try:
                signal.pidfd_send_signal(process, signal.SIGTERM)
                assert select.select([process], [], [], PATIENCE)[0], f"{announced} goes on"
            finally:
                os.close(process)
        announced.unlink(missing_ok=True)


@pytest.fixture(scope="package")
def shared_panel(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Panel]:
    panel = Panel(tmp_path_factory.mktemp("panel"))
    panel.start()
    yield panel
    printed = panel.stop()
    print(printed)
    assert "Traceback" not in printed


@pytest.fixture
def panel(shared_panel: Panel) -> Iterator[Panel]:
    yield shared_panel
    shared_panel.tidy()


@pytest.fixture
def serve(tmp_path: Path) -> Iterator[Callable[..., Server]]:
    """Start a server with options of its own."""
    started: list[Server] = []

    def make(*options: str) -> Server:
        server = Server(tmp_path / "runs", *options)
        server.start()
        started.append(server)
        return server

    yield make
    printed = "\n".join(server.stop() for server in started)
    # In full: what an assertion shows of it is cut.
    print(printed)
    assert "Traceback" not in printed


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Have all tests that lack the browser give one place, so that pytest says so in one line."""
    report = yield
    if CHROMIUM is None and report.skipped and isinstance(report.longrepr, tuple):
        report.longrepr = (__file__, 0, report.longrepr[2])
    return report


@pytest.fixture(scope="package")
def browser() -> Iterator[Browser]:
    """Keep a browser for these tests only: its driver's event loop runs in this thread as long as it is there."""
    if CHROMIUM is None:
        pytest.skip("no Chromium on this machine (Debian: apt-get install chromium-headless-shell)")
    expect.set_options(timeout=PATIENCE * 1000)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()
    # On a busy machine its event loop is closed before the pipe to its driver is, which only the collector closes then.
    with warnings.catch_warnings(action="ignore", category=ResourceWarning):
        del browser, playwright
        gc.collect()


@pytest.fixture(scope="package")
def pages() -> list[Page]:
    """Return the pages that were opened so far: one that is used again has its scripts compiled already."""
    return []


@pytest.fixture(scope="package")
def refused() -> list[str]:
    """Return what the pages' content policy refused so far, as the browser says it."""
    return []


@pytest.fixture
def new_page(browser: Browser, pages: list[Page], refused: list[str]) -> Iterator[Callable[[], Page]]:
    """Each page is a browser of its own: no cookie is shared, and none is there from the test before.

    No page of ours may run into its own content policy.
    """
    used = 0
    refused.clear()

    def note(message: ConsoleMessage) -> None:
        if "Content Security Policy" in message.text:
            refused.append(message.text)

    def make() -> Page:
        nonlocal used
        if used == len(pages):
            context = browser.new_context(viewport={"width": 1400, "height": 900})
            context.set_default_timeout(PATIENCE * 1000)
            context.add_init_script(STILL)
            page = context.new_page()
            page.on("console", note)
            pages.append(page)
        used += 1
        # Only the page in front has the keyboard.
        pages[used - 1].bring_to_front()
        return pages[used - 1]

    yield make
    for page in pages[:used]:
        _leave(page)
    assert not refused


def _leave(page: Page) -> None:
    # A page whose server has just come back loads itself anew, which may come between.
    for again in range(5):
        try:
            page.evaluate(LEAVE)
            break
        except Error as error:
            if again == 4 or "navigation" not in error.message:
                raise
            page.wait_for_load_state()
    page.wait_for_url("about:blank")
    page.context.clear_cookies()
