"""Names that would act if they became markup, and pages whose session has ended."""

import json
import re
import shutil
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import pytest
from PIL import Image
from playwright.sync_api import Page, expect

from bench.cli.main import main
from bench.journal.stored_result import store_text
from bench.operators.operator_channel import OperatorLine
from bench.panel.launch import LINE
from bench.panel.server.access import add_person
from drivers.interfaces.text import word
from tests.bench.panel.browser.conftest import Panel
from tests.bench.panel.browser.test_run_page import assert_accessible
from tests.bench.panel.conftest import QUICK, Server

NewPage = Callable[[], Page]
Serve = Callable[..., Server]
EXAMPLE = Path(__file__).parents[4] / "docs" / "examples" / "eol"
#: Each acts in its own way where it becomes markup, an attribute, a string of properties or a script.
HOSTILE = """x' onclick=hit=1 " :label="hit=2" <img src=x onerror=hit=3>"""
PERSON = "</script><script>hit=4</script>`${hit=5}`"


def assert_nothing_acted(page: Page) -> None:
    assert page.evaluate("window.hit") is None
    assert page.locator("img[onerror], [onclick]").count() == 0


def hostile_motor(path: Path) -> Path:
    plate = (EXAMPLE / "motor.toml").read_text()
    changed = plate.replace('name = "LG-400W"', f"name = {json.dumps(HOSTILE)}")
    path.write_text(changed.replace('A = "white"', f"A = {json.dumps(HOSTILE)}"))
    return path


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished run whose folder, motor, serial number and person are hostile."""
    folder = tmp_path_factory.mktemp("hostile")
    motor = hostile_motor(folder / "motor.toml")
    arguments = [
        "run",
        "stator-resistance",
        "--station",
        "virtual",
        "--motor",
        str(motor),
        "--runs",
        str(folder / "runs"),
    ]
    with pytest.raises(SystemExit, match="0"):
        main([*arguments, "--seed=1", f"--serial-number={HOSTILE}", f"--person={PERSON}"])
    return next((folder / "runs").glob("*/result.json")).parent


@pytest.mark.slow
def test_a_hostile_runs_name_does_nothing(serve: Serve, new_page: NewPage, finished: Path, tmp_path: Path) -> None:
    (tmp_path / "runs").mkdir()
    shutil.copytree(finished, tmp_path / "runs" / HOSTILE)
    shutil.copytree(finished, tmp_path / "runs" / "other")
    server, page = serve("--virtual"), new_page()
    page.goto(f"{server.url}/history")
    expect(page.get_by_role("link", name=HOSTILE, exact=True)).to_be_visible()
    expect(page.get_by_text(PERSON, exact=True)).to_have_count(2)
    box = page.get_by_role("checkbox", name=f"Choose {HOSTILE}", exact=True)
    box.click()
    assert_nothing_acted(page)
    page.get_by_role("checkbox", name="Choose other", exact=True).click()
    page.get_by_role("button", name="Compare the two chosen").click()
    page.wait_for_url("**/compare/**")
    expect(page.get_by_role("columnheader", name=HOSTILE)).to_be_visible()
    assert_nothing_acted(page)
    page.goto(f"{server.url}/history")
    page.get_by_role("link", name=HOSTILE, exact=True).click()
    expect(page.get_by_role("status").filter(has_text=f"{HOSTILE} · {HOSTILE}")).to_be_visible()
    expect(page.get_by_role("region", name="Parameters").get_by_role("table").first).to_be_visible()
    assert_nothing_acted(page)


@pytest.mark.slow
def test_hostile_sockets_serial_numbers_and_plans_do_nothing(serve: Serve, new_page: NewPage, tmp_path: Path) -> None:
    (tmp_path / "runs" / "batch").mkdir(parents=True)
    now = datetime.now(UTC).isoformat()
    ended = {"verdict": "fail", "serial_number": HOSTILE, "cause": store_text(word(HOSTILE))}
    ended |= {"inside": 0, "limited": 1, "closest": None}
    ended["outside"] = [
        {"label": store_text(word(HOSTILE)), "value": HOSTILE, "unit": HOSTILE, "low": "", "high": "", "place": None}
    ]
    batch = OperatorLine(lambda _: None)
    try:
        batch.say(
            {
                "line": {
                    "sockets": [
                        {"name": HOSTILE, "serial_number": HOSTILE, "since": now, "last": None},
                        {"name": f"{HOSTILE} 2", "serial_number": "", "since": "", "last": ended},
                    ],
                    "counts": {
                        "verdicts": dict.fromkeys(("pass", "fail", "error", "aborted"), 1),
                        "first_pass": 1,
                        "since": now,
                    },
                    "message": {"kind": "begun", "words": HOSTILE, "socket": HOSTILE},
                    "batch": HOSTILE,
                    "plan": HOSTILE,
                    "waiting": 0,
                    "ending": None,
                }
            }
        )
        batch.announce(tmp_path / "runs" / "batch", LINE)
        server, page = serve("--virtual"), new_page()
        page.goto(f"{server.url}/line")
        expect(page.get_by_label(f"Socket {HOSTILE}", exact=True)).to_be_visible()
        expect(page.get_by_label(f"Socket {HOSTILE} 2", exact=True)).to_contain_text(HOSTILE)
        assert_nothing_acted(page)
    finally:
        batch.close()


@pytest.mark.slow
def test_a_hostile_motor_does_nothing_in_its_drawing(panel: Panel, new_page: NewPage) -> None:
    panel.motors.mkdir()
    file = panel.motors / "motor.toml"
    hostile_motor(file)
    file.write_text(file.read_text().replace("[nameplate]", '[nameplate]\nphoto = "photo.png"', 1))
    Image.new("RGB", (40, 30), "orange").save(panel.motors / "photo.png")
    page = new_page()
    page.goto(f"{panel.url}/?motor=motor")
    page.get_by_label("Operator's name").fill(HOSTILE)
    page.get_by_role("button", name="Start", exact=True).click()
    page.wait_for_url("**/runs/*")
    expect(page.get_by_text("Take the motor's shaft off")).to_be_visible()
    drawing = page.get_by_role("img", name=re.compile("^Connections"))
    expect(drawing.locator("text").filter(has_text=HOSTILE[:20]).first).to_be_visible()
    expect(page.get_by_role("img", name="Photo of the motor")).to_be_visible()
    assert page.evaluate("document.querySelector('svg image') instanceof SVGImageElement")
    # Drawn as a picture, and not as unknown elements of a page.
    assert page.evaluate("document.querySelector('svg[role=img] path') instanceof SVGPathElement")
    assert_nothing_acted(page)


def log_in(page: Page, server: Server) -> None:
    page.goto(server.url)
    page.get_by_label("Name").fill("anna")
    page.get_by_label("Password").fill("correct horse")
    page.get_by_role("button", name="Log in").click()
    expect(page.get_by_role("button", name="Log out")).to_be_visible()


def test_an_ended_sessions_page_says_so_and_still_aborts(serve: Serve, new_page: NewPage, tmp_path: Path) -> None:
    people = tmp_path / "people.toml"
    add_person(people, "anna", "engineer", "correct horse", QUICK)
    server, page = serve("--virtual", "--people", str(people)), new_page()
    log_in(page, server)
    page.get_by_label("Motor type").click()
    page.get_by_text("lg-400w (virtual)").click()
    page.get_by_role("button", name="Start", exact=True).click()
    page.wait_for_url("**/runs/*")
    done = page.get_by_role("button", name="Done")
    expect(done).to_be_visible()
    run = server.runs / page.url.rpartition("/")[2]
    server.pass_an_hour()
    expect(page.get_by_role("alert").filter(has_text="UNKNOWN")).to_be_visible()
    # The run goes on, and its page shows nothing of it any more.
    assert '"run_finished"' not in (run / "journal.jsonl").read_text()
    expect(done).to_be_hidden()
    expect(page.get_by_role("status").filter(has_text="Outputs off")).to_have_count(0)
    assert_accessible(page)
    abort = page.get_by_role("button", name="ABORT")
    before = abort.bounding_box()
    abort.click()
    expect(page.get_by_text("The abort was passed on.")).to_be_visible()
    assert abort.bounding_box() == before
    page.get_by_role("link", name="Log in again").click()
    page.wait_for_url("**/login")
    log_in(page, server)
    page.goto(f"{server.url}/runs/{run.name}")
    expect(page.get_by_role("alert").filter(has_text="ABORTED")).to_contain_text("anna")


@pytest.mark.slow
def test_who_logs_out_is_out_in_every_tab(serve: Serve, new_page: NewPage, tmp_path: Path) -> None:
    people = tmp_path / "people.toml"
    add_person(people, "anna", "engineer", "correct horse", QUICK)
    server, page = serve("--virtual", "--people", str(people)), new_page()
    log_in(page, server)
    with page.context.new_page() as tab:
        tab.goto(f"{server.url}/history")
        expect(tab.get_by_text("0 of 0 runs")).to_be_visible()
        page.get_by_role("button", name="Log out").click()
        page.wait_for_url("**/login")
        expect(tab.get_by_role("alert").filter(has_text="UNKNOWN")).to_be_visible()
        expect(tab.get_by_role("button", name="ABORT")).to_have_count(0)
        tab.goto(f"{server.url}/history")
        tab.wait_for_url("**/login")
