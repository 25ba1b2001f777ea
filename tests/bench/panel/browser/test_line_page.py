import re
import sqlite3
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from bench.cli.main import main
from bench.panel.launch import LINE
from tests.bench.panel.browser.conftest import Panel

pytestmark = pytest.mark.slow

NewPage = Callable[[], Page]
EXAMPLE = Path(__file__).parents[4] / "docs" / "examples" / "eol"
QUICK = """
[plan]
name = "{name}"
motor = "{motor}"
guard = "shared"
keep_waveforms = "none"

[[procedure]]
name = "stator-resistance"
settings = {{ winding_temperature = 25.0, short_correction = false }}

[[limit]]
parameter = "stator_resistance"
low = {low}
high = 10.0
"""


def plan(panel: Panel, name: str, low: float = 0.0) -> None:
    """Write the plan to choose; its name is the batch's."""
    panel.plans.mkdir()
    content = QUICK.format(name=name, motor=EXAMPLE / "motor.toml", low=low)
    (panel.plans / f"{name}.toml").write_text(content)


def open_line(page: Page, panel: Panel, *, sockets: int = 2) -> None:
    page.goto(f"{panel.url}/line")
    page.get_by_label("Operator's name").fill("J. Doe")
    page.get_by_label("Virtual sockets").fill(str(sockets))
    page.get_by_label("Virtual sockets").blur()
    expect(page.get_by_role("radio", checked=True)).to_be_visible()
    page.get_by_role("button", name="Begin", exact=True).click()
    expect(page.get_by_text("Scan the first motor.")).to_be_visible()


def scan(page: Page, serial: str) -> None:
    """As a scanner does: keys, wherever the cursor is, and Enter."""
    page.keyboard.type(serial)
    page.keyboard.press("Enter")


def tiles(page: Page, state: str) -> int:
    return page.locator(f".mb-tile[data-state={state}]").count()


def count(page: Page, what: str) -> "Page":
    return page.locator(f'[data-count="{what}"] .mb-count')  # type: ignore[return-value]


def test_motors_scanned_one_after_the_other(panel: Panel, new_page: NewPage) -> None:
    plan(panel, "three")
    page = new_page()
    open_line(page, panel)
    for serial in ("SN-1", "SN-2", "SN-3"):
        scan(page, serial)
    expect(count(page, "PASS")).to_have_text("✓ 3")
    assert tiles(page, "pass") == 2
    scan(page, "SN-2")
    refused = page.get_by_text("serial number SN-2 was tested before: pass")
    expect(refused).to_be_visible()
    expect(count(page, "Motors judged")).to_have_text("3")
    # A person may answer for it; the motor counts once.
    page.get_by_role("button", name="Test SN-2 again: J. Doe answers for it").click()
    expect(count(page, "PASS")).to_have_text("✓ 4")
    expect(count(page, "Motors judged")).to_have_text("3")
    scan(page, "SN-3")
    expect(page.get_by_text("serial number SN-3 was tested before: pass")).to_be_visible()

    page.reload()
    expect(count(page, "PASS")).to_have_text("✓ 4")
    page.get_by_role("button", name="中文").click()
    expect(page.get_by_label("工位 1").get_by_text("✓ 合格")).to_be_visible()
    # What a line said before is said again in the language of who reads it now.
    expect(page.get_by_text("序列号 SN-3 已测试过")).to_be_visible()
    page.keyboard.press("Control+End")
    expect(page.get_by_text("批次已结束。")).to_be_visible()
    expect(page.get_by_role("button", name="中止批次")).to_be_hidden()
    assert not list(panel.runs.glob(f"*/{LINE}"))


def test_records_that_no_database_takes_are_shown_until_they_are_stored(panel: Panel, new_page: NewPage) -> None:
    plan(panel, "locked")
    page = new_page()
    open_line(page, panel, sockets=1)
    holder = sqlite3.connect(panel.records, isolation_level=None)
    holder.execute("BEGIN IMMEDIATE")
    scan(page, "SN-1")
    shown = page.locator(".mb-records")
    expect(shown).to_contain_text("records that are in no database yet, kept in files: 1")
    expect(shown).to_contain_text("the station's own database accepts no records: database is locked")
    expect(shown).to_contain_text("the next try is at")
    expect(count(page, "PASS")).to_have_text("✓ 1")
    holder.rollback()
    holder.close()
    expect(shown).to_be_hidden()
    page.get_by_role("button", name="Abort the batch").click()
    expect(page.get_by_text("The batch has ended.")).to_be_visible()


def test_a_motor_outside_its_limits(panel: Panel, new_page: NewPage) -> None:
    plan(panel, "strict", low=5.0)
    page = new_page()
    open_line(page, panel, sockets=1)
    scan(page, "SN-1")
    tile = page.get_by_label("Socket 1")
    expect(tile.get_by_text("✗ FAIL")).to_be_visible()
    expect(tile.get_by_text(re.compile(r"^Stator resistance: \d\d\.\d mΩ$"))).to_be_visible()
    expect(tile.get_by_text("limits 5000")).to_be_visible()
    expect(tile.get_by_text("Take it out, to the rejects.")).to_be_visible()
    page.get_by_role("button", name="Abort the batch").click()
    expect(page.get_by_text("The batch has ended.")).to_be_visible()


def test_a_plan_that_is_not_right_is_refused_in_the_readers_language(panel: Panel, new_page: NewPage) -> None:
    plan(panel, "reversed", low=20.0)
    page = new_page()
    page.goto(f"{panel.url}/line")
    page.get_by_role("button", name="中文").click()
    refused = page.get_by_role("radio", name="reversed", disabled=True)
    expect(refused).to_contain_text("stator_resistance 的限值：low = 20 大于 high = 10")


def test_a_first_plan_is_made_from_a_measured_motor(panel: Panel, new_page: NewPage) -> None:
    run = ["run", "stator-resistance-dc", "--station", "virtual", "--motor", "lg-400w", "--operator", "virtual"]
    with pytest.raises(SystemExit, match="0"):
        main([*run, "--serial-number", "SN-7", "--runs", str(panel.runs)])
    page = new_page()
    page.goto(f"{panel.url}/line")
    expect(page.get_by_text("There is no plan yet")).to_be_visible()
    page.get_by_text("Make a plan from a measured motor").click()
    page.get_by_label("Run", exact=True).click()
    page.get_by_role("option", name="SN-7").first.click()
    page.get_by_role("button", name="Make the plan").click()
    made = page.get_by_role("radio", name="lg-400w", checked=True)
    expect(made).to_contain_text("limits: 1 · procedures: 1")
    page.get_by_label("Operator's name").fill("J. Doe")
    page.get_by_label("Virtual sockets").fill("1")
    page.get_by_label("Virtual sockets").blur()
    page.get_by_role("button", name="Begin", exact=True).click()
    expect(page.get_by_text("Scan the first motor.")).to_be_visible()
    scan(page, "SN-8")
    tile = page.get_by_label("Socket 1")
    expect(tile.get_by_text("✓ PASS")).to_be_visible()
    expect(tile.get_by_text("1 of 1 within their limits")).to_be_visible()
    page.get_by_role("button", name="Abort the batch").click()
    expect(page.get_by_text("The batch has ended.")).to_be_visible()


def test_another_browser_and_a_new_server_show_the_same_line(panel: Panel, new_page: NewPage) -> None:
    plan(panel, "seen")
    page, other = new_page(), new_page()
    open_line(page, panel)
    scan(page, "SN-1")
    expect(count(page, "PASS")).to_have_text("✓ 1")
    other.goto(f"{panel.url}/line")
    expect(count(other, "PASS")).to_have_text("✓ 1")
    other.get_by_label("Scan a serial number").click()
    scan(other, "SN-2")
    expect(other.get_by_text("Another has the control: take it first.")).to_be_visible()

    # A page that is open loads itself anew as soon as the server is back, which would cut off another loading.
    page.goto("about:blank")
    panel.stop()
    panel.start()
    page.goto(f"{panel.url}/line")
    expect(count(page, "PASS")).to_have_text("✓ 1")
    scan(page, "SN-2")
    expect(count(page, "PASS")).to_have_text("✓ 2")
    page.keyboard.press("Control+Escape")
    expect(page.get_by_text("The batch has ended.")).to_be_visible()


def test_a_second_begin_starts_no_second_batch(panel: Panel, new_page: NewPage) -> None:
    plan(panel, "once")
    page, before = new_page(), set(panel.runs.glob("*"))
    page.goto(f"{panel.url}/line")
    # Both clicks before the page can change.
    expect(page.get_by_role("radio", checked=True)).to_be_visible()
    page.get_by_role("button", name="Begin", exact=True).evaluate("button => { button.click(); button.click(); }")
    expect(page.get_by_text("Scan the first motor.")).to_be_visible()
    expect(page.get_by_text("batch once, plan once")).to_be_visible()
    page.keyboard.press("Control+Escape")
    expect(page.get_by_text("The batch has ended.")).to_be_visible()
    assert [path.name for path in set(panel.runs.glob("*")) - before if path.name.startswith("once")] == ["once"]
