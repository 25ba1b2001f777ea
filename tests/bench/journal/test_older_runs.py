"""Runs of before the journal had a schema: they are opened, shown, proved, gone on with and reported as ever."""

import gzip
import io
import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from rich.console import Console

from bench.i18n.errors import InputError
from bench.journal.finished_run import read_run
from bench.journal.journal_file import read_journal
from bench.journal.overview import overview
from bench.journal.run_folder import RunFolder
from bench.journal.run_view import view_of
from bench.journal.verification import Integrity
from bench.journal.verify import verify
from bench.motor.motor_file import load_motor
from bench.report.evidence import record_of
from bench.run.request import RunRequest
from bench.run.resume import begun, left_unsafe
from bench.run.run import run
from procedures.catalogue import catalogue

RUNS = Path(__file__).parents[2] / "data" / "runs"
#: Status and verdict of each.
KNOWN = {
    "demo": ("completed", Integrity.CHANGED),
    "typed": ("completed", Integrity.UNTOUCHED),
    "failed": ("failed", Integrity.UNTOUCHED),
    "aborted": ("aborted", Integrity.UNTOUCHED),
    "faulty": ("completed", Integrity.UNTOUCHED),
    "guarded": ("completed", Integrity.UNTOUCHED),
    "killed": ("interrupted", Integrity.UNFINISHED),
    "line": ("completed", Integrity.UNFINISHED),
}

Kept = Callable[[str], RunFolder]


@pytest.fixture
def kept(tmp_path: Path) -> Kept:
    """Return what gives a copy of a kept run."""

    def copy(name: str) -> RunFolder:
        shutil.copytree(RUNS / name, tmp_path / name)
        for packed in (tmp_path / name).glob("*.gz"):
            packed.with_suffix("").write_bytes(gzip.decompress(packed.read_bytes()))
        return RunFolder(tmp_path / name)

    return copy


@pytest.mark.parametrize("name", KNOWN)
def test_it_is_opened_shown_and_proved(kept: Kept, name: str) -> None:
    folder = kept(name)
    status, verdict = KNOWN[name]
    journal = read_journal(folder.journal)
    view = view_of(journal.events)
    assert (view.status, overview(folder).status) == (status, status)
    found = verify(folder)
    assert found.verdict is verdict, found
    # The demo was kept without its waveforms, and nothing else is missed.
    assert all(finding.file.startswith("waveforms/") for finding in found.findings)
    if folder.result.exists():
        stored = json.loads(folder.result.read_bytes())
        assert stored["parameters"].keys() == view.parameters().parameters.keys()
        assert len(stored["warnings"]) == len(view.warnings())


@pytest.mark.parametrize("name", KNOWN)
def test_it_is_reported(kept: Kept, name: str) -> None:
    folder = kept(name)
    made = record_of(read_run(str(folder.path), folder.path))
    assert made.status == KNOWN[name][0]
    assert [procedure.name for procedure in made.procedures]
    assert any(step.readings for procedure in made.procedures for step in procedure.steps)


def test_its_warnings_are_there(kept: Kept) -> None:
    view = view_of(read_journal(kept("demo").journal).events)
    assert "E9" in {notice.identifier for _, notice in view.warnings()}


def test_what_was_left_on_is_known(kept: Kept) -> None:
    unsafe = {name for name in KNOWN if left_unsafe(read_journal(kept(name).journal).events)}
    assert unsafe == {"killed"}


def test_it_is_gone_on_with_by_the_software_that_made_it_alone(kept: Kept, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = kept("failed")
    read, begin = begun(folder)
    for name, content in (("station", begin.station_file), ("motor", begin.motor_file)):
        (folder.path / f"{name}.toml").write_text(content, encoding="utf-8")
    answers = folder.path / "answers.toml"
    answers.write_text(
        '[readings]\nwinding_temperature = 25.0\n"lcr_meter.resistance" = [0.0322, 0.0317, 0.0321]\n', encoding="utf-8"
    )
    request = RunRequest(
        procedures=begin.procedures,
        motor=load_motor(str(folder.path / "motor.toml")),
        station=str(folder.path / "station.toml"),
        language=begin.language,
        runs=folder.path,
        operator="answers",
        answers=answers,
        assignments=begin.settings,
        resume=folder,
    )
    console = Console(file=io.StringIO())
    with pytest.raises(InputError, match="the software is not the one this run began with"):
        run(request, catalogue(), console)
    assert read_journal(folder.journal) == read
    monkeypatch.setattr("bench.run.run.software", lambda _: dict(begin.software))
    done = run(request, catalogue(), console)
    assert (done.view.status, done.view.sessions) == ("completed", 2)
    assert done.view.parameters().parameters["stator_resistance"].value == pytest.approx(0.016, abs=1e-4)
    assert verify(folder).verdict is Integrity.UNTOUCHED
