"""The heartbeat of a worker, and what the coordinator makes of it."""

import os
import threading
from collections.abc import Iterator

import pytest

from bench.eol.line.workers import worker_status
from bench.eol.line.workers.worker_status import Heartbeat, WorkerStatus, give_heartbeats


@pytest.fixture
def status() -> Iterator[WorkerStatus]:
    status, descriptor = WorkerStatus.create(2)
    yield status
    os.close(descriptor)


def test_a_worker_beats_until_it_is_stuck(status: WorkerStatus, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker_status, "INTERVAL", 0.005)
    stuck, asked = threading.Event(), threading.Event()

    def is_stuck() -> bool:
        if stuck.is_set():
            asked.set()
        return stuck.is_set()

    give_heartbeats(status, 1, is_stuck)
    pause = threading.Event()
    while status.beats(1) < 3:
        pause.wait(0.005)
    stuck.set()
    assert asked.wait(10.0)
    last = status.beats(1)
    asked.clear()
    assert asked.wait(10.0), "it goes on looking"
    assert status.beats(1) == last
    assert status.beats(0) == 0
    stuck.clear()
    while status.beats(1) == last:
        pause.wait(0.005)


def test_silence_is_counted_from_the_first_beat_and_ends_with_the_next() -> None:
    heartbeat = Heartbeat()
    for beats, passed, silent in (
        (0, 9.0, 0.0),
        (0, 9.0, 0.0),
        (1, 0.5, 0.0),
        (1, 0.5, 0.5),
        (1, 1.0, 1.5),
        (2, 1.0, 0.0),
    ):
        heartbeat.observe(beats, passed)
        assert heartbeat.silent == silent
