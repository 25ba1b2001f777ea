"""A finished run is proven untouched, and whatever is changed in it is named."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from bench.cli.main import main
from bench.journal.guardian_record import GuardianRecord
from bench.journal.run_folder import RunFolder
from bench.journal.verification import Integrity, Verification
from bench.journal.verify import verify
from tests.journals import event


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with waveforms on the virtual bench."""
    runs = tmp_path_factory.mktemp("runs")
    with pytest.raises(SystemExit) as stop:
        main(["run", "pole-pairs-back-emf", "--station", "virtual", "--motor", "lg-400w", "--runs", str(runs)])
    assert stop.value.code == 0
    (folder,) = runs.iterdir()
    return folder


@pytest.fixture
def run(finished: Path, tmp_path: Path) -> RunFolder:
    return RunFolder(Path(shutil.copytree(finished, tmp_path / "run")))


FAILS = """
from procedures.core.procedure import Procedure
from procedures.core.settings import Settings
from procedures.core.steps import step


class Fails(Procedure[Settings]):
    '''Fails.'''

    name, title, section, roles, gives = "acme-fails", "It fails", "acme", frozenset(), ()

    def measure(self):
        self.fail()

    @step("acme/1", "Fail")
    def fail(self):
        raise ZeroDivisionError("division by zero")
"""
Edit = Callable[[list[bytes]], Any]


def edited(run: RunFolder, edit: Edit) -> Verification:
    lines = run.journal.read_bytes().splitlines(keepends=True)
    edit(lines)
    run.journal.write_bytes(b"".join(lines))
    return verify(run)


def test_a_finished_run_is_untouched(run: RunFolder) -> None:
    found = verify(run)
    assert (found.verdict, found.findings, found.unproven) == (Integrity.UNTOUCHED, [], "")
    assert found.events == len(run.journal.read_bytes().splitlines())
    assert found.waveforms >= 1
    assert json.loads(run.result.read_bytes())["journal"] == {"events": found.events, "sha256": found.last_hash}
    assert verify(run, found.last_hash.upper()).verdict is Integrity.UNTOUCHED
    assert "the hash noted was" in str(verify(run, "00").findings[0])


def change(lines: list[bytes], index: int) -> None:
    event = json.loads(lines[index])
    event["time"] += 1.0
    lines[index] = json.dumps(event, ensure_ascii=False, separators=(",", ":")).encode() + b"\n"


@pytest.mark.parametrize("place", [1, 2, 20, -2, -1])
def test_a_changed_line_is_named(run: RunFolder, place: int) -> None:
    count = len(run.journal.read_bytes().splitlines())
    found = edited(run, lambda lines: change(lines, place - 1 if place > 0 else place))
    assert found.verdict is Integrity.CHANGED
    assert (found.findings[0].file, found.findings[0].line) == (
        "journal.jsonl",
        place if place > 0 else count + place + 1,
    )
    assert "was changed" in str(found.findings[0].what)


@pytest.mark.parametrize(
    ("edit", "line", "said"),
    [
        (lambda lines: lines.pop(9), 10, "event 10 was removed"),
        (lambda lines: lines.__delitem__(slice(9, 12)), 10, "events 10 to 12 were removed"),
        (lambda lines: lines.insert(9, lines.pop(10)), 10, "the order of the lines was changed"),
        (lambda lines: lines.insert(20, lines[9]), 21, "was inserted"),
        (lambda lines: lines.insert(10, lines[9]), 10, "was inserted"),
        (lambda lines: lines.insert(9, b"{}\n"), 10, "is not an event"),
        (lambda lines: lines.__delitem__(slice(0, 3)), 1, "events 1 to 3 were removed"),
        (lambda lines: lines.__setitem__(4, lines[4][:-9] + b"\n"), 5, "is not an event"),
    ],
)
def test_lines_that_were_removed_put_in_or_moved_are_named(run: RunFolder, edit: Edit, line: int, said: str) -> None:
    found = edited(run, edit)
    assert found.verdict is Integrity.CHANGED
    assert found.findings[0].line == line
    assert said in str(found.findings[0].what)


@pytest.mark.parametrize("removed", [1, 5])
def test_an_end_that_was_taken_away_is_noticed(run: RunFolder, removed: int) -> None:
    count = len(run.journal.read_bytes().splitlines())
    found = edited(run, lambda lines: lines.__delitem__(slice(-removed, None)))
    assert found.verdict is Integrity.CHANGED
    assert found.findings[0].line == count - removed + 1
    assert "end was changed or removed" in str(found.findings[0].what)


def test_a_run_that_was_cut_off_is_not_proven(run: RunFolder) -> None:
    run.result.unlink()
    found = verify(run)
    assert (found.verdict, found.findings) == (Integrity.UNFINISHED, [])
    assert "result.json is missing" in found.unproven
    assert verify(run, found.last_hash).verdict is Integrity.UNTOUCHED
    found = edited(run, lambda lines: lines.pop())
    assert "has no end" in found.unproven
    run.journal.write_bytes(run.journal.read_bytes()[:-10])
    found = verify(run)
    assert (found.verdict, found.findings) == (Integrity.UNFINISHED, [])
    assert "not a complete event" in found.unproven


def test_a_waveform_that_was_changed_or_is_gone_is_named(run: RunFolder) -> None:
    path = sorted(run.waveforms.iterdir())[0]
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    (finding,) = verify(run).findings
    assert finding.file == f"waveforms/{path.name}"
    assert "was changed" in str(finding.what)
    path.unlink()
    (finding,) = verify(run).findings
    assert "is missing" in str(finding.what)


def test_a_guardians_record_that_the_journal_knows_nothing_of_is_named(run: RunFolder) -> None:
    record = GuardianRecord(run.path)
    record.record(event("started", pid=1))
    record.close()
    (finding,) = verify(run).findings
    assert (finding.file, finding.line) == ("guardian.jsonl", 1)
    assert "no guardian of this run begins there" in str(finding.what)


def test_a_result_that_was_written_in_another_form_is_named(run: RunFolder) -> None:
    run.result.write_bytes(run.result.read_bytes() + b"\n")
    (finding,) = verify(run).findings
    assert "was rewritten: its content is the same" in str(finding.what)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda result: result["parameters"]["pole_pairs"].update(value=5), "parameters.pole_pairs.value differ"),
        (lambda result: result.update(status="failed"), "status differ"),
        (lambda result: result["warnings"].append({}), "warnings differ"),
        (lambda result: result.pop("motor"), "motor differ"),
        (lambda result: result.pop("journal"), "is not a result as a run writes it"),
        (lambda result: result["journal"].update(events=True), "is not a result as a run writes it"),
        (lambda result: result["journal"].update(events=4), "the hash it holds of event 4 is not"),
    ],
)
def test_a_result_that_was_changed_is_named(run: RunFolder, change: Callable[[dict[str, Any]], Any], said: str) -> None:
    result = json.loads(run.result.read_bytes())
    change(result)
    run.result.write_text(json.dumps(result), encoding="utf-8")
    found = verify(run)
    assert found.verdict is Integrity.CHANGED
    assert found.findings[0].file == "result.json"
    assert said in str(found.findings[0].what)


def test_a_cause_in_the_words_of_a_plug_in_that_is_not_there_any_more_is_untouched(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    station = tmp_path / "station.toml"
    station.write_text(
        '[station]\nname = "bench"\n[plugins]\nfiles = ["acme_fails.py"]\n[instruments]\n', encoding="utf-8"
    )
    (tmp_path / "acme_fails.py").write_text(FAILS, encoding="utf-8")
    arguments = ["run", "acme-fails", "--station", str(station), "--motor", "lg-400w", "--runs", str(tmp_path / "runs")]
    monkeypatch.setattr("bench.i18n.language._TITLES", {})
    with pytest.raises(SystemExit) as stop:
        main([*arguments, "--operator", "terminal"])
    assert stop.value.code == 1
    (folder,) = (tmp_path / "runs").iterdir()
    run = RunFolder(folder)
    cause = json.loads(run.result.read_bytes())["cause"]
    assert "in procedure It fails from" in cause

    monkeypatch.setattr("bench.i18n.language._TITLES", {})
    assert verify(run).verdict is Integrity.UNTOUCHED
    run.result.write_text(run.result.read_text(encoding="utf-8").replace("It fails", "It works"), encoding="utf-8")
    assert "procedures.acme-fails.cause, cause differ" in str(verify(run).findings[0].what)


def test_the_command_says_it_and_its_status_tells(run: RunFolder, capsys: pytest.CaptureFixture[str]) -> None:
    def call(*arguments: str) -> tuple[int, str]:
        with pytest.raises(SystemExit) as stop:
            main(["results", *arguments])
        return int(str(stop.value.code)), capsys.readouterr().out

    name, runs = run.path.name, str(run.path.parent)
    code, out = call("verify", name, "--runs", runs)
    assert (code, out.splitlines()[0]) == (0, f"{run.path}: untouched")
    edited(run, lambda lines: change(lines, 6))
    code, out = call("verify", "latest", "--runs", runs, "--json")
    told = json.loads(out)
    assert (code, told["verdict"], told["findings"][0]["line"]) == (1, "changed", 7)
    code, out = call("verify", str(run.path))
    assert code == 1
    assert "journal.jsonl, line 7: was changed" in out
    code, out = call("list", "--runs", runs)
    assert out.split() == ["run", "completed", "LG-400W:", "Pole", "pairs", "by", "back-EMF"]
    assert json.loads(call("list", "--runs", runs, "--json")[1])["runs"][0]["status"] == "completed"
    assert "no runs" in call("list", "--runs", str(run.path))[1]
