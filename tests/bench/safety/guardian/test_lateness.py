"""Delays of the guardian and of the run, by which a run gets more time."""

import hashlib
import os
import threading
import time
from pathlib import Path

from bench.safety.guardian.lateness import Lateness, RunQueue


def test_the_longest_delay_of_the_window_counts_and_no_more_than_the_window() -> None:
    late = Lateness(0.6)
    assert late.allowance(0.0) == 0.0
    late.woke(planned=1.0, now=1.005)
    assert late.allowance(1.005) == 0.0, "a waker's usual delay is none"
    late.woke(planned=1.05, now=1.25)
    late.woke(planned=1.30, now=1.35)
    assert round(late.allowance(1.35), 6) == 0.2
    assert round(late.allowance(1.9), 6) == 0.05, "the longer one is past"
    assert late.allowance(2.0) == 0.0
    late.woke(planned=3.0, now=60.0)
    assert late.allowance(60.0) == 0.6


class Threads:
    """Threads of a process as Linux shows them."""

    def __init__(self, processes: Path) -> None:
        self.folder = processes / "17" / "task"

    def counted(self, thread: int, ran: int, waited: int) -> None:
        (self.folder / str(thread)).mkdir(parents=True, exist_ok=True)
        (self.folder / str(thread) / "schedstat").write_text(f"{ran} {waited} 5\n")


def test_waiting_for_a_processor_is_counted_from_the_last_note_on(tmp_path: Path) -> None:
    threads = Threads(tmp_path)
    threads.counted(17, 900_000_000, 300_000_000)
    queue = RunQueue(17, tmp_path)
    assert queue.waited() == 0.0
    threads.counted(17, 5_000_000_000, 550_000_000)
    threads.counted(18, 0, 700_000_000)
    assert queue.waited() == 0.25, "a thread that was not there at the last note says nothing"
    queue.note()
    threads.counted(18, 0, 800_000_000)
    assert round(queue.waited(), 9) == 0.1


def test_a_system_that_does_not_count_gives_no_time(tmp_path: Path) -> None:
    queue = RunQueue(17, tmp_path)
    assert queue.waited() == 0.0
    threads = Threads(tmp_path)
    threads.counted(17, 1, 1)
    (threads.folder / "17" / "schedstat").write_text("\n")
    queue.note()
    assert queue.waited() == 0.0


def test_the_system_counts_threads_that_share_a_processor() -> None:
    allowed = os.sched_getaffinity(0)
    queue, done = RunQueue(os.getpid()), threading.Event()

    def share() -> None:
        os.sched_setaffinity(0, {min(allowed)})
        while not done.is_set():
            # Hashing of so much releases Python's lock.
            hashlib.sha256(b"0" * 1_000_000)

    shares = [threading.Thread(target=share) for _ in range(3)]
    for one in shares:
        one.start()
    queue.note()
    deadline = time.monotonic() + 20.0
    while (waited := queue.waited()) < 0.01 and time.monotonic() < deadline:
        done.wait(0.01)
    done.set()
    for one in shares:
        one.join()
    assert 0.01 <= waited < 60.0
