"""Interruptions: once from whomever, heard by the main thread whatever it waits in, and twice for those in a hurry."""

import signal
import socket
import threading
from collections.abc import Callable

import pytest

from bench.safety.interrupts import Interrupted, Interrupts


def blocked_while(work: Callable[[], object]) -> None:
    """Wait in a system call that nobody ends but a signal, while another thread does some work."""
    thread = threading.Timer(0.05, work)
    thread.start()
    ours, theirs = socket.socketpair()
    try:
        with ours, theirs:
            ours.recv(1)
    finally:
        thread.join()


def test_a_wish_from_another_thread_ends_what_the_main_thread_waits_in() -> None:
    interrupts = Interrupts()
    with pytest.raises(Interrupted, match="interrupted by the door"), interrupts.raising():
        blocked_while(lambda: interrupts.request("the door"))
    assert set(interrupts.delays()) == {"interrupted_after", "started_after"}
    assert not interrupts.hurry.is_set()


def test_a_signal_that_another_thread_got_is_heard_all_the_same() -> None:
    def kill_me() -> None:
        signal.pthread_kill(threading.get_ident(), signal.SIGTERM)

    with pytest.raises(Interrupted, match="interrupted by SIGTERM"), Interrupts().raising():
        blocked_while(kill_me)


def test_the_first_counts_and_a_second_signal_is_in_a_hurry() -> None:
    interrupts = Interrupts()
    with interrupts.raising():
        with pytest.raises(Interrupted, match="interrupted by Ctrl-C"):
            signal.raise_signal(signal.SIGINT)
        with interrupts.held_back():
            assert not interrupts.hurry.is_set()
            interrupts.request("too late")
            signal.raise_signal(signal.SIGINT)
            assert interrupts.hurry.is_set()


def test_a_wish_and_one_signal_are_no_hurry() -> None:
    interrupts = Interrupts()
    with pytest.raises(Interrupted, match="the door"), interrupts.raising():
        blocked_while(lambda: interrupts.request("the door"))
    with interrupts.raising(), interrupts.held_back():
        signal.raise_signal(signal.SIGTERM)
        assert not interrupts.hurry.is_set()


def test_what_nobody_can_say_by_a_signal_is_remembered() -> None:
    interrupts = Interrupts()
    interrupts.raise_if_requested()
    interrupts.request("the panel")
    interrupts.request("somebody else")
    with pytest.raises(Interrupted, match="the panel"):
        interrupts.raise_if_requested()


def test_handlers_are_put_back() -> None:
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGUSR1)
    before = [signal.getsignal(number) for number in numbers]
    with Interrupts().raising():
        assert [signal.getsignal(number) for number in numbers] != before
    assert [signal.getsignal(number) for number in numbers] == before


def test_a_run_in_another_thread_is_interrupted_by_its_next_event() -> None:
    interrupts = Interrupts()
    heard: list[str] = []

    def run() -> None:
        try:
            with interrupts.raising():
                interrupts.hear("reading", {})
                interrupts.request("the door")
                # Somebody else's event, an interlock's for example, is not the run's.
                other = threading.Thread(target=interrupts.hear, args=("interlock_opened", {}))
                other.start()
                other.join()
                interrupts.hear("reading", {})
        except Interrupted as stop:
            heard.append(str(stop))
            with interrupts.held_back():
                interrupts.hear("made_safe", {})

    interrupts.hear("run_started", {})
    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    assert heard == ["interrupted by the door"]
    assert "interrupted_after" in interrupts.delays()
