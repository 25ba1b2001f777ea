"""A run to its signed report by the keyboard alone, and the next motor's by a barcode scanner alone."""

import json
import re
from collections.abc import Callable

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.bench.panel.browser.conftest import PATIENCE, Panel
from tests.bench.panel.browser.test_browser import begin

pytestmark = pytest.mark.slow

NewPage = Callable[[], Page]
#: Of what has the focus: whether it, or what stands around it, is marked, and whether a person sees it.
_SEEN = """() => {
    const at = document.activeElement, box = at.getBoundingClientRect();
    let marked = false;
    for (let around = at; around && around.tagName !== 'BODY' && !marked; around = around.parentElement) {
        const style = getComputedStyle(around);
        marked = (style.outlineStyle !== 'none' && parseFloat(style.outlineWidth) >= 2) || around.matches('.q-focusable:focus');
    }
    const top = document.elementFromPoint(box.left + box.width / 2, box.top + Math.min(box.height, 40) / 2);
    return [marked, at.contains(top) || top?.closest('.q-field, .mb-field')?.contains(at) || at.closest('label')?.contains(top)];
}"""


#: How often the bar at the foot has shown another step, or the page has lost or found its server.
_CHANGES = """() => {
    const bar = document.querySelector('[data-step]');
    if (bar && window.watchedBar !== bar) {
        window.changes ??= 0;
        const watch = new MutationObserver(() => { window.changes += 1; });
        watch.observe(bar, { attributeFilter: ['data-step'] });
        watch.observe(document.documentElement, { attributeFilter: ['class'] });
        window.watchedBar = bar;
    }
    return window.changes;
}"""


def tab_to(page: Page, place: Locator, *, key: str = "Tab") -> None:
    """Go from place to place until this one has the focus; all on the way must be marked and seen."""
    for _ in range(60):
        page.keyboard.press(key)
        if page.evaluate("document.activeElement !== document.body"):
            assert page.evaluate(_SEEN) == [True, True], page.evaluate("document.activeElement.outerHTML.slice(0, 200)")
        if place.evaluate("place => place.contains(document.activeElement)"):
            return
    raise AssertionError(f"never reached by {key}: {place}")


def scan(page: Page, code: str) -> None:
    page.keyboard.type(code)
    page.keyboard.press("Enter")


def confirm_to_the_end(page: Page, press: Callable[[], None], *, most: int = 60) -> int:
    """Confirm each step, `most` of them; the focus is where its answer belongs, and at the end on what comes next.

    Returns how often it was pressed.
    """
    onward = page.get_by_role("button", name="Measure the next motor")
    ready = page.locator("[data-done]:not([aria-disabled])")
    for confirmed in range(most):
        expect(onward.or_(ready).first).to_be_visible()
        if onward.is_visible():
            expect(onward).to_be_focused()
            expect(page.locator("[data-next]:not([aria-disabled])")).to_be_visible()
            return confirmed
        # Counted before the last look: a page that changes under the press may leave it untaken, and is looked at again.
        changes = page.evaluate(_CHANGES)
        expect(ready).to_be_visible()
        expect(page.locator("[data-focus]:not([disabled])").first).to_be_focused()
        press()
        page.wait_for_function(
            "before => window.changes !== before || document.querySelector('[data-next]')",
            arg=changes,
            timeout=PATIENCE * 1000,
        )
    raise AssertionError("the run did not end")


def serial_of(panel: Panel, page: Page) -> str:
    name = page.url.rpartition("/")[2]
    return str(
        json.loads((panel.runs / name / "journal.jsonl").read_text().splitlines()[0])["data"]["motor"]["serial_number"]
    )


def test_a_run_by_keyboard_and_the_next_by_scanner(panel: Panel, new_page: NewPage) -> None:
    page = new_page()
    page.goto(panel.url)
    expect(page.get_by_label("Serial number")).to_be_focused()
    expect(page.get_by_role("checkbox", name=re.compile("^Stator resistance ·"))).to_be_visible()
    page.keyboard.type("SN-1")
    tab_to(page, page.get_by_role("combobox", name="Motor type"))
    page.keyboard.press("Enter")
    chosen = page.get_by_role("option", name="lg-400w (virtual)")
    expect(chosen).to_be_visible()
    while page.locator(".q-item.q-manual-focusable--focused").filter(has_text="lg-400w (virtual)").count() == 0:
        page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    expect(page.get_by_text("missing: Six-step drive").first).to_be_visible()
    tab_to(page, page.get_by_label("Operator's name"))
    page.keyboard.type("J. Doe")
    tab_to(page, page.get_by_role("button", name="None", exact=True))
    page.keyboard.press("Enter")
    expect(page.get_by_role("checkbox", checked=True)).to_have_count(0)
    procedure = page.get_by_role("checkbox", name=re.compile("^Stator resistance ·"))
    tab_to(page, procedure)
    page.keyboard.press("Space")
    expect(procedure).to_be_checked()
    tab_to(page, page.get_by_role("button", name="Start", exact=True))
    page.keyboard.press("Enter")
    page.wait_for_url("**/runs/**")
    confirm_to_the_end(page, lambda: page.keyboard.press("Enter"))
    assert serial_of(panel, page) == "SN-1"

    tab_to(page, page.get_by_role("button", name="Sign …"))
    page.keyboard.press("Enter")
    signatures = page.get_by_role("region", name="Signatures")
    expect(signatures.get_by_role("combobox", name="I sign that")).to_be_focused()
    tab_to(page, signatures.get_by_role("button", name="Sign off"))
    page.keyboard.press("Enter")
    expect(signatures.get_by_text(re.compile(r"J\. Doe .* I measured this motor"))).to_be_visible()
    expect(signatures).to_be_focused()
    tab_to(page, page.get_by_role("button", name="Report", exact=True), key="Shift+Tab")
    with page.expect_download(timeout=60_000) as report:
        page.keyboard.press("Enter")
    assert report.value.suggested_filename.startswith("20")
    assert (panel.runs / page.url.rpartition("/")[2] / "signatures.json").exists()
    tab_to(page, page.get_by_role("button", name="Measure the next motor"), key="Shift+Tab")
    page.keyboard.press("Enter")

    # A scanner types into the serial number's field from wherever the cursor is; the type does not change by it.
    page.wait_for_url("**/?as_before=*")
    expect(page.get_by_role("button", name="Start", exact=True)).to_be_enabled()
    expect(page.get_by_role("checkbox", checked=True)).to_have_count(1)
    page.get_by_role("combobox", name="Motor type").focus()
    scan(page, "SN-2")
    page.wait_for_url("**/runs/**")

    def code() -> None:
        typed = page.locator("input[data-focus]")
        scan(page, "25.5" if typed.is_visible() else "DONE")

    confirm_to_the_end(page, code)
    assert serial_of(panel, page) == "SN-2"
    began = json.loads((panel.runs / page.url.rpartition("/")[2] / "journal.jsonl").read_text().splitlines()[0])["data"]
    assert began["person"] == "J. Doe"
    scan(page, "DONE")
    page.wait_for_url("**/?as_before=*")
    expect(page.get_by_label("Serial number")).to_be_focused()
    expect(page.get_by_label("Serial number")).to_have_value("")


def test_a_stray_code_confirms_nothing_and_is_named(panel: Panel, new_page: NewPage) -> None:
    page = new_page()
    begin(page, panel, "Stator resistance ·")
    heading, note = page.get_by_role("heading", level=1), page.locator("[data-untaken]:visible")
    ready = page.locator("[data-done]:not([aria-disabled])")
    expect(ready).to_be_focused()
    step, said = str(page.locator("[data-step]").get_attribute("data-step")), heading.inner_text()
    # A space would press the button that has the focus, and so would Enter.
    for code in ("SN-0815", "SN 777", "DONE2"):
        scan(page, code)
        expect(note).to_contain_text(f"'{code}' was not taken")
        expect(heading).to_have_text(said)
    mute = page.get_by_role("button", name="Mute")
    mute.focus()
    scan(page, "SN-0816")
    expect(note).to_contain_text("'SN-0816' was not taken")
    expect(mute).to_have_attribute("aria-pressed", "false")
    assert page.locator("[data-step]").get_attribute("data-step") == step
    scan(page, "DONE")
    expect(page.locator("[data-step]")).not_to_have_attribute("data-step", step)
    expect(note).to_have_count(0)
    field = page.locator("input[data-focus]")
    while not field.is_visible():
        # What has come whole has the focus.
        expect(ready).to_be_focused()
        step = str(page.locator("[data-step]").get_attribute("data-step"))
        page.keyboard.press("Enter")
        expect(page.locator("[data-step]")).not_to_have_attribute("data-step", step)
        expect(ready.or_(field).first).to_be_visible()
    # A number's place takes codes wherever the focus is, and says what is no number; the next takes its place.
    expect(ready).to_be_visible()
    said = heading.inner_text()
    page.evaluate("document.activeElement.blur()")
    scan(page, "SN-0815")
    expect(page.get_by_role("alert").filter(has_text="'SN-0815' is not a number")).to_be_visible()
    expect(heading).to_have_text(said)
    scan(page, "0012345678")
    expect(page.get_by_role("alert").filter(has_text="is outside")).to_be_visible()
    expect(heading).to_have_text(said)
    scan(page, "25.5")
    expect(heading).not_to_have_text(said)


def test_a_stray_code_does_not_go_on_to_the_next_motor(panel: Panel, new_page: NewPage) -> None:
    page = new_page()
    begin(page, panel, "Data sheet")
    onward = page.locator("[data-next]:not([aria-disabled])")
    expect(onward).to_be_focused()
    scan(page, "SN-0817")
    expect(page.locator("[data-untaken]:visible")).to_contain_text("'SN-0817' was not taken")
    page.evaluate("document.activeElement.blur()")
    scan(page, "done")
    page.wait_for_url("**/?as_before=*")
