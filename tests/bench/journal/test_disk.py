"""A disk that is full, broken or read-only, and a signal in the middle of a line."""

import errno
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.i18n.errors import InputError
from bench.journal.codec import KINDS
from bench.journal.disk import RESERVE, Reserve, StandingReserve, write_file
from bench.journal.errors import RecordError
from bench.journal.journal import Journal
from bench.journal.journal_file import read_journal
from bench.journal.run_folder import RunFolder
from bench.journal.run_result import conclude
from bench.journal.run_view import RunView
from bench.journal.wall import WallTime
from bench.journal.waveforms import StoredWaveform, WaveformFolder, read_waveform
from drivers.interfaces.text import english
from tests.command_line import Call
from tests.journals import event

Full = Callable[[int], None]
WRITE = os.write


@pytest.fixture
def full(monkeypatch: pytest.MonkeyPatch) -> Full:
    """A disk that takes so many bytes more and then is full."""
    return lambda room: monkeypatch.setattr(os, "write", writing_into([room]))


def writing_into(left: list[int]) -> Callable[[int, Any], int]:
    """`os.write` on a disk with so many bytes left, which it counts down."""

    def write(file: int, content: Any) -> int:
        count = min(len(content), left[0])
        if count == 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        left[0] -= count
        return WRITE(file, bytes(content[:count]))

    return write


@settings(max_examples=25, deadline=None)
@given(room=st.integers(0, 900), reserve=st.integers(0, 900))
def test_whatever_room_is_left_the_journal_holds_whole_events_only(
    tmp_path_factory: pytest.TempPathFactory, room: int, reserve: int
) -> None:
    folder = tmp_path_factory.mktemp("full")
    left = [room]

    class Room(Reserve):
        def release(self) -> None:
            super().release()
            left[0] += reserve

    journal = Journal(folder / "journal.jsonl", lambda: 0.0, reserve=Room(folder / ".reserve"))
    acknowledged, refused = [], []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "write", writing_into(left))
        for kind in ("reading", "energising", "reading", "reading", "de_energised", "made_safe", "run_finished"):
            try:
                journal.record(event(kind, value=1.25))
            except RecordError:
                refused.append(kind)
            else:
                acknowledged.append(kind)
                # Once something was refused, nothing but the end is taken.
                assert KINDS[kind].closing or not refused
    journal.close()
    read = read_journal(folder / "journal.jsonl")
    assert not read.torn
    assert [event.kind for event in read.events if event.kind != "record_failed"] == acknowledged
    assert not (folder / ".reserve").exists()


def test_a_full_disk_is_told_and_only_the_end_is_still_written(tmp_path: Path, full: Full) -> None:
    reserve = Reserve(tmp_path / ".reserve")
    assert (tmp_path / ".reserve").stat().st_blocks * 512 >= RESERVE
    journal = Journal(tmp_path / "journal.jsonl", lambda: 0.0, reserve=reserve)
    journal.record(event("run_started"))
    full(0)
    with pytest.raises(
        RecordError, match=r"journal\.jsonl cannot be written: no space is left on the disk\. .* Make room"
    ):
        journal.record(event("reading", value=1))
    full(10_000)
    with pytest.raises(RecordError):
        journal.record(event("reading", value=2))
    journal.record(event("made_safe", instrument="supply"))
    journal.record(event("run_finished", status="failed"))
    journal.close()
    kinds = [event.kind for event in read_journal(journal.path).events]
    assert kinds == ["run_started", "made_safe", "run_finished"]


def test_a_disk_that_reports_an_error_acknowledges_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    journal = Journal(tmp_path / "journal.jsonl", lambda: 0.0)

    def broken(file: int) -> None:
        raise OSError(errno.EIO, "the device reports an input or output error")

    monkeypatch.setattr(os, "fsync", broken)
    journal.record(event("reading"))
    with pytest.raises(RecordError, match="the device reports an input or output error"):
        journal.record(event("energising"))
    journal.close()
    assert [event.kind for event in read_journal(journal.path).events] == ["reading"]


class Stopped(BaseException):
    """As a signal's handler raises it, anywhere."""


@pytest.mark.parametrize("before", [True, False])
@pytest.mark.parametrize("call", ["write", "fsync"])
def test_a_signal_in_the_middle_of_a_line_leaves_the_chain_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: str, before: bool
) -> None:
    journal = Journal(tmp_path / "journal.jsonl", lambda: 0.0)
    journal.record(event("run_started"))
    real = getattr(os, call)

    def struck(*arguments: Any) -> Any:
        if not before:
            real(*arguments)
        raise Stopped

    with monkeypatch.context() as patch:
        patch.setattr(os, call, struck)
        with pytest.raises(Stopped):
            journal.record(event("energising"))
    journal.record(event("made_safe"))
    journal.record(event("run_finished"))
    journal.close()
    kinds = [event.kind for event in read_journal(journal.path).events]
    assert kinds[-2:] == ["made_safe", "run_finished"]
    assert len(kinds) == (3 if before and call == "write" else 4)


def test_no_room_at_the_start_is_told_before_anything_is_done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_room(file: int, offset: int, size: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "posix_fallocate", no_room)
    with pytest.raises(InputError, match=r"no room for a run .* see|choose another disk with --runs"):
        Reserve(tmp_path / ".reserve")
    assert not (tmp_path / ".reserve").exists()


@pytest.mark.parametrize("resumed", [False, True])
def test_a_run_that_finds_no_room_leaves_no_folder_and_keeps_one_that_is_resumed(
    call: Call, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, resumed: bool
) -> None:
    arguments = ["run", "nameplate", "--station", "virtual", "--motor", "lg-400w"]
    if resumed:
        assert call(*arguments)[0] == 0
        arguments = ["run", "--resume", "latest", "--repeat", "nameplate"]
    before = sorted(tmp_path.rglob("*"))

    def no_room(file: int, offset: int, size: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "posix_fallocate", no_room)
    code, _, err = call(*arguments)
    assert (code, "the disk has no room for a run" in err) == (1, True), err
    assert sorted(tmp_path.rglob("*")) == (before if resumed else [tmp_path / "runs"])


def test_room_that_stands_is_kept_from_run_to_run_and_given_back_to_the_one_that_needs_it(
    tmp_path: Path, full: Full
) -> None:
    place = tmp_path / ".reserve-0"
    reserve = StandingReserve(place)
    for run in ("1", "2"):
        reserve.keep()
        journal = Journal(tmp_path / run, lambda: 0.0, reserve=reserve)
        journal.record(event("reading"))
        journal.close()
        assert place.stat().st_blocks * 512 >= RESERVE
    journal = Journal(tmp_path / "3", lambda: 0.0, reserve=reserve)
    full(0)
    with pytest.raises(RecordError):
        journal.record(event("reading"))
    assert not place.exists()
    journal.close()
    reserve.keep()
    assert place.exists()
    reserve.release()
    assert not place.exists()


def test_two_processes_do_not_write_one_run(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "journal.jsonl", lambda: 0.0)
    journal.record(event("run_started"))
    read = read_journal(journal.path)
    with pytest.raises(InputError, match="another process is writing this run"):
        Journal(journal.path, lambda: 0.0, previous=read)
    journal.record(event("run_finished"))
    journal.close()
    with pytest.raises(InputError, match="holds more than was read"):
        Journal(journal.path, lambda: 0.0, previous=read)


def test_a_journal_that_cannot_be_opened_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    reserve = Reserve(tmp_path / ".reserve")

    def read_only(*arguments: Any) -> int:
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr(os, "open", read_only)
    with pytest.raises(InputError, match=r"cannot be written: the disk is read-only\. Make the folder writable"):
        Journal(tmp_path / "journal.jsonl", lambda: 0.0, reserve=reserve)
    assert not (tmp_path / ".reserve").exists()
    with pytest.raises(RecordError, match=r"the disk is read-only\. .* choose another with --runs"):
        write_file(tmp_path / "x", b"content")


def test_a_waveform_that_finds_no_room_leaves_no_file(tmp_path: Path, full: Full) -> None:
    wave = StoredWaveform(np.arange(1000) * 1e-3, np.sin(np.arange(1000)), "V", 0.0)
    folder = WaveformFolder(tmp_path / "waveforms")
    full(2000)
    with pytest.raises(RecordError, match=r"0001-oscilloscope\.h5 cannot be written: no space is left"):
        folder.store("oscilloscope", {"channel1": wave})
    assert list(folder.path.iterdir()) == []


@pytest.mark.parametrize("durable", [True, False])
def test_a_record_waits_for_the_disk_only_where_it_must_be_durable(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, durable: bool
) -> None:
    synced: list[int] = []
    monkeypatch.setattr(os, "fsync", synced.append)
    wave = StoredWaveform(np.arange(10) * 1e-3, np.sin(np.arange(10)), "V", 0.0)
    stored = WaveformFolder(tmp_path / "waveforms", durable=durable).store("oscilloscope", {"channel1": wave})
    assert len(synced) == (2 if durable else 0)
    np.testing.assert_array_equal(read_waveform(tmp_path / stored.path, "channel1").values, wave.values)


def test_a_result_that_finds_no_room_is_told_and_the_older_one_stays(tmp_path: Path, full: Full) -> None:
    folder = RunFolder(tmp_path)
    view = RunView()
    journal = Journal(folder.journal, lambda: 0.0)
    journal.listen(view.apply)
    journal.record(event("run_started", procedures=[], settings=[]))
    journal.record(event("run_finished", status="completed", cause="", bench_time=1.0, wall_time=1.0))
    journal.close()
    folder.result.write_text("older", encoding="utf-8")
    full(100)
    assert conclude(folder, view, english)["status"] == "failed"
    assert "result.json was not made" in view.cause
    assert folder.result.read_text(encoding="utf-8") == "older"
    assert not (tmp_path / ".result.json.part").exists()


def test_a_clock_that_is_set_back_is_an_event_and_the_order_stays(tmp_path: Path) -> None:
    times = iter([(1000, 0), (1010, 10), (910, 20), (920, 30)])

    def tick() -> int:
        now, passed = next(times)
        ticks.append(passed * 10**9)
        return now * 10**9

    ticks = [0]
    journal = Journal(tmp_path / "journal.jsonl", lambda: 0.0, wall=WallTime("", tick, lambda: ticks[-1]))
    for kind in ("run_started", "reading", "reading", "run_finished"):
        journal.record(event(kind, procedures=[], settings=[], status="completed", bench_time=0.0, wall_time=0.0))
    journal.close()
    events = read_journal(journal.path).events
    assert [event.kind for event in events] == ["run_started", "reading", "clock_set_back", "reading", "run_finished"]
    assert events[2].data["seconds"] == pytest.approx(110.0)
    view = RunView()
    view.apply(event("clock_set_back", **events[2].data))
    ((_, notice),) = view.warnings()
    assert "set back by 110 s" in str(notice.message)


def test_a_clock_behind_the_last_session_is_noticed(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "journal.jsonl", lambda: 0.0)
    journal.record(event("run_started"))
    journal.close()
    read = read_journal(journal.path)
    behind = WallTime(read.events[-1].wall, lambda: 10**18, lambda: 0)
    assert behind.read()[1] > 1e6
    assert behind.read()[1] == 0.0
    assert WallTime("yesterday").read()[1] == 0.0
