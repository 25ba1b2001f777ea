"""A guardian's own record: its room, what it holds while it grows, and what is read of it."""

import os
import threading
from contextlib import suppress
from pathlib import Path

import pytest

from bench.cli.results import results
from bench.journal import guardian_record
from bench.journal.guardian_record import FILE, GuardianRecord, complain, read_guardian
from bench.journal.journal import Journal as RunJournal
from tests.journals import event


def test_the_record_has_its_room_beforehand_and_is_read_while_it_grows(tmp_path: Path) -> None:
    assert read_guardian(tmp_path) == []
    record = GuardianRecord(tmp_path)
    record.record(event("started", pid=1))
    assert record.head.events == 1
    assert (tmp_path / FILE).stat().st_size > 60_000
    assert [event.kind for event in read_guardian(tmp_path)] == ["started"]
    record.record(event("took", cause="…"))
    record.close()
    record.close()
    record.record(event("took"))
    again = GuardianRecord(tmp_path)
    again.record(event("started", pid=2))
    assert again.head.events == 3
    assert [event.kind for event in read_guardian(tmp_path)] == ["started", "took", "started"]
    again.close()
    assert (tmp_path / FILE).read_bytes().count(b"\n") == 3


def test_a_record_that_cannot_be_written_says_so_and_stops_nothing(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    record = GuardianRecord(tmp_path / "missing")
    record.record(event("took", cause="…"))
    record.close()
    assert "guardian.jsonl cannot be written" in capfd.readouterr().err


def test_nobody_who_does_not_read_is_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    unread, said = os.pipe()
    try:
        os.set_blocking(said, False)
        with suppress(BlockingIOError):
            while True:
                os.write(said, b"." * 4096)
        os.set_blocking(said, True)
        monkeypatch.setattr(guardian_record, "_STDERR", said)
        complain("what fills the pipe beyond its end")
        assert b"fills" not in os.read(unread, 1 << 20)
        complain("what is read")
        assert os.read(unread, 1 << 20) == b"motorbench guardian: what is read\n"
    finally:
        os.close(unread)
        os.close(said)


def test_what_a_guardian_did_is_shown_with_the_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    journal = RunJournal(tmp_path / "journal.jsonl", lambda: 0.0)
    journal.record(
        event("run_started", run=str(tmp_path), motor={"name": "M"}, station={}, procedures=["tiny"], settings=[])
    )
    journal.close()
    assert results(str(tmp_path), language="en") == 0
    assert "The guardian" not in capsys.readouterr().out
    record = GuardianRecord(tmp_path)
    record.record(event("took", cause="the run's process has died"))
    record.close()
    assert results(str(tmp_path), language="en") == 0
    assert "The guardian carried out the shutdown at 20" in (said := capsys.readouterr().out)
    assert "the run's process has died" in said
    assert results(str(tmp_path), json=True) == 0
    assert '"cause": "the run\'s process has died"' in capsys.readouterr().out


def test_two_guardians_of_one_run_do_not_write_into_each_others_lines(tmp_path: Path) -> None:
    first = GuardianRecord(tmp_path)
    first.record(event("took", cause="the run died"))

    def begin() -> None:
        second = GuardianRecord(tmp_path)
        second.record(event("ready"))
        second.close()

    waiting = threading.Thread(target=begin)
    waiting.start()
    waiting.join(0.2)
    assert waiting.is_alive()
    first.record(event("left"))
    first.close()
    waiting.join(10.0)
    told = read_guardian(tmp_path)
    assert [(event.number, event.kind) for event in told] == [(1, "took"), (2, "left"), (3, "ready")]
