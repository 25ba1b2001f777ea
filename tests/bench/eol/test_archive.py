"""A batch archived, removed, restored; and thinned out by a rule."""

import errno
import json
import tarfile
import tracemalloc
from collections.abc import Callable
from datetime import UTC, datetime, timedelta, tzinfo
from pathlib import Path

import pytest
from sqlalchemy import Engine

from bench.eol.archive.batch_archive import read_archive, write_archive
from bench.eol.archive.retention import load_rule
from bench.eol.line.batch_log import BatchLog
from bench.eol.store.batch_plans import BatchPlan, keep_plan, plans_of
from bench.eol.store.database import open_database
from bench.eol.store.records import Records
from bench.eol.verdict import Verdict
from bench.i18n.errors import FileError, InputError
from bench.journal.errors import RecordError
from bench.journal.removed import removed_files
from tests.bench.eol.motor_records import NOON, motor_record
from tests.command_line import called

Call = Callable[..., tuple[int, str, str]]
PLAN = BatchPlan("B1", "0" * 64, "1" * 64, "[plan]\n# 计划\n", "[nameplate]\n")


@pytest.fixture
def call(capsys: pytest.CaptureFixture[str], reference: str, tmp_path: Path) -> Call:
    def run(*arguments: str) -> tuple[int, str, str]:
        return called(capsys, "eol", *arguments, "--records", reference, "--runs", str(tmp_path / "runs"), "--json")

    return run


@pytest.fixture
def batches(records: Records, engine: Engine, tmp_path: Path) -> Path:
    """Records and runs of two batches; the folder of the runs."""
    runs = tmp_path / "runs"
    for number, batch in reversed(list(enumerate(("B1", "B1", "B1", "B2"), 1))):
        folder = runs / batch / "000" / f"{number:06d}-P"
        (folder / "waveforms").mkdir(parents=True)
        (folder / "journal.packed").write_bytes(bytes(range(256)) * number)
        (folder / "waveforms" / "0001-a.h5").write_bytes(b"samples")
        verdict = Verdict.FAIL if number == 2 else Verdict.PASS
        ended = datetime.now(UTC) - timedelta(days=3 * number)
        records.save(motor_record(number, batch=batch, run=str(folder), verdict=verdict, ended=ended))
    with engine.begin() as connection:
        keep_plan(connection, PLAN)
    return runs


def files_of(runs: Path) -> dict[str, bytes]:
    return {str(path.relative_to(runs)): path.read_bytes() for path in runs.rglob("*") if path.is_file()}


def test_a_batch_goes_into_a_file_and_comes_back(
    call: Call, batches: Path, records: Records, engine: Engine, tmp_path: Path
) -> None:
    before, files = [repr(record) for record in records.read("B1")], files_of(batches)
    out = tmp_path / "B1.tar.gz"
    code, said, _ = call("archive", "B1", "--output", str(out), "--remove", "all")
    assert (code, json.loads(said)["motors"], json.loads(said)["files"]) == (0, 3, 6)
    assert (records.batches(), list(batches.iterdir())) == (["B2"], [batches / "B2"])
    with engine.connect() as connection:
        assert plans_of(connection, "B1") == []
    code, said, _ = call("restore", str(out))
    assert (code, json.loads(said)["restored"]) == (0, 3)
    assert [repr(record) for record in records.read("B1")] == before
    assert files_of(batches) == files
    with engine.connect() as connection:
        assert plans_of(connection, "B1") == [PLAN]
    assert json.loads(call("restore", str(out))[1])["restored"] == 0
    assert call("archive", "B1", "--output", str(out))[0] == 2


def test_what_is_no_whole_archive_is_refused_and_restores_nothing(
    call: Call, batches: Path, records: Records, tmp_path: Path
) -> None:
    out = tmp_path / "B1.tar.gz"
    call("archive", "B1", "--output", str(out), "--remove", "all")
    content = out.read_bytes()
    changed = tmp_path / "changed.tar.gz"
    with tarfile.open(out, "r:gz") as old, tarfile.open(changed, "w:gz") as new:
        for member in old:
            file = old.extractfile(member)
            assert file is not None
            if member.name.endswith("000002-P/journal.packed"):
                file.read(1)
                member.size -= 1
            new.addfile(member, file)
    with pytest.raises(FileError, match="differ from the archived files"):
        read_archive(changed)
    for broken in (content[:-200], b"nothing", b""):
        (tmp_path / "broken").write_bytes(broken)
        assert call("restore", str(tmp_path / "broken"))[0] == 2
    assert records.batches() == ["B2"]
    assert call("archive", "B9", "--output", str(tmp_path / "x"))[0] == 1
    assert not (tmp_path / "x").exists()


def test_a_rule_thins_out_and_logs_it(call: Call, batches: Path, records: Records, tmp_path: Path) -> None:
    rule = tmp_path / "rule.toml"
    rule.write_text("[waveforms]\npassed = 2\n[runs]\npassed = 8\n")
    code, said, _ = call("retain", str(rule), "--dry-run")
    assert (code, json.loads(said)) == (
        0,
        {"runs": 2, "waveforms": 1, "size": 3 * 7 + 256 * 7, "held_back": 0, "removed": False},
    )
    before = files_of(batches)
    assert json.loads(call("retain", str(rule), "--person", "Wang")[1])["removed"]
    first = batches / "B1" / "000" / "000001-P"
    assert removed_files(first).keys() == {"waveforms/0001-a.h5"}
    left = files_of(batches)
    # The failed motor is kept for ever: no rule names it.
    assert set(before) - set(left) == {
        "B1/000/000001-P/waveforms/0001-a.h5",
        *(name for name in before if "000003-P" in name or "000004-P" in name),
    }
    log = [json.loads(line) for line in (batches / "retention.jsonl").read_text().splitlines()]
    assert [(entry["removed"], entry["number"], entry["person"]) for entry in log] == [
        ("runs", 4, "Wang"),
        ("runs", 3, "Wang"),
        ("waveforms", 1, "Wang"),
    ]
    assert records.count() == 4
    assert json.loads(call("retain", str(rule))[1])["runs"] == 0


def test_a_folder_of_runs_that_is_not_there_is_no_folder_without_old_runs(
    call: Call, batches: Path, tmp_path: Path
) -> None:
    rule = tmp_path / "rule.toml"
    rule.write_text("[runs]\npassed = 8\n")
    batches.rename(tmp_path / "elsewhere")
    code, said, _ = call("retain", str(rule))
    assert code == 2
    assert f"{batches}: there is no such folder of runs" in json.loads(said)["error"]
    assert not batches.exists()


def test_a_restoration_that_was_killed_is_done_again(call: Call, batches: Path, tmp_path: Path) -> None:
    files = files_of(batches)
    out = tmp_path / "B1.tar.gz"
    call("archive", "B1", "--output", str(out), "--remove", "all")
    torn = batches / "B1" / "000" / "000001-P" / ".journal.packed.part"
    torn.parent.mkdir(parents=True)
    torn.write_bytes(bytes(100))
    assert call("restore", str(out))[0] == 0
    assert files_of(batches) == files


def test_an_archive_is_not_overwritten_by_one_with_less(call: Call, batches: Path, tmp_path: Path) -> None:
    out = tmp_path / "B1.tar.gz"
    call("archive", "B1", "--output", str(out))
    (batches / "B1" / "000" / "000001-P" / "journal.packed").unlink()
    before = out.read_bytes()
    code, _, err = call("archive", "B1", "--output", str(out), "--force")
    assert (code, out.read_bytes()) == (1, before)
    assert "runs/B1/000/000001-P/journal.packed" in err
    assert call("archive", "B2", "--output", str(tmp_path / "B2.tar.gz"))[0] == 0
    assert call("archive", "B2", "--output", str(tmp_path / "B2.tar.gz"), "--force")[0] == 0


def test_a_batch_that_is_being_measured_is_not_removed(
    call: Call, batches: Path, records: Records, tmp_path: Path
) -> None:
    log = BatchLog(batches / "B1", {})
    code, _, err = call("archive", "B1", "--output", str(tmp_path / "x"), "--remove", "all")
    log.close()
    assert code == 1
    assert "another process is measuring this batch" in err
    assert records.count("B1") == 3


def test_runs_that_are_elsewhere_are_told_of(
    reference: str, batches: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    typed = ("eol", "archive", "B1", "--output", str(tmp_path / "x"), "--records", reference, "--runs", str(tmp_path))
    code, said, err = called(capsys, *typed)
    assert code == 0
    assert "files: 0" in said
    assert "motors whose run is not in" in err
    assert ": 3;" in err


def days_later(call: Call, monkeypatch: pytest.MonkeyPatch, rule: Path, days: float, *flags: str) -> tuple[int, int]:
    """Return how many runs are removed, and held back, where the clock shows so many days more than the last record's."""

    class Clock(datetime):
        @classmethod
        def now(cls, tz: tzinfo | None = None) -> datetime:
            return NOON + timedelta(days=days)

    monkeypatch.setattr("bench.cli.eol.retain.datetime", Clock)
    said = json.loads(call("retain", str(rule), *flags)[1])
    return said["runs"], said["held_back"]


@pytest.mark.parametrize("reference", ["sqlite"], indirect=True)
def test_a_clock_that_is_wrong_removes_hardly_too_early(
    call: Call, records: Records, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ages go by the line's own records, in the order in which they were kept."""
    rule = tmp_path / "rule.toml"
    rule.write_text("[runs]\nfailed = 20\n")

    def keep(number: int, day: float) -> None:
        folder = tmp_path / "runs" / "B1" / "000" / f"{number:06d}-P"
        folder.mkdir(parents=True)
        records.save(motor_record(number, run=str(folder), ended=NOON + timedelta(days=day)))

    for day in range(-18, 1):
        keep(day + 19, day)
    # The oldest is 18 days old.
    assert days_later(call, monkeypatch, rule, 0) == (0, 0)
    assert days_later(call, monkeypatch, rule, 29) == (3, 16), "a clock that is ahead by 29 days costs four"
    assert days_later(call, monkeypatch, rule, -5) == (0, 0)
    # The clock fell back to another millennium, and was put right: these are of day 0.
    keep(20, -9000.0)
    keep(21, 1)
    # It was ahead for a motor.
    keep(22, 400)
    keep(23, 2)
    assert days_later(call, monkeypatch, rule, 6, "--dry-run") == (2, 0)
    assert days_later(call, monkeypatch, rule, 6) == (2, 0)
    left = sorted((tmp_path / "runs" / "B1" / "000").iterdir())
    assert (left[0].name, left[-4].name) == ("000006-P", "000020-P")
    assert days_later(call, monkeypatch, rule, 60, "--clock-is-right") == (18, 0)


@pytest.mark.parametrize("every", [7, 30])
def test_a_line_that_works_seldom_keeps_runs_for_the_days_of_its_rule(
    call: Call, records: Records, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, every: int
) -> None:
    """A pause that is usual there counts whole; a wrong clock costs one such pause."""
    rule = tmp_path / "rule.toml"
    rule.write_text("[runs]\nfailed = 100\n")
    for number in range(1, 15):
        folder = tmp_path / "runs" / "B1" / "000" / f"{number:06d}-P"
        folder.mkdir(parents=True)
        records.save(motor_record(number, run=str(folder), ended=NOON + timedelta(days=every * (number - 14))))
    old = sum(every * (14 - number) >= 100 for number in range(1, 15))
    assert days_later(call, monkeypatch, rule, 0, "--dry-run") == (old, 0)
    ahead = sum(every * (15 - number) >= 100 for number in range(1, 15))
    assert days_later(call, monkeypatch, rule, 400, "--dry-run") == (ahead, 14 - ahead)


def test_a_rule_without_days_says_how_one_is_written(
    reference: str, batches: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rule = tmp_path / "rule.toml"
    rule.write_text("[runs]\n")
    code, said, err = called(capsys, "eol", "retain", str(rule), "--records", reference, "--runs", str(batches))
    assert (code, said) == (0, "")
    assert (
        "this rule removes nothing, because it names no days. Write for example [runs] and below it passed = 730" in err
    )


def test_a_rule_finds_runs_from_any_folder_and_leaves_another_station_s(
    call: Call, batches: Path, records: Records, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rule = tmp_path / "rule.toml"
    rule.write_text("[runs]\npassed = 0\n")
    log = BatchLog(batches / "B3", {})
    for number, identifier in ((1, log.identifier(1)), (2, "another station's")):
        (batches / "B3" / "000" / f"{number:06d}-P").mkdir(parents=True)
        run = f"runs/B3/000/{number:06d}-P"
        records.save(motor_record(number, identifier=identifier, batch="B3", run=run, verdict=Verdict.PASS))
    log.close()
    monkeypatch.chdir("/")
    assert json.loads(call("retain", str(rule))[1])["runs"] == 4
    assert sorted(path.name for path in (batches / "B3" / "000").iterdir()) == ["000002-P"]


def test_an_archive_has_and_removes_what_is_of_its_own_batch_and_not_of_another_of_the_name(
    call: Call, batches: Path, records: Records, engine: Engine, tmp_path: Path
) -> None:
    log = BatchLog(batches / "B1", {})
    log.close()
    code, _, error = call("archive", "B1", "--output", str(tmp_path / "none.tar"))
    assert code != 0
    assert "are all of another batch" in error
    records.save(motor_record(9, identifier=log.identifier(9), batch="B1"))
    typed = ("archive", "B1", "--remove", "all", "--output", str(tmp_path / "B1.tar"))
    assert json.loads(call(*typed)[1])["motors"] == 1
    assert sorted(each.number for each in records.read("B1")) == [1, 2, 3]
    with engine.connect() as connection:
        assert plans_of(connection, "B1") == [PLAN]


@pytest.mark.parametrize("content", ["[run]\n", "[runs]\npassed = -1\n", "[runs]\ngood = 1\n", "["])
def test_a_rule_that_is_none(content: str, tmp_path: Path) -> None:
    (tmp_path / "rule.toml").write_text(content)
    with pytest.raises(InputError, match=r"rule\.toml"):
        load_rule(tmp_path / "rule.toml")


def test_an_archive_takes_no_more_memory_for_a_longer_batch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bench.eol.store.records._AT_ONCE", 20)
    engine = open_database(str(tmp_path / "records.sqlite"))
    records, peaks = Records(engine), []
    # A cause of 20 kB each: read whole, the longer batch would take 1.6 MB more.
    for batch, count in (("short", 40), ("long", 120)):
        for number in range(count):
            records.save(motor_record(number + 1, identifier=f"{batch}-{number}", batch=batch, cause="x" * 20_000))
        tracemalloc.start()
        assert write_archive(engine, batch, tmp_path, tmp_path / f"{batch}.tar.gz").motors == count
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    engine.dispose()
    assert peaks[1] - peaks[0] < 300_000, peaks


def test_an_archive_of_a_batch_that_is_being_measured_says_so(
    call: Call, batches: Path, records: Records, tmp_path: Path, reference: str, capsys: pytest.CaptureFixture[str]
) -> None:
    log = BatchLog(batches / "B1", {"name": "B1"})
    records.save(motor_record(5, identifier=log.identifier(5), batch="B1"))
    code, said, _ = call("archive", "B1", "--output", str(tmp_path / "one"))
    assert (code, json.loads(said)["being_measured"]) == (0, True)
    typed = (
        "eol",
        "archive",
        "B1",
        "--records",
        reference,
        "--runs",
        str(batches),
        "--output",
        str(tmp_path / "shown"),
    )
    assert "this batch is being measured" in called(capsys, *typed)[2]
    log.close()
    said = call("archive", "B1", "--output", str(tmp_path / "two"))[1]
    assert not json.loads(said)["being_measured"]


def test_a_disk_without_room_for_what_is_restored_is_said_once(
    call: Call, batches: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "B1.tar.gz"
    call("archive", "B1", "--output", str(out), "--remove", "all")

    def full(path: Path, _content: bytes, **_kind: bool) -> None:
        raise RecordError(path, OSError(errno.ENOSPC, ""))

    monkeypatch.setattr("bench.eol.archive.batch_archive.write_file", full)
    code, _, err = call("restore", str(out))
    assert (code, err.count("cannot be written"), "Make room on that disk" in err) == (1, 1, True)
