"""Pictures of every kind of page on five screens in both languages, and what is wrong with them.

`python -m tests.studies.panel_screens DIRECTORY [NAME …]` (needs Chromium). The smallest screen is 1280 × 800 at 200 %.
"""

import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from playwright.sync_api import Browser, Error, Page, sync_playwright

from tests.bench.panel.conftest import CHROMIUM, FLAGS
from tests.studies.pages.panel_checks import english_left, faults, findings, moving
from tests.studies.pages.panel_pages import PAGES, Bench

SCREENS: Mapping[str, tuple[int, int]] = {
    "1280": (1280, 800),
    "1920": (1920, 1080),
    "tablet": (800, 1280),
    "phone": (390, 844),
    "zoomed": (640, 400),
}
#: How a page looks to those who do not tell colours apart, and where the browser's user chooses them.
_EYES = ("deuteranopia", "achromatopsia")


class Camera:
    """Takes a page's pictures and prints what is wrong with it."""

    def __init__(self, page: Page, folder: Path) -> None:
        self._page = page
        self._folder = folder

    def take(self, name: str, *, languages: Iterable[str] = ("en", "zh")) -> None:
        """Take a page in its languages on all screens."""
        for language in languages:
            self._speak(language)
            for screen, (width, height) in SCREENS.items():
                self._page.set_viewport_size({"width": width, "height": height})
                self._page.wait_for_timeout(250)
                self._tell(f"{name}_{language}_{screen}", faults)
                self._page.screenshot(path=self._folder / f"{name}_{language}_{screen}.png")
            self._page.set_viewport_size({"width": 1280, "height": 800})
            if language == "zh":
                self._tell(f"{name}_zh", english_left)
        self._speak("en")
        self._tell(name, findings)
        self._tell(name, moving)
        self._see(name)

    def _see(self, name: str) -> None:
        """Take it in the colours that the user has forced, and as those see it who do not tell colours apart."""
        self._page.emulate_media(forced_colors="active")
        self._page.screenshot(path=self._folder / f"{name}_forced.png")
        self._page.emulate_media(forced_colors="none")
        eyes = self._page.context.new_cdp_session(self._page)
        for kind in _EYES:
            eyes.send("Emulation.setEmulatedVisionDeficiency", {"type": kind})
            self._page.screenshot(path=self._folder / f"{name}_{kind}.png")
        eyes.send("Emulation.setEmulatedVisionDeficiency", {"type": "none"})
        eyes.detach()

    def _speak(self, language: str) -> None:
        other = self._page.get_by_role("button", name="中文" if language == "zh" else "English", exact=True)
        if other.is_visible():
            other.click()
            self._page.locator(f"html[lang={language}]").wait_for(state="attached")
            self._page.wait_for_timeout(900)

    def _tell(self, name: str, look: Callable[[Page], Iterable[str]]) -> None:
        for again in reversed(range(3)):
            try:
                told = list(look(self._page))
                break
            except Error:
                # On a busy machine a page takes itself for lost, and loads itself anew.
                if not again:
                    raise
                self._page.wait_for_timeout(2000)
        for words in told:
            print(f"{name}: {words}", flush=True)


def take(folder: Path, only: list[str]) -> None:
    """Come to every page of PAGES, or to those named, and take its pictures."""
    unknown = sorted(set(only) - set(PAGES))
    if unknown:
        raise SystemExit(f"no such page: {', '.join(unknown)}; there are: {', '.join(PAGES)}")
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as kept, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        bench = Bench(Path(kept))
        try:
            missed = [name for name in only or PAGES if not _taken(browser, bench, folder, name)]
        finally:
            bench.close()
    if missed:
        raise SystemExit(f"not taken: {', '.join(missed)}; again: give these names")


def _taken(browser: Browser, bench: Bench, folder: Path, name: str) -> bool:
    """Take one page; on a busy machine it may come too late, and the others are taken all the same."""
    try:
        _take(browser, bench, folder, name)
    except Error as error:
        print(f"{name}: {error}", flush=True)
        return False
    return True


def _take(browser: Browser, bench: Bench, folder: Path, name: str) -> None:
    context = browser.new_context(viewport={"width": 1280, "height": 800})
    page = context.new_page()
    page.set_default_timeout(90_000)
    page.on("pageerror", lambda error: print(f"{name}: page: {error}"))
    with PAGES[name](page, bench):
        page.wait_for_timeout(600)
        # Nothing answers a page that is lost, in any language.
        Camera(page, folder).take(name, languages=("en",) if name in ("lost", "login") else ("en", "zh"))
    context.close()


if __name__ == "__main__":
    take(Path(sys.argv[1]), sys.argv[2:])
