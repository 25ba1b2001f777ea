"""Accounts at the panel: who signs second, and in whose name a line is run."""

import re
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from bench.panel.server.access import add_person
from tests.bench.panel.browser.test_line_page import EXAMPLE, scan
from tests.bench.panel.browser.test_line_page import QUICK as PLAN
from tests.bench.panel.browser.test_run_page import assert_accessible
from tests.bench.panel.conftest import QUICK, Server
from tests.bench.panel.shown_run import ShownRun

pytestmark = pytest.mark.slow

Serve = Callable[..., Server]
NewPage = Callable[[], Page]
PASSWORDS = {"anna": "correct horse", "bo": "battery staple", "chen": "orange lantern"}
RIGHTS = {"anna": "engineer", "bo": "operator", "chen": "engineer"}
TWO = '[station]\nname = "Two people"\nsignatures = 2\n'


def accounts(folder: Path) -> tuple[str, str]:
    """Return the option that names a file of accounts."""
    people = folder / "people.toml"
    for name, right in RIGHTS.items():
        add_person(people, name, right, PASSWORDS[name], QUICK)
    return "--people", str(people)


def log_in(page: Page, server: Server, name: str) -> None:
    page.goto(server.url)
    page.get_by_label("Name").fill(name)
    page.get_by_label("Password").fill(PASSWORDS[name])
    page.get_by_role("button", name="Log in").click()
    expect(page.get_by_role("button", name="Log out")).to_be_visible()


def log_out(page: Page) -> None:
    page.get_by_role("button", name="Log out").click()
    page.wait_for_url("**/login")


def sign(page: Page, name: str, meaning: str) -> None:
    """Sign as the account that is logged in, and see it listed."""
    card = page.get_by_role("region", name="Signatures")
    expect(card.get_by_label("Name", exact=True)).to_have_value(name)
    expect(card.get_by_label("Name", exact=True)).to_be_disabled()
    card.get_by_role("combobox", name="I sign that").click()
    page.get_by_role("option", name=meaning).click()
    card.get_by_label("Password").fill(PASSWORDS[name])
    card.get_by_role("button", name="Sign off").click()
    expect(card.get_by_text(re.compile(rf"^{name} \(\w+\) · {meaning}"))).to_be_visible()


def test_a_second_signature_is_asked_of_another_person(serve: Serve, new_page: NewPage, tmp_path: Path) -> None:
    server, page = serve("--virtual", *accounts(tmp_path)), new_page()
    with ShownRun(server.runs / "ended", "stator-resistance", "3.2.2/3", "Measure", station_file=TWO) as run:
        run.record("run_finished", status="completed", bench_time=1.0, wall_time=1.0)
    log_in(page, server, "anna")
    page.goto(f"{server.url}/runs/ended")
    card = page.get_by_role("region", name="Signatures")
    missing = card.get_by_text("signatures that this station asks for; each by another person")
    expect(missing).to_contain_text("0 of 2")
    sign(page, "anna", "I measured this motor")
    expect(missing).to_contain_text("1 of 2")
    # Who signs twice is still one person.
    sign(page, "anna", "I checked")
    expect(missing).to_contain_text("1 of 2")
    assert_accessible(page)
    log_out(page)
    log_in(page, server, "bo")
    page.goto(f"{server.url}/runs/ended")
    expect(card.get_by_text("Only an engineer may sign.")).to_be_visible()
    expect(card.get_by_role("button", name="Sign off")).to_have_count(0)
    log_out(page)
    log_in(page, server, "chen")
    page.goto(f"{server.url}/runs/ended")
    sign(page, "chen", "I checked")
    expect(missing).to_have_count(0)
    page.set_viewport_size({"width": 390, "height": 844})
    page.wait_for_function("document.documentElement.scrollWidth <= innerWidth")
    page.set_viewport_size({"width": 1400, "height": 900})


def test_a_line_is_run_in_the_name_of_the_account(serve: Serve, new_page: NewPage, tmp_path: Path) -> None:
    plans, records = tmp_path / "plans", tmp_path / "records.sqlite"
    plans.mkdir()
    (plans / "quick.toml").write_text(PLAN.format(name="quick", motor=EXAMPLE / "motor.toml", low=0.0))
    kept = ("--plans", str(plans), "--records", str(records))
    server, page = serve("--virtual", *kept, *accounts(tmp_path)), new_page()
    log_in(page, server, "bo")
    page.goto(f"{server.url}/line")
    name = page.get_by_label("Operator's name")
    expect(name).to_have_value("bo")
    expect(name).to_be_disabled()
    page.get_by_label("Virtual sockets").fill("1")
    page.get_by_label("Virtual sockets").blur()
    expect(page.get_by_role("radio", checked=True)).to_be_visible()
    page.get_by_role("button", name="Begin", exact=True).click()
    expect(page.get_by_text("Scan the first motor.")).to_be_visible()
    scan(page, "SN-1")
    expect(page.locator(".mb-tile[data-state=pass]")).to_be_visible()
    page.keyboard.press("Control+End")
    expect(page.get_by_text("The batch has ended.")).to_be_visible()
    with closing(sqlite3.connect(records)) as connection:
        assert connection.execute("select serial_number, person from motor").fetchall() == [("SN-1", "bo")]
