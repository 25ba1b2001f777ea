import json
import re
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from bench.cli.main import main
from bench.panel.server.access import add_person
from tests.bench.panel.browser.conftest import PATIENCE, Panel
from tests.bench.panel.browser.test_browser import answer_until_end, begin, choose
from tests.bench.panel.conftest import QUICK, Server

pytestmark = pytest.mark.slow

LG_400W = Path(__file__).parents[4] / "bench" / "motors" / "lg-400w.toml"

Serve = Callable[..., Server]
NewPage = Callable[[], Page]


def log_in(page: Page, name: str, password: str) -> None:
    page.get_by_label("Name").fill(name)
    page.get_by_label("Password").fill(password)
    page.get_by_role("button", name="Log in").click()


def come_to_rest(page: Page) -> None:
    """Wait until the server sends the page nothing but its heart-beat."""
    page.evaluate("window.updates = 0; window.socket.on('update', () => { window.updates += 1; })")
    for _ in range(int(PATIENCE / 2.0)):
        before = page.evaluate("window.updates")
        page.wait_for_timeout(2000.0)
        if page.evaluate("window.updates") == before:
            return
    pytest.fail("each update has the browser work out the whole page, and they do not end")


@pytest.fixture
def runs(tmp_path: Path) -> Path:
    """Two finished runs of one motor, as the command line makes them."""
    for seed, serial in (("1", "SN-1"), ("2", "SN-2")):
        arguments = [
            "run",
            "stator-resistance",
            "dq-inductance-time-constant",
            "--station",
            "virtual",
            "--motor",
            "lg-400w",
        ]
        arguments += [
            "--runs",
            str(tmp_path / "runs"),
            "--seed",
            seed,
            "--serial-number",
            serial,
            "--person",
            "A. Smith",
        ]
        with pytest.raises(SystemExit, match="0"):
            main(arguments)
    return tmp_path / "runs"


def test_runs_are_found_opened_compared_and_signed(serve: Serve, new_page: NewPage, runs: Path) -> None:
    people = runs.parent / "people.toml"
    add_person(people, "J.Doe", "engineer", "battery staple", QUICK)
    server, page = serve("--virtual", "--people", str(people)), new_page()
    page.goto(server.url)
    log_in(page, "J.Doe", "battery staple")
    expect(page.get_by_role("button", name="Start", exact=True)).to_be_enabled()
    # An account acts in its own name.
    expect(page.get_by_label("Operator's name")).to_have_value("J.Doe")
    expect(page.get_by_label("Operator's name")).to_be_disabled()
    page.goto(f"{server.url}/history")
    expect(page.get_by_text("2 of 2 runs")).to_be_visible()
    page.get_by_label("Search").fill("sn-2 lg-400w")
    expect(page.get_by_text("1 of 2 runs")).to_be_visible()
    page.get_by_role("button", name="中文").click()
    for words, found in (("已完成 定子电阻", 2), ("sn-1 定子电阻", 1), ("已中止", 0)):
        page.get_by_label("搜索").fill(words)
        expect(page.get_by_text(f"共 2 次，符合 {found} 次")).to_be_visible()
    page.get_by_role("button", name="English").click()
    expect(page.get_by_text("2 of 2 runs")).to_be_visible()
    for box in page.get_by_role("checkbox", name=re.compile("^Choose ")).all():
        box.click()
    page.get_by_role("button", name="Compare the two chosen").click()
    page.wait_for_url("**/compare/**")
    expect(page.get_by_text(re.compile("LG-400W · SN-[12] ↔ LG-400W · SN-[12]"))).to_be_visible()
    expect(page.get_by_role("row", name=re.compile("Stator resistance .* mΩ"))).to_be_visible()
    run = sorted(path.name for path in runs.iterdir())[0]
    page.goto(f"{server.url}/runs/{run}")
    page.get_by_label("Record", exact=True).click()
    page.get_by_role("option", name=re.compile("dq inductance, time constant · 3.3.1-d.4")).first.click()
    expect(page.get_by_role("region", name="Waveforms").locator("canvas").first).to_be_visible()
    signatures = page.get_by_role("region", name="Signatures")
    signatures.get_by_label("Password").fill("battery horse")
    signatures.get_by_role("button", name="Sign off").click()
    expect(signatures.get_by_role("alert")).to_contain_text("nothing was signed")
    signatures.get_by_label("Password").fill("battery staple")
    signatures.get_by_role("button", name="Sign off").click()
    expect(signatures.get_by_text(re.compile(r"J\.Doe \(engineer\) · I measured this motor"))).to_be_visible()
    assert json.loads((server.runs / run / "signatures.json").read_text())[0]["meaning"] == "measured"
    page.get_by_role("button", name="Export", exact=True).click()
    with page.expect_download() as download:
        page.get_by_text("JSON").click()
    assert download.value.suggested_filename.endswith(".json")
    assert "stator_resistance" in Path(download.value.path()).read_text()
    made = page.get_by_role("status", name="Made of this run")
    made.get_by_text("What is in it").click()
    expect(made.get_by_text(re.compile('"stator_resistance"'))).to_be_visible()


def test_a_record_that_was_changed_is_said_to_be(serve: Serve, new_page: NewPage, runs: Path) -> None:
    server, page = serve("--virtual"), new_page()
    run = min(runs.iterdir())
    changed = page.get_by_role("alert").filter(has_text="This record was changed after it was written")
    page.goto(f"{server.url}/runs/{run.name}")
    expect(page.get_by_role("button", name="Measure the next motor")).to_be_visible()
    expect(changed).to_have_count(0)
    come_to_rest(page)
    journal = run / "journal.jsonl"
    whole = journal.read_bytes()
    place = whole.index(b"SN-1") + len("SN-")
    journal.write_bytes(whole[:place] + b"7" + whole[place + 1 :])
    page.reload()
    expect(changed).to_contain_text("does not follow from the line before")
    page.get_by_role("button", name="中文").click()
    expect(page.get_by_role("alert").filter(has_text="此记录在写入之后被改动过")).to_be_visible()
    # One that has read nothing of it before.
    server.stop()
    server.start()
    page.goto(f"{server.url}/runs/{run.name}")
    expect(page.get_by_text("之前一行不符").or_(page.get_by_text("此记录在写入之后被改动过")).first).to_be_visible()
    page.get_by_role("button", name="English").click()


def test_the_end_of_a_run_is_a_picture_and_the_next_motor_is_measured_as_before(
    panel: Panel, new_page: NewPage, tmp_path: Path
) -> None:
    page = new_page()
    run = begin(page, panel, "Stator resistance ·", "dq inductance, smallest")
    expect(page.get_by_role("region", name="Progress")).to_contain_text("LG-400W · SN-0815")
    answer_until_end(page)
    began = json.loads((panel.runs / run / "journal.jsonl").read_text().splitlines()[0])["data"]
    assert began["person"] == "J. Doe"
    assert began["motor"]["serial_number"] == "SN-0815"
    row = page.get_by_role("row", name=re.compile("^d-axis inductance"))
    expect(row.get_by_role("img")).to_have_attribute("aria-label", re.compile("interval −.* the note's formula"))
    expect(page.get_by_role("figure", name=re.compile("[✓⚠].* pattern ")).first.locator("canvas")).to_be_visible()
    what_to_do = page.get_by_role("region", name="What to do, most important first")
    expect(what_to_do.get_by_role("button", name="Repeat Stator resistance").first).to_be_visible()
    expect(what_to_do.get_by_text("nothing to do")).to_be_visible()
    page.get_by_role("button", name="Measure the next motor").click()
    expect(page.get_by_label("Motor type")).to_have_value("lg-400w (virtual)")
    expect(page.get_by_role("checkbox", checked=True)).to_have_count(2)
    expect(page.get_by_label("Serial number")).to_have_value("")
    page.goto(f"{panel.url}/runs/nothing")
    expect(page.get_by_role("link", name="Measure")).to_be_visible()


def test_a_choice_is_rehearsed_before_it_is_run(panel: Panel, new_page: NewPage) -> None:
    page, before = new_page(), set(panel.runs.glob("*/journal.jsonl"))
    page.goto(panel.url)
    choose(page, "lg-400w", "Stator resistance ·")
    page.get_by_role("button", name="Rehearse").click()
    expect(page.get_by_text(re.compile(r"about \d+\.\d min, \d+ s of it by hand"))).to_be_visible()
    assert set(panel.runs.glob("*/journal.jsonl")) == before


def test_a_setting_is_changed_refused_where_it_is_wrong_and_kept_for_the_next_motor(
    panel: Panel, new_page: NewPage
) -> None:
    page = new_page()
    page.goto(panel.url)
    choose(page, "lg-400w", "Stator resistance ·")
    page.get_by_role("button", name="Settings").click()
    page.get_by_role("combobox", name="Change a setting").fill("test frequency")
    page.get_by_role("option", name="Stator resistance: test frequency, Hz (usually 20)").click()
    frequency = page.get_by_role("textbox", name="Stator resistance: test frequency, Hz")
    frequency.fill("-5")
    page.get_by_role("button", name="Start", exact=True).click()
    expect(page.get_by_role("alert").filter(has_text="a number above 0")).to_be_visible()
    frequency.fill("100")
    page.get_by_role("button", name="Start", exact=True).click()
    page.wait_for_url("**/runs/**")
    begun = (panel.runs / page.url.rpartition("/")[2] / "journal.jsonl").read_text().splitlines()[0]
    assert json.loads(begun)["data"]["settings"] == ["stator-resistance.frequency=100"]
    answer_until_end(page)
    page.get_by_role("button", name="Measure the next motor").click()
    expect(page.get_by_role("textbox", name="Stator resistance: test frequency, Hz")).to_have_value("100")
    # What is set for a procedure that is not chosen is left out, not refused.
    page.get_by_role("button", name="None").click()
    page.get_by_role("checkbox", name=re.compile("^Data sheet")).click()
    page.get_by_role("button", name="Start", exact=True).click()
    page.wait_for_url("**/runs/**")


def test_a_figure_outside_the_types_tolerance_is_shown_and_measured_again(
    panel: Panel, new_page: NewPage, tmp_path: Path
) -> None:
    panel.motors.mkdir(exist_ok=True)
    typical = "\n[expected]\nstator_resistance = 0.032\n[tolerance]\nstator_resistance = 0.05\n"
    (panel.motors / "typed.toml").write_text(LG_400W.read_text() + typical)
    page = new_page()
    page.goto(panel.url)
    page.get_by_label("Motor type").click()
    page.get_by_role("option", name="typed").click()
    page.get_by_role("button", name="None").click()
    page.get_by_role("checkbox", name=re.compile("^Stator resistance ·")).click()
    page.get_by_role("button", name="Start", exact=True).click()
    page.wait_for_url("**/runs/**")
    answer_until_end(page)
    expect(page.get_by_role("heading", level=1)).to_contain_text("Needs attention: Stator resistance")
    expect(page.locator("[data-verdict=outside]")).to_be_visible()
    what_to_do = page.get_by_role("region", name="What to do, most important first")
    finding = what_to_do.locator(".mb-finding[data-rank=contradiction]").filter(has_text="−50 %")
    expect(finding).to_be_visible()
    finding.get_by_role("button", name="Repeat Stator resistance").click()
    expect(page.locator("[data-done]:not([aria-disabled])")).to_be_visible()
    journal = (panel.runs / page.url.rpartition("/")[2] / "journal.jsonl").read_text()
    assert journal.count('"kind":"procedure_started"') == 2


def test_a_motor_is_entered_by_its_nameplate(panel: Panel, new_page: NewPage) -> None:
    page = new_page()
    page.goto(f"{panel.url}/motor")
    page.get_by_label("Motor's name *").fill("Pump drive 3")
    page.get_by_label("Connection of the windings").click()
    page.get_by_role("option", name="delta").click()
    page.get_by_label("Rated current").fill("-2")
    page.get_by_role("button", name="Save").click()
    expect(page.get_by_role("alert")).to_contain_text("rated_current")
    page.get_by_label("Rated current").fill("2,5")
    page.get_by_label("Colour of wire A").fill("red")
    page.get_by_label("Hall sensors").click()
    page.get_by_role("option", name="no").click()
    page.get_by_role("button", name="Save").click()
    page.wait_for_url("**/?motor=pump-drive-3")
    plate = tomllib.loads((panel.motors / "pump-drive-3.toml").read_text())["nameplate"]
    assert plate == {
        "name": "Pump drive 3",
        "connection": "delta",
        "rated_current": 2.5,
        "hall_sensors": False,
        "wire_colours": {"A": "red"},
    }


def test_a_nameplate_that_is_not_right_is_refused_in_the_readers_language(panel: Panel, new_page: NewPage) -> None:
    page = new_page()
    page.goto(f"{panel.url}/motor")
    page.get_by_role("button", name="中文").click()
    page.get_by_label("电机名称").fill("Pump drive 4")
    page.get_by_label("额定电流").fill("-2")
    page.get_by_role("button", name="保存").click()
    fault = page.get_by_role("alert")
    expect(fault).to_contain_text("nameplate：缺少 connection；请给出：'wye' 或 'delta'")
    expect(fault).to_contain_text("rated_current = -2；允许值：大于 0 且不超过 10000 A 的数（相，峰值）")


def test_a_network_asks_for_a_login_and_a_viewer_only_watches(serve: Serve, new_page: NewPage, tmp_path: Path) -> None:
    people = tmp_path / "people.toml"
    add_person(people, "bo", "viewer", "battery staple", QUICK)
    server, page = serve("--virtual", "--people", str(people)), new_page()
    page.goto(f"{server.url}/history")
    page.wait_for_url("**/login")
    log_in(page, "bo", "wrong wrong")
    expect(page.get_by_role("alert")).to_be_visible()
    log_in(page, "bo", "battery staple")
    expect(page.get_by_role("button", name="Start", exact=True)).to_be_disabled()
    expect(page.get_by_role("button", name="Rehearse")).to_be_enabled()
    page.get_by_label("Motor type").click()
    page.get_by_text("lg-400w (virtual)").click()
    page.get_by_label("Serial number").press("Enter")
    expect(page.get_by_role("button", name="Take the control")).to_be_hidden()
    page.goto(f"{server.url}/motor")
    expect(page.get_by_text("Only an engineer may enter motors.")).to_be_visible()
    assert not list(server.runs.glob("*/*"))


def test_a_network_without_people_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["serve", "--virtual", "--host", "0.0.0.0"])  # noqa: S104  that is what is refused
    assert "--people FILE" in capsys.readouterr().err
