"""The instruments by hand at the panel: a form, what is on, and everything off at the end."""

import json
from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from tests.bench.panel.browser.conftest import Panel

pytestmark = pytest.mark.slow

NewPage = Callable[[], Page]


def choose(page: Page, what: str, option: str) -> None:
    page.get_by_role("combobox", name=what, exact=True).click()
    page.get_by_role("option", name=option, exact=True).click()


def test_a_technician_uses_the_supply_by_hand(panel: Panel, new_page: NewPage) -> None:
    page = new_page()
    page.goto(panel.url)
    page.get_by_label("Motor type").click()
    page.get_by_text("lg-400w (virtual)").click()
    page.get_by_role("button", name="Use the instruments by hand").click()
    page.wait_for_url("**/runs/**")
    run = page.url.rpartition("/")[2]
    do = page.locator("[data-carry-out]")
    # Nothing goes on before it is said what is connected.
    choose(page, "What to do", "output on")
    # Its fields are those of what is chosen.
    expect(do).to_have_text("⚡ Switch on: output on")
    page.get_by_role("textbox", name="voltage (0 … 6.18 V)").fill("1")
    page.get_by_role("textbox", name="current limit (0 … 10 A)").fill("500 mA")
    choose(page, "regulated quantity, may be left out", "current")
    do.click()
    card = page.get_by_role("region", name="The present step")
    expect(card).to_contain_text("supply stays off until you have stated")
    choose(page, "A", "supply, plus")
    choose(page, "B", "supply, minus")
    page.get_by_role("button", name="Connect it so").click()
    page.get_by_role("button", name="Done", exact=True).click()
    expect(card).to_contain_text("Done: connect A=supply+ B=supply- C=open")
    # What was typed is still there.
    expect(page.get_by_role("textbox", name="current limit (0 … 10 A)")).to_have_value("500 mA")
    do.click()
    # First a person looks what is connected.
    expect(card).to_contain_text("the supply's plus on A")
    page.get_by_role("button", name="Confirmed: switch on").click()
    expect(card).to_contain_text(
        "ON: DC supply: output on · voltage 1 V · current limit 500 mA · regulated quantity: current"
    )
    expect(page.get_by_role("status").filter(has_text="Energised: ")).to_contain_text("DC supply")
    choose(page, "What to do", "read the current")
    # Never the button that stood there before, however busy the server is: that would switch on once more.
    do.click()
    expect(card).to_contain_text("DC supply: current ")
    line = page.get_by_role("textbox", name="Or type a command; help lists them")
    line.fill("supply energised 500 V 1 A")
    page.keyboard.press("Enter")
    expect(card).to_contain_text("supply is already on")
    page.get_by_role("button", name="Switch off", exact=True).click()
    expect(card).to_contain_text("Everything is off")
    line.fill("connect B=supply+ C=supply-")
    page.keyboard.press("Enter")
    page.get_by_role("button", name="Done", exact=True).click()
    # The form says what was typed.
    expect(page.get_by_role("combobox", name="A", exact=True)).to_have_value("nothing (leave it open)")
    expect(page.get_by_role("combobox", name="C", exact=True)).to_have_value("supply, minus")
    # Nobody looks over the bench for what is refused anyway, and a stray code switches nothing on.
    line.fill("supply energised 500 V 1 A")
    page.keyboard.press("Enter")
    expect(card).to_contain_text("voltage = 500 V is outside")
    line.fill("supply energised 1 V 1 A regulated=current")
    page.keyboard.press("Enter")
    on = page.get_by_role("button", name="Confirmed: switch on")
    expect(on).to_be_visible()
    on.focus()
    for code, said in (("SN 0815", "only the code DONE confirms"), ("DONE", "nothing waits for it now")):
        page.keyboard.type(code)
        page.keyboard.press("Enter")
        expect(page.locator("[data-untaken]:visible")).to_contain_text(said)
        expect(on).to_be_visible()
    page.get_by_role("button", name="Finish: everything off").click()
    expect(page.get_by_role("button", name="Measure the next motor")).to_be_visible()
    expect(page.get_by_role("region", name="Read by hand")).to_contain_text("supply measure_current")
    expect(page.get_by_role("button", name="Repeat")).to_have_count(0)
    events = [json.loads(line) for line in (panel.runs / run / "journal.jsonl").read_text().splitlines()]
    assert [one["kind"] for one in events if "energis" in one["kind"]] == ["energising", "energised", "de_energised"]
    assert events[-1]["data"]["status"] == "completed"
