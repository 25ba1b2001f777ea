import json
import math
from collections.abc import Callable, Collection, Iterable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from bench.cli.main import main
from bench.eol.record import CheckRecord, MeasuredFigure, MotorRecord
from bench.eol.store.database import open_database
from bench.eol.store.records import Records
from bench.eol.verdict import Verdict
from tests.bench.eol.motor_records import motor_record
from tests.bench.panel.browser.conftest import Panel
from tests.bench.panel.conftest import Server

pytestmark = pytest.mark.slow

Serve = Callable[..., Server]
NewPage = Callable[[], Page]
NOON = datetime(2026, 11, 21, 12, tzinfo=UTC)
LIMITS = {"stator_resistance": (9.4, 10.6), "cogging_torque": (-math.inf, 0.05)}
UNITS = {"stator_resistance": "Ω", "cogging_torque": "N·m"}


def record(number: int, batch: str, serial: str, model: str, values: dict[str, float]) -> MotorRecord:
    verdicts = {n: Verdict.PASS if LIMITS[n][0] <= v <= LIMITS[n][1] else Verdict.FAIL for n, v in values.items()}
    verdict = Verdict.FAIL if Verdict.FAIL in verdicts.values() else Verdict.PASS
    return motor_record(
        number,
        batch=batch,
        person="Wang",
        model=model,
        serial_number=serial,
        started=NOON + timedelta(hours=number),
        ended=NOON + timedelta(hours=number, seconds=3),
        verdict=verdict,
        # Every tenth motor needed a second attempt.
        first_pass=verdict is Verdict.PASS and number % 10 != 0,
        bench_time=1.0,
        measured=tuple(MeasuredFigure(n, v, UNITS[n], 1e-3, 2e-3, *LIMITS[n], verdicts[n]) for n, v in values.items()),
        checks=(CheckRecord("stator-resistance", 1, verdict, 1.0),),
    )


def keep(
    path: Path, *batches: tuple[str, str, Iterable[tuple[str, dict[str, float]]]], golden: Collection[str] = ()
) -> str:
    """Keep batches' motors, each a serial number and its figures, and which are golden ones; return the file."""
    engine = open_database(str(path))
    records, number = Records(engine), 0
    for batch, model, motors in batches:
        for serial, values in motors:
            number += 1
            kept = record(number, batch, serial or f"P-{number:03d}", model, values)
            records.save(replace(kept, golden=serial in golden, socket=str(1 + number % 2)))
    engine.dispose()
    return str(path)


def motors(count: int, seed: int) -> list[tuple[str, dict[str, float]]]:
    random = np.random.default_rng(seed)
    return [
        ("", {"stator_resistance": float(r), "cogging_torque": float(t)})
        for r, t in zip(random.normal(10.0, 0.2, count), random.normal(0.03, 0.004, count), strict=True)
    ]


def reported(capsys: pytest.CaptureFixture[str], records: str, *arguments: str) -> dict[str, Any]:
    """Return what the command says of the same records."""
    with pytest.raises(SystemExit):
        main(["eol", "stats", *arguments, "--records", records, "--json"])
    created: dict[str, Any] = json.loads(capsys.readouterr().out)
    return created


def part(page: Page, name: str) -> Any:
    return page.locator(f"[data-part={name}]")


def choose(page: Page, label: str, option: str) -> None:
    """By keys alone: the list opens, the arrow goes down to the option, Enter takes it."""
    field = page.get_by_role("combobox", name=label)
    field.focus()
    field.press("Enter")
    wanted = page.get_by_role("option", name=option, exact=True)
    expect(wanted).to_be_visible()
    for _ in range(page.get_by_role("option").count()):
        if "q-manual-focusable--focused" in (wanted.get_attribute("class") or ""):
            break
        field.press("ArrowDown")
    field.press("Enter")


def shows_index(page: Page, name: str, result: dict[str, Any]) -> None:
    row = part(page, "capability").get_by_role("row").filter(has=page.get_by_text(name, exact=True))
    if result["interval"] is None:
        # Not given where the figures are not normal.
        expect(row).to_contain_text("–")
        return
    low, high = ("–" if bound is None else f"{bound:.2f}" for bound in result["interval"])
    value = "–" if result["value"] is None else f"{result['value']:.2f}"
    expect(row).to_contain_text(value if low == high == "–" else f"{value} [{low}, {high}]")


def shows_yields(page: Page, result: dict[str, Any]) -> None:
    for name in ("first_pass", "final"):
        share = result["yield"][name]
        low, high = share["interval"]
        shown = page.locator(f"[data-yield={name}]")
        expect(shown).to_contain_text(f"{100.0 * share['share']:.2f} %")
        expect(shown).to_contain_text(f"{100.0 * low:.2f} … {100.0 * high:.2f} %")


def test_it_shows_what_the_command_says(panel: Panel, new_page: NewPage, capsys: pytest.CaptureFixture[str]) -> None:
    later = [*motors(60, 2), ("P-FAR", {"stator_resistance": 12.0, "cogging_torque": 0.03})]
    records = keep(panel.records, ("A", "LG-400W", motors(40, 1)), ("B", "LG-400W", later))
    page = new_page()
    page.goto(panel.url)
    page.get_by_role("link", name="Statistics").click()

    # The latest batch, and the parameter that failed most.
    latest = reported(capsys, records, "B")
    shows_yields(page, latest)
    result = latest["parameters"]["stator_resistance"]
    for name in ("cp", "cpk", "pp", "ppk"):
        shows_index(page, name.capitalize(), result[name])
    expect(part(page, "failures")).to_contain_text("Stator resistance")
    expect(part(page, "chart")).to_contain_text("rule 1, a point beyond 4.")
    expect(part(page, "chart")).to_contain_text("P-FAR")
    for chart in ("Histogram of Stator resistance", "Control chart of Stator resistance", "Failures by parameter"):
        expect(page.get_by_role("img", name=chart).locator("canvas")).to_be_visible()

    choose(page, "Batch", "All batches")
    whole = reported(capsys, records)
    shows_yields(page, whole)
    shows_index(page, "Cpk", whole["parameters"]["stator_resistance"]["cpk"])
    choose(page, "Parameter", "Cogging torque, peak to peak")
    shows_index(page, "Cpk", whole["parameters"]["cogging_torque"]["cpk"])

    # The address holds the choice, the other language shows the same.
    page.get_by_role("button", name="中文").click()
    expect(part(page, "capability")).to_contain_text("过程能力")
    expect(page.get_by_text("一次合格", exact=True)).to_be_visible()
    shows_yields(page, whole)
    shows_index(page, "Cpk", whole["parameters"]["cogging_torque"]["cpk"])


def test_golden_motors_and_a_second_type(panel: Panel, new_page: NewPage, capsys: pytest.CaptureFixture[str]) -> None:
    drifting = [("GOLD", {"stator_resistance": 10.0 + 0.01 * n + 0.001 * (n % 2)}) for n in range(8)]
    records = keep(panel.records, ("A", "LG-400W", [*motors(30, 1), *drifting]), ("B", "other", motors(10, 2)))
    page = new_page()
    page.goto(f"{panel.url}/statistics")
    shows_yields(page, reported(capsys, records, "--model", "other"))
    choose(page, "Motor type", "LG-400W")
    choose(page, "Parameter", "Stator resistance")
    field = page.get_by_label("Golden motors (serial numbers)")
    field.fill("GOLD, NOBODY")
    field.press("Enter")
    result = reported(capsys, records, "A", "--golden", "GOLD")
    shows_yields(page, result)
    golden = part(page, "golden")
    for socket in "12":
        row = golden.get_by_role("row").filter(has_text="GOLD").filter(has_text=f"· {socket}")
        expect(row).to_contain_text("the station drifts")
    expect(golden).to_contain_text("There are no figures of: NOBODY")


def test_yields_by_group_and_the_golden_motors_that_the_records_know(
    panel: Panel, new_page: NewPage, capsys: pytest.CaptureFixture[str]
) -> None:
    steady = [("GOLD", {"stator_resistance": 10.0 + 0.001 * (n % 2)}) for n in range(6)]
    records = keep(panel.records, ("A", "LG-400W", [*motors(31, 1), *steady]), golden={"GOLD"})
    page = new_page()
    page.goto(f"{panel.url}/statistics?parameter=stator_resistance")
    for option, grouping in (("Station", "station"), ("Socket", "socket"), ("Plan", "plan")):
        choose(page, "Yield by …", option)
        expect(part(page, "yield-by").get_by_role("columnheader").first).to_have_text(option)
        groups = reported(capsys, records, "--by", grouping)["yield"]["by"][grouping]
        assert sum(group["final"]["count"] for group in groups) == 31, "golden motors are none of the line's"
        for group in groups:
            row = part(page, "yield-by").locator("tbody tr").filter(has_text=group["name"])
            for share in (group["first_pass"], group["final"]):
                expect(row).to_contain_text(f"{100.0 * share['share']:.2f}")
    page.reload()
    expect(part(page, "yield-by").get_by_role("columnheader").first).to_have_text("Plan")
    rows = part(page, "golden").locator("tbody tr").filter(has_text="GOLD")
    expect(rows).to_have_count(2)
    expect(rows.nth(1).locator("td").nth(2)).to_have_text("3")


@pytest.mark.parametrize(
    ("content", "english", "chinese"),
    [
        (None, "There are no records at", "处尚无记录"),
        ("these are no records\n" * 100, "The records cannot be read", "无法读取记录"),
    ],
    ids=["none", "text"],
)
def test_records_that_cannot_be_read(
    panel: Panel, new_page: NewPage, content: str | None, english: str, chinese: str
) -> None:
    if content is not None:
        panel.records.write_text(content)
    says_why(new_page(), panel, english, chinese)
    assert panel.records.exists() == (content is not None)


def test_records_of_a_server_that_is_away(serve: Serve, new_page: NewPage) -> None:
    server = serve("--virtual", "--records", "postgresql://nobody@127.0.0.1:1/none")
    says_why(new_page(), server, "The records cannot be read", "无法读取记录")


def says_why(page: Page, server: Server, english: str, chinese: str) -> None:
    page.goto(f"{server.url}/statistics")
    expect(page.get_by_role("alert")).to_contain_text(english)
    page.get_by_role("button", name="中文").click()
    expect(page.get_by_role("alert")).to_contain_text(chinese)


def test_names_that_nothing_has(panel: Panel, new_page: NewPage) -> None:
    keep(panel.records, ("A", "LG-400W", motors(12, 1)))
    page = new_page()
    for asked, words in (
        ("batch=Z", "There is no batch Z."),
        ("model=Z", "There are no records of the type Z."),
        ("parameter=inertia", "There are no figures of inertia here."),
    ):
        page.goto(f"{panel.url}/statistics?{asked}")
        expect(page.get_by_role("alert")).to_have_text(words)
    choose(page, "Parameter", "Stator resistance")
    expect(part(page, "capability")).to_contain_text("Cpk")
    expect(page.get_by_role("alert")).to_have_text("")
