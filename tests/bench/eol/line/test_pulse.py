"""Signs of life of a worker, and what the coordinator makes of them."""

import os
import threading
from collections.abc import Iterator

import pytest

from bench.eol.line import heartbeat as pulse
from bench.eol.line.heartbeat import Pulse, give_signs
from bench.eol.line.times import Times


@pytest.fixture
def times() -> Iterator[Times]:
    made, descriptor = Times.made(2)
    yield made
    os.close(descriptor)


def test_a_worker_beats_until_it_is_stuck(times: Times, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pulse, "INTERVAL", 0.005)
    stuck, asked = threading.Event(), threading.Event()

    def is_stuck() -> bool:
        if stuck.is_set():
            asked.set()
        return stuck.is_set()

    give_signs(times, 1, is_stuck)
    pause = threading.Event()
    while times.beats(1) < 3:
        pause.wait(0.005)
    stuck.set()
    assert asked.wait(10.0)
    last = times.beats(1)
    asked.clear()
    assert asked.wait(10.0), "it goes on looking"
    assert times.beats(1) == last
    assert times.beats(0) == 0
    stuck.clear()
    while times.beats(1) == last:
        pause.wait(0.005)


def test_silence_is_counted_from_the_first_sign_and_ends_with_the_next() -> None:
    watched = Pulse()
    for beats, passed, silent in (
        (0, 9.0, 0.0),
        (0, 9.0, 0.0),
        (1, 0.5, 0.0),
        (1, 0.5, 0.5),
        (1, 1.0, 1.5),
        (2, 1.0, 0.0),
    ):
        watched.look(beats, passed)
        assert watched.silent == silent
