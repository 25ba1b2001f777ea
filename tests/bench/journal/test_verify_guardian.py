"""The guardian's record is held by the run's journal, and closed by a guardian that outlives its run: whatever is changed is found."""

import hashlib
import json
import os
import shutil
import signal
import threading
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bench.cli.main import main
from bench.journal.events.safety import RecordEnd
from bench.journal.guardian_record import GuardianRecord, journal_head
from bench.journal.journal import Journal
from bench.journal.journal_file import last_whole_line, read_journal
from bench.journal.run_folder import RunFolder
from bench.journal.verification import Integrity, Verification
from bench.journal.verify import verify
from tests.journals import event
from tests.studies.energised.held import Run, Served

GUARDIAN = "guardian.jsonl"


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    made = Served(tmp_path_factory.mktemp("served"))
    yield made
    made.end()


def left(run: Run) -> None:
    """Wait until the guardian has left and its process is gone."""
    run.guardian_left()
    pause = threading.Event()
    for _ in range(1000):
        if not (run.folder / GUARDIAN).read_bytes().endswith(b"\0"):
            return
        pause.wait(0.01)
    raise AssertionError("the guardian has not closed its record")


def ended_by(served: Served, runs: Path, end: Callable[[Run], None]) -> Path:
    run = Run(served, runs, "wait")
    try:
        end(run)
        assert served.seconds_until_off() < 30.0
    finally:
        run.drop()
    return run.folder


def asked_to_stop(run: Run) -> None:
    run.signal(signal.SIGTERM)
    assert run.ended()["status"] == "aborted"


def killed(run: Run) -> None:
    run.signal(signal.SIGKILL)
    left(run)


@pytest.fixture(scope="module")
def stopped_run(served: Served, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with a guardian that came to an end of its own."""
    return ended_by(served, tmp_path_factory.mktemp("stopped"), asked_to_stop)


@pytest.fixture(scope="module")
def killed_run(served: Served, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that was killed while everything was on; its guardian has switched it off and left."""
    return ended_by(served, tmp_path_factory.mktemp("killed"), killed)


@pytest.fixture(scope="module")
def virtual_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with waveforms, without a guardian."""
    runs = tmp_path_factory.mktemp("virtual")
    with pytest.raises(SystemExit) as stop:
        main(["run", "pole-pairs-back-emf", "--station", "virtual", "--motor", "lg-400w", "--runs", str(runs)])
    assert stop.value.code == 0
    (folder,) = runs.iterdir()
    return folder


def copy(folder: Path, to: Path) -> RunFolder:
    return RunFolder(Path(shutil.copytree(folder, to / "copy")))


@pytest.fixture
def stopped(stopped_run: Path, tmp_path: Path) -> RunFolder:
    return copy(stopped_run, tmp_path / "stopped")


@pytest.fixture
def cut_off(killed_run: Path, tmp_path: Path) -> RunFolder:
    return copy(killed_run, tmp_path / "killed")


def lines_of(run: RunFolder) -> list[bytes]:
    return (run.path / GUARDIAN).read_bytes().splitlines(keepends=True)


def edited(run: RunFolder, edit: Callable[[list[bytes]], Any]) -> Verification:
    lines = lines_of(run)
    edit(lines)
    (run.path / GUARDIAN).write_bytes(b"".join(lines))
    return verify(run)


def test_a_run_with_a_guardian_is_untouched_and_its_journal_holds_the_guardians_record(stopped: RunFolder) -> None:
    found = verify(stopped)
    assert (found.verdict, found.findings, found.unproven) == (Integrity.UNTOUCHED, [], "")
    journal = [json.loads(line) for line in stopped.journal.read_bytes().splitlines()]
    record = [json.loads(line) for line in lines_of(stopped)]
    assert journal[0]["data"]["guardian"]["token"] == record[0]["data"]["token"]
    (begun,) = (event["data"]["record"] for event in journal if event["kind"] == "guardian_ready")
    assert begun["events"] == 2
    end = journal[-1]["data"]["guardian"]
    assert (journal[-1]["kind"], end["closed"], end["record"]["events"]) == ("run_finished", True, len(record))
    assert record[-1]["kind"] == "left"


def change_one(lines: list[bytes], index: int) -> None:
    event = json.loads(lines[index])
    event["time"] += 1.0
    lines[index] = json.dumps(event, ensure_ascii=False, separators=(",", ":")).encode() + b"\n"


@pytest.mark.parametrize("ended", ["stopped", "cut_off"])
@pytest.mark.parametrize(
    ("edit", "line", "said"),
    [
        (lambda lines: lines.pop(0), 1, "event 1 was removed"),
        (lambda lines: change_one(lines, 0), 1, "was changed"),
        (lambda lines: change_one(lines, 1), 2, "was changed"),
        (lambda lines: change_one(lines, -1), 0, "was changed"),
        (lambda lines: lines.insert(0, lines.pop(1)), 1, "the order of the lines was changed"),
        (lambda lines: lines.insert(1, lines[0]), 1, "was inserted"),
        (lambda lines: lines.append(lines[0]), 0, "was inserted"),
        (lambda lines: lines.append(b"more"), 0, "follow the event that closed"),
        (lambda lines: lines.append(b"{}\n"), 0, "is not an event"),
        (lambda lines: lines.__delitem__(slice(1, None)), 2, "the record's end was changed or removed"),
        (lambda lines: lines.clear(), 1, "the record's end was changed or removed"),
    ],
)
def test_what_was_changed_in_the_guardians_record_is_named(
    request: pytest.FixtureRequest, ended: str, edit: Callable[[list[bytes]], Any], line: int, said: str
) -> None:
    run = request.getfixturevalue(ended)
    found = edited(run, edit)
    assert found.verdict is Integrity.CHANGED
    (finding,) = (each for each in found.findings if each.file == GUARDIAN)
    assert said in str(finding.what)
    assert line in (0, finding.line)


def test_a_guardians_record_that_is_gone_is_missed(stopped: RunFolder, cut_off: RunFolder) -> None:
    for run in (stopped, cut_off):
        (run.path / GUARDIAN).unlink()
        (finding,) = verify(run).findings
        assert (finding.file, finding.line) == (GUARDIAN, 0)
        assert "is missing; event" in str(finding.what)


def test_an_end_that_was_cut_from_the_guardians_record_is_missed(stopped: RunFolder, cut_off: RunFolder) -> None:
    count = len(lines_of(stopped))
    found = edited(stopped, lambda lines: lines.pop())
    assert (found.verdict, found.findings[0].line) == (Integrity.CHANGED, count)
    count = len(lines_of(cut_off))
    found = edited(cut_off, lambda lines: lines.pop())
    assert found.verdict is Integrity.UNFINISHED
    assert f"{GUARDIAN} is not closed after its line {count - 1}" in found.unproven
    (cut_off.path / GUARDIAN).write_bytes(b"".join(lines_of(cut_off))[:-5])
    assert "bytes at the end of guardian.jsonl are not a complete event" in verify(cut_off).unproven


def test_another_runs_record_in_its_place_is_told(stopped: RunFolder, killed_run: Path, stopped_run: Path) -> None:
    shutil.copy(killed_run / GUARDIAN, stopped.path / GUARDIAN)
    found = verify(stopped)
    assert found.verdict is Integrity.CHANGED
    assert "the whole record is another run's" in str(found.findings[0].what)


def test_a_killed_run_is_unfinished_and_its_guardian_vouches_for_the_journals_end(cut_off: RunFolder) -> None:
    found = verify(cut_off)
    assert (found.verdict, found.findings) == (Integrity.UNFINISHED, [])
    assert found.unproven == "the journal has no end: the run was cut off or still goes on, or its end was taken away"
    whole = cut_off.journal.read_bytes()
    lines = whole.splitlines(keepends=True)
    change_one(lines, -1)
    cut_off.journal.write_bytes(b"".join(lines))
    (finding,) = verify(cut_off).findings
    assert (finding.file, finding.line) == ("journal.jsonl", len(lines))
    cut_off.journal.write_bytes(b"".join(lines[:-1]))
    (finding,) = verify(cut_off).findings
    assert (finding.file, finding.line) == ("journal.jsonl", len(lines))
    assert "the journal's end was removed" in str(finding.what)


def test_a_run_that_died_before_its_guardian_was_ready_says_what_it_knows(cut_off: RunFolder) -> None:
    first = cut_off.journal.read_bytes().splitlines(keepends=True)[0]
    cut_off.journal.write_bytes(first)
    (cut_off.path / GUARDIAN).unlink()
    found = verify(cut_off)
    assert (found.verdict, found.findings) == (Integrity.UNFINISHED, [])
    assert "event 1 of the journal says that a guardian was started" in found.unproven


def test_a_guardian_that_was_killed_has_not_closed_its_record(served: Served, tmp_path: Path) -> None:
    def guardian_killed(run: Run) -> None:
        os.kill(run.guardian_pid, signal.SIGKILL)
        assert run.ended()["status"] == "aborted"

    run = RunFolder(ended_by(served, tmp_path, guardian_killed))
    found = verify(run)
    assert (found.verdict, found.findings) == (Integrity.UNFINISHED, [])
    assert "is not closed after its line 2: the guardian is still running, was terminated itself" in found.unproven


def test_a_guardian_of_a_session_that_the_journal_never_began_is_told(stopped: RunFolder) -> None:
    record = GuardianRecord(stopped.path)
    record.record(event("started", token="f" * 32))
    record.record(event("left", journal=None))
    record.close()
    found = verify(stopped)
    assert (found.verdict, found.findings) == (Integrity.UNFINISHED, [])
    assert "the journal has no session for this guardian" in found.unproven


def rewritten(run: RunFolder, change: Callable[[dict[str, Any]], Any]) -> None:
    """Write a journal anew with its chain, and the result's hash with it, as a former version would have."""
    previous, made = "", []
    for line in run.journal.read_bytes().splitlines():
        event = json.loads(line)
        if event["kind"] == "guardian_ready":
            continue
        change(event)
        event["n"], event["previous"] = len(made) + 1, previous
        made.append(json.dumps(event, ensure_ascii=False, separators=(",", ":")).encode())
        previous = hashlib.sha256(made[-1]).hexdigest()
    run.journal.write_bytes(b"".join(line + b"\n" for line in made))
    result = json.loads(run.result.read_bytes())
    result["journal"] = {"events": len(made), "sha256": previous}
    run.write_result(result)


def test_a_run_of_a_former_version_is_read_and_what_cannot_be_proved_is_said(stopped: RunFolder) -> None:
    rewritten(stopped, lambda event: event["data"].pop("guardian", None))
    (stopped.path / GUARDIAN).unlink()
    former = GuardianRecord(stopped.path)
    for kind in ("started", "ready", "left"):
        former.record(event(kind, pid=1))
    former.close()
    found = verify(stopped)
    assert (found.verdict, found.findings) == (Integrity.UNFINISHED, [])
    assert "a version that stored no hash of guardian.jsonl in the journal: its lines follow" in found.unproven
    (stopped.path / GUARDIAN).unlink()
    found = verify(stopped)
    assert (found.verdict, found.findings) == (Integrity.UNFINISHED, [])
    assert "whether the file existed cannot be verified" in found.unproven


def test_a_virtual_run_of_a_former_version_had_no_guardian_and_is_untouched(virtual_run: Path, tmp_path: Path) -> None:
    run = copy(virtual_run, tmp_path)
    rewritten(run, lambda event: event["data"].pop("guardian", None))
    assert verify(run).verdict is Integrity.UNTOUCHED


def guardian_of(folder: Path, token: str) -> tuple[GuardianRecord, RecordEnd]:
    """Begin a guardian's record as a guardian does; with what it says when it is ready."""
    record = GuardianRecord(folder)
    record.record(event("started", pid=1, token=token))
    record.record(event("ready"))
    return record, record.head


def test_a_killed_run_that_was_resumed_and_ended_is_proved_whole(tmp_path: Path) -> None:
    run = RunFolder(tmp_path / "runs" / "one")
    run.path.mkdir(parents=True)
    about = {"token": "a" * 32}
    journal = Journal(run.journal, lambda: 0.0)
    journal.record(event("run_started", guardian=about))
    first, head = guardian_of(run.path, "a" * 32)
    journal.record(event("guardian_ready", record=asdict(head)))
    journal.record(event("energising"))
    journal.close()
    first.record(event("took", cause="the run's process has died"))
    first.record(event("left", journal=asdict(journal_head(run.path, durable=True))))
    assert first.close()
    again = Journal(run.journal, lambda: 0.0, previous=read_journal(run.journal))
    again.record(event("run_resumed", guardian={"token": "b" * 32}))
    second, head = guardian_of(run.path, "b" * 32)
    again.record(event("guardian_ready", record=asdict(head)))
    second.record(event("left", journal=asdict(journal_head(run.path, durable=False))))
    assert second.close()
    again.record(event("run_finished", guardian={"record": asdict(second.head), "closed": True}))
    again.close()
    noted = again.last_hash
    found = verify(run, noted)
    assert (found.verdict, found.findings, found.unproven) == (Integrity.UNTOUCHED, [], "")
    count = len(lines_of(run))
    assert count == 7
    whole = (run.path / GUARDIAN).read_bytes()
    for kept in range(count):
        (run.path / GUARDIAN).write_bytes(b"".join(whole.splitlines(keepends=True)[:kept]))
        assert verify(run, noted).verdict is Integrity.CHANGED, kept
    for gone in range(count):
        lines = whole.splitlines(keepends=True)
        del lines[gone]
        (run.path / GUARDIAN).write_bytes(b"".join(lines))
        assert verify(run, noted).verdict is Integrity.CHANGED, gone


def test_a_journals_last_whole_line_is_found_however_long_it_is(tmp_path: Path) -> None:
    path = tmp_path / "journal.jsonl"
    path.write_bytes(b"")
    assert last_whole_line(path) is None
    journal = Journal(path, lambda: 0.0, previous=read_journal(path))
    for length in (1, 300_000, 5):
        journal.record(event("traffic", content="x" * length))
        line = last_whole_line(path)
        assert line is not None
        assert (line.sha256, line.place) == (journal.last_hash, len(read_journal(path).events))
    journal.close()
    with path.open("ab") as file:
        file.write(b'{"n": 4, "wa')
    line = last_whole_line(path)
    assert line is not None
    assert line.place == 3


# whatever is done to one of the files


def flip(content: bytes, at: int, by: int) -> bytes:
    at %= len(content)
    return content[:at] + bytes([(content[at] + by) % 256]) + content[at + 1 :]


def cut_out(content: bytes, at: int, by: int) -> bytes:
    at %= len(content)
    return content[:at] + content[at + by :]


def put_in(content: bytes, at: int, by: int) -> bytes:
    at %= len(content) + 1
    return content[:at] + bytes([by % 256]) * (1 + by % 7) + content[at:]


def end_early(content: bytes, at: int, _by: int) -> bytes:
    return content[: at % len(content)]


def by_lines(edit: Callable[[list[bytes], int, int], Any]) -> Callable[[bytes, int, int], bytes]:
    def change(content: bytes, at: int, by: int) -> bytes:
        lines = content.splitlines(keepends=True)
        edit(lines, at % len(lines), (at + by) % len(lines))
        return b"".join(lines)

    return change


def swap(lines: list[bytes], one: int, other: int) -> None:
    lines[one], lines[other] = lines[other], lines[one]


TAMPERINGS: tuple[Callable[[bytes, int, int], bytes], ...] = (
    flip,
    cut_out,
    put_in,
    end_early,
    by_lines(swap),
    by_lines(lambda lines, one, _: lines.pop(one)),
    by_lines(lambda lines, one, other: lines.insert(other, lines[one])),
    by_lines(lambda lines, one, _: lines.__delitem__(slice(one, None))),
    by_lines(lambda lines, one, _: lines.append(lines[one])),
)


def outcome(run: RunFolder) -> tuple[Integrity, list[str], str]:
    found = verify(run)
    return found.verdict, [str(finding) for finding in found.findings], found.unproven


@pytest.mark.parametrize("ended", ["stopped_run", "killed_run", "virtual_run"])
@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)
@given(
    file=st.integers(0, 50),
    tamper=st.sampled_from(TAMPERINGS),
    at=st.integers(0, 10**6),
    by=st.integers(1, 255),
)
def test_any_single_change_of_any_file_is_found(
    request: pytest.FixtureRequest,
    ended: str,
    file: int,
    tamper: Callable[[bytes, int, int], bytes],
    at: int,
    by: int,
) -> None:
    folder: Path = request.getfixturevalue(ended)
    run = RunFolder(folder)
    names = ["journal.jsonl", "journal.jsonl", GUARDIAN, GUARDIAN, "result.json"]
    files = [folder / name for name in names if (folder / name).exists()] + sorted(run.waveforms.glob("*.h5"))
    path = files[file % len(files)]
    before = path.read_bytes()
    after = tamper(before, at, by)
    if after == before:
        return
    untouched = outcome(run)
    assert untouched[0] is (Integrity.UNFINISHED if ended == "killed_run" else Integrity.UNTOUCHED)
    try:
        path.write_bytes(after)
        found = outcome(run)
    finally:
        path.write_bytes(before)
    assert found[0] is not Integrity.UNTOUCHED
    assert found != untouched


@pytest.mark.parametrize("ended", ["stopped_run", "killed_run", "virtual_run"])
def test_any_file_that_is_gone_is_missed(request: pytest.FixtureRequest, ended: str, tmp_path: Path) -> None:
    folder: Path = request.getfixturevalue(ended)
    untouched = outcome(RunFolder(folder))
    covered = [folder / name for name in (GUARDIAN, "result.json") if (folder / name).exists()]
    covered += sorted((folder / "waveforms").glob("*.h5"))
    assert covered
    for number, path in enumerate(covered):
        run = copy(folder, tmp_path / str(number))
        (run.path / path.relative_to(folder)).unlink()
        found = outcome(run)
        assert found[0] is not Integrity.UNTOUCHED, path
        assert found != untouched, path
