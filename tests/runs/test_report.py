"""The report of a whole run on the virtual bench, from the command line."""

import json
import re
from datetime import UTC, datetime
from html.parser import HTMLParser
from pathlib import Path

import pytest

from bench.journal.journal_file import read_journal
from bench.journal.run_folder import RunFolder
from bench.journal.signatures import Meaning, sign
from bench.journal.waveforms import read_waveform
from bench.plugins.catalogues import installed
from tests.command_line import Call
from tests.pdf import pages_of


class Words(HTMLParser):
    """A page's text, and the captions of its plots."""

    def __init__(self, content: str) -> None:
        super().__init__()
        self.text = ""
        self.plots: list[str] = []
        self.drawings: list[str] = []
        self.feed(content)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        if tag == "svg" and (given.get("aria-label") or "").startswith("Connections: "):
            self.drawings.append(given["aria-label"] or "")
        if given.get("class") == "plot":
            self.plots.append(given["aria-label"] or "")

    def handle_data(self, data: str) -> None:
        self.text += data.replace("\N{NO-BREAK SPACE}", " ")


@pytest.mark.slow
def test_from_the_demo_to_page_and_pdf(call: Call) -> None:
    code, out, _ = call("demo", "--language", "en", "--seed", "5")
    assert code == 0
    last = out.strip().splitlines()[-1]
    page = Path(last.removeprefix("Report: "))
    folder = page.parent
    assert page.name == "report-en.html"
    seen = Words(page.read_text(encoding="utf-8"))
    ended = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    done = {name: kind for name, kind in installed().procedures.items() if name in ended["procedures"]}
    measurements = [name for name, kind in installed().procedures.items() if kind.in_all()]
    assert len(done) == len(measurements) - 1, "all but the six-step drive's"
    for name, kind in done.items():
        for step in kind.steps():
            assert step.identifier in seen.text, f"{name}: {step.identifier}"
        for parameter in ended["procedures"][name]["parameters"].values():
            assert parameter["estimator"] in seen.text
    assert len(seen.plots) >= 9
    # Every connection that something was read with, once for all exchanges of its terminals.
    assert any("A (white) → LCR meter, high; B (green) → LCR meter, low" in drawn for drawn in seen.drawings)
    assert any("the artificial star point" in drawn for drawn in seen.drawings)
    assert "2 more with the terminals exchanged" in seen.text
    end = read_journal(folder / "journal.jsonl")
    assert f"motorbench results verify {folder.name} --sha256 {end.last_hash}" in seen.text

    # Drawn beside the run or afterwards: the same page, to the last letter.
    assert call("report", folder.name, "--language", "en", "--format", "html", "--output", "again")[0] == 0
    assert Path("again/report-en.html").read_bytes() == page.read_bytes()

    sign(RunFolder(folder), "J. Doe", "engineer", "released", datetime(2026, 11, 21, 12, tzinfo=UTC), Meaning.APPROVED)
    code, out, _ = call("report", "latest", "--language", "both", "--json")
    files = json.loads(out)["report"]
    assert (code, set(files)) == (0, {"html", "pdf"})
    said = "".join("".join(p.extract_text().split()) for p in pages_of(Path(files["pdf"]).read_bytes()))
    said = said.replace("\u200b", "")
    for kind in done.values():
        assert all(step.identifier in said for step in kind.steps())
    assert "电机参数测量报告" in said
    # The drawings' words are letters of the paper too, in both languages.
    assert "shaftlocked轴已锁定" in said
    assert end.last_hash in said
    assert "J.Doeengineer工程师2026-11-2112:00:00UTCIapprovetheresult" in said
    assert "我批准该结果released" in said

    # A report changes nothing of what it is proven by.
    assert call("results", "verify", folder.name, "--sha256", end.last_hash)[0] == 0


def test_the_report_names_the_motor_by_the_number_that_was_typed(call: Call, tmp_path: Path) -> None:
    typed = ("--serial-number", "SN-0815", "--runs", str(tmp_path))
    assert call("run", "nameplate", "--station", "virtual", "--motor", "lg-400w", *typed)[0] == 0
    assert call("report", "latest", "--runs", str(tmp_path), "--language", "en")[0] == 0
    page = next(tmp_path.glob("*/report-*.html"))
    assert "SN-0815" in Words(page.read_text(encoding="utf-8")).text
    assert "SN-0815" in "".join(one.extract_text() for one in pages_of(page.with_suffix(".pdf").read_bytes()))


def test_fits_in_the_findings_are_those_of_the_stored_records(motorbench, tmp_path: Path) -> None:
    status, given = motorbench("run", "dq-inductance-time-constant", "--station", "virtual", "--motor", "ipmsm")
    assert status == 0
    (folder,) = (tmp_path / "runs").iterdir()
    taken = [event.data for event in read_journal(folder / "journal.jsonl").events if event.kind == "waveforms"]
    fit = given["procedures"]["dq-inductance-time-constant"]["findings"]["q"]["fit"]
    reference = taken[-1]["value"]["4"]["waveform"]
    wave = read_waveform(folder / reference.rpartition("#")[0], reference)
    recorded = dict(zip(wave.time.tolist(), wave.values.tolist(), strict=True))
    assert len(fit["time"]) == 300
    for time, fitted, residual in zip(fit["time"], fit["fitted"], fit["residual"], strict=True):
        assert fitted + residual == pytest.approx(recorded[time], abs=1e-9)


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (("nowhere",), 2, "no run was found here"),
        (("latest",), 2, "no run was found"),
        (("x", "--format", "docx"), 2, "--format docx: allowed are html, pdf, both"),
        (("x", "--language", "de"), 2, "--language de: allowed are en, zh, both, auto"),
    ],
)
def test_wrong_use(arguments: tuple[str, ...], code: int, said: str, call: Call) -> None:
    got, out, err = call("report", *arguments)
    assert (got, out) == (code, "")
    assert re.search(said, err)
