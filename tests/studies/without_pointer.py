"""A whole run by the keyboard alone, and the next motor's by a scanner alone: `python -m tests.studies.without_pointer` (needs Chromium).

All procedures of the shipped lg-400w that a station can have; nothing is clicked, and on the way each place that gets the focus is marked
and in sight. It prints how many steps were confirmed, and how each run ended.
"""

import argparse
import json
import tempfile
import time
from pathlib import Path

from playwright.sync_api import Page, expect, sync_playwright

from tests.bench.panel.browser.test_keyboard_and_scanner import confirm_to_the_end, scan, tab_to
from tests.bench.panel.conftest import CHROMIUM, FLAGS, Server

_MOST = 1000


def order(page: Page, url: str, motor: str) -> None:
    """Order all procedures of a shipped motor by the keyboard."""
    page.goto(url)
    expect(page.get_by_label("Serial number")).to_be_focused()
    page.keyboard.type("SN-1")
    tab_to(page, page.get_by_role("combobox", name="Motor type"))
    page.keyboard.press("Enter")
    wanted = f"{motor} (virtual)"
    expect(page.get_by_role("option", name=wanted, exact=True)).to_be_visible()
    while page.locator(".q-item.q-manual-focusable--focused").get_by_text(wanted, exact=True).count() == 0:
        page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    # The list of types stands over what comes next until it is closed.
    expect(page.get_by_role("option")).to_have_count(0)
    page.wait_for_timeout(500)
    tab_to(page, page.get_by_label("Operator's name"))
    page.keyboard.type("J. Doe")
    everything = page.get_by_role("button", name="All", exact=True)
    tab_to(page, everything)
    page.keyboard.press("Enter")
    start = page.get_by_role("button", name="Start", exact=True)
    expect(start).to_be_enabled()
    tab_to(page, start)
    page.keyboard.press("Enter")
    page.wait_for_url("**/runs/**")


def code(page: Page) -> None:
    """Scan what the step asks for: the number that stands in its field, else the code that confirms."""
    field = page.locator("input[data-focus]")
    scan(page, field.input_value() if field.is_visible() else "DONE")


def tell(way: str, runs: Path, page: Page, confirmed: int, began: float) -> None:
    """Print what a run came to."""
    events = map(json.loads, (runs / page.url.rpartition("/")[2] / "journal.jsonl").read_text().splitlines())
    kinds: dict[str, list[dict[str, object]]] = {}
    for event in events:
        kinds.setdefault(event["kind"], []).append(event["data"])
    (begun, *_), ended = kinds["run_started"], kinds["run_finished"][-1]
    print(
        f"{way}: {len(begun['procedures'])} procedures ordered, {len(kinds['procedure_finished'])} finished; "
        f"{confirmed} steps confirmed in {time.monotonic() - began:.0f} s; the run is {ended['status']} {ended.get('cause', '')}",
        flush=True,
    )


def main() -> None:
    """Carry out both runs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--motor", default="lg-400w", help="a motor shipped with the program")
    motor = parser.parse_args().motor
    with tempfile.TemporaryDirectory() as kept, sync_playwright() as playwright:
        folder = Path(kept)
        server = Server(folder / "runs", "--virtual", "--records", str(folder / "records.sqlite"))
        server.start()
        try:
            page = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS).new_page()
            expect.set_options(timeout=60_000)
            page.set_default_timeout(60_000)
            began = time.monotonic()
            order(page, server.url, motor)
            confirmed = confirm_to_the_end(page, lambda: page.keyboard.press("Enter"), most=_MOST)
            tell("keyboard", server.runs, page, confirmed, began)
            began = time.monotonic()
            scan(page, "DONE")
            page.wait_for_url("**/?as_before=*")
            expect(page.get_by_role("button", name="Start", exact=True)).to_be_enabled()
            scan(page, "SN-2")
            page.wait_for_url("**/runs/**")
            confirmed = confirm_to_the_end(page, lambda: code(page), most=_MOST)
            tell("scanner", server.runs, page, confirmed, began)
        finally:
            server.stop()


if __name__ == "__main__":
    main()
