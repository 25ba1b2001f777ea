"""Requests to stop: heard once and for good, by the run's thread whatever it waits in, and by nobody who must not be disturbed."""

import dis
import os
import random
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from time import monotonic
from types import FunctionType
from typing import Any

import pytest

from bench.eol.line.stop_request import StopRequest
from bench.safety.interrupts import Interrupted, Interrupts

#: What a handler may do: look at attributes and constants, set attributes, raise what is there already.
HARMLESS = {
    "RESUME", "LOAD_FAST", "LOAD_CONST", "LOAD_ATTR", "STORE_ATTR", "STORE_FAST", "LOAD_GLOBAL", "BINARY_SUBSCR", "BINARY_OP",
    "COMPARE_OP", "IS_OP", "COPY", "SWAP", "POP_TOP", "NOP", "CACHE", "TO_BOOL", "UNARY_NOT", "RAISE_VARARGS", "RETURN_VALUE",
    "RETURN_CONST", "JUMP_FORWARD", "POP_JUMP_IF_FALSE", "POP_JUMP_IF_TRUE", "POP_JUMP_FORWARD_IF_FALSE",
    "POP_JUMP_FORWARD_IF_TRUE", "JUMP_IF_TRUE_OR_POP", "JUMP_IF_FALSE_OR_POP", "LOAD_FAST_LOAD_FAST", "STORE_FAST_LOAD_FAST",
    "LOAD_SMALL_INT", "LOAD_FAST_BORROW", "LOAD_FAST_BORROW_LOAD_FAST_BORROW", "NOT_TAKEN", "EXTENDED_ARG",
}  # fmt: skip


def blocked_while(interrupts: Interrupts, work: Callable[[], object]) -> None:
    """Wait in a system call that nobody ends but a signal, while another thread does some work."""
    thread = threading.Timer(0.05, work)
    thread.start()
    ours, theirs = socket.socketpair()
    try:
        with ours, theirs, interrupts.waiting():
            ours.recv(1)
    finally:
        thread.join()


def compute(seconds: float) -> None:
    deadline = monotonic() + seconds
    while monotonic() < deadline:
        pass


def eventually(holds: Callable[[], bool]) -> None:
    deadline = monotonic() + 10.0
    while not holds():
        assert monotonic() < deadline
        threading.Event().wait(0.005)


@pytest.mark.parametrize("handler", [Interrupts._signalled, Interrupts._nudged, StopRequest._signalled])
def test_a_handler_sets_attributes_and_nothing_else(handler: FunctionType) -> None:
    assert {step.opname for step in dis.get_instructions(handler)} <= HARMLESS


def test_a_request_from_another_thread_ends_what_the_main_thread_waits_in() -> None:
    interrupts = Interrupts()
    with pytest.raises(Interrupted, match="interrupted by the door"), interrupts.raising():
        blocked_while(interrupts, lambda: interrupts.request("the door"))
    assert set(interrupts.delays()) == {"interrupted_after", "started_after"}
    assert not interrupts.hurry.is_set()


def test_a_signal_that_another_thread_got_is_heard_all_the_same() -> None:
    def kill_me() -> None:
        signal.pthread_kill(threading.get_ident(), signal.SIGTERM)

    interrupts = Interrupts()
    with pytest.raises(Interrupted, match="interrupted by SIGTERM"), interrupts.raising():
        blocked_while(interrupts, kill_me)


def test_a_signal_that_no_thread_takes_is_told_all_the_same() -> None:
    # As in a main thread that hangs in the system: it waits for whoever may take it, until the block's end.
    said = subprocess.run([sys.executable, "-c", _UNTAKEN], capture_output=True, text=True, check=True).stdout
    assert said.splitlines() == ["told: SIGTERM", "interrupted by SIGTERM"]


_UNTAKEN = """
import os, signal, threading
from bench.safety.interrupts import Interrupted, Interrupts
interrupts, told = Interrupts(), threading.Event()
interrupts.listen(lambda by: (print("told:", by), told.set()))
signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM})
with interrupts.raising():
    os.kill(os.getpid(), signal.SIGTERM)
    assert told.wait(10.0)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGTERM})
    try:
        interrupts.check()
    except Interrupted as error:
        print(error)
"""


def test_the_first_counts_and_a_second_signal_is_in_a_hurry() -> None:
    interrupts = Interrupts()
    with interrupts.raising():
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(Interrupted, match="interrupted by Ctrl-C"):
            interrupts.check()
        interrupts.shutdown_begins()
        eventually(lambda: bool(interrupts.delays()))
        assert not interrupts.hurry.is_set()
        signal.raise_signal(signal.SIGTERM)
        eventually(interrupts.hurry.is_set)
        assert interrupts.requested_by == "Ctrl-C"


def test_a_request_and_one_signal_are_no_hurry() -> None:
    interrupts, told = Interrupts(), []
    interrupts.listen(told.append)
    with interrupts.raising():
        interrupts.request("the door")
        interrupts.shutdown_begins()
        signal.raise_signal(signal.SIGTERM)
        eventually(lambda: told == ["the door"])
        threading.Event().wait(0.05)
        assert not interrupts.hurry.is_set()


def test_what_was_requested_before_is_heard_at_the_beginning() -> None:
    interrupts, told = Interrupts(), []
    interrupts.listen(told.append)
    interrupts.request("the panel")
    interrupts.request("somebody else")
    with pytest.raises(Interrupted, match="the panel"), interrupts.raising(), interrupts.waiting():
        threading.Event().wait(10.0)
    assert told == ["the panel"]


def test_it_is_raised_again_until_the_shutdown_has_begun() -> None:
    interrupts, caught = Interrupts(), 0
    with interrupts.raising():
        interrupts.request("the door")
        for _ in range(3):
            with suppress(Interrupted), interrupts.waiting():
                pytest.fail("a wait began after the request")
            caught += 1
        for _ in range(2):
            # Swallowed where nobody looks: wherever the thread is, it is raised again.
            with pytest.raises(Interrupted):
                compute(10.0)
        interrupts.shutdown_begins()
        with interrupts.waiting():
            threading.Event().wait(0.05)
    assert caught == 3


def test_one_that_lands_in_a_destructor_is_not_lost() -> None:
    interrupts, swallowed = Interrupts(), []

    class Slow:
        def __del__(self) -> None:
            with interrupts.waiting():
                interrupts.request("the door")
                threading.Event().wait(10.0)

    before, sys.unraisablehook = sys.unraisablehook, swallowed.append
    try:
        with interrupts.raising(), pytest.raises(Interrupted):  # noqa: PT012  the order is the point
            Slow()
            assert len(swallowed) == 1
            interrupts.check()
    finally:
        sys.unraisablehook = before


def test_a_switching_off_is_let_pass_and_broken_off_when_it_hangs() -> None:
    interrupts, done = Interrupts(), []
    with pytest.raises(Interrupted), interrupts.raising():  # noqa: PT012  the order is the point
        interrupts.request("the door")
        with interrupts.switching_off():
            with interrupts.waiting():
                done.append("off")
            with interrupts.waiting():
                threading.Event().wait(10.0)
    assert done == ["off"]


def test_what_must_not_be_broken_off_is_not() -> None:
    interrupts = Interrupts()
    with pytest.raises(Interrupted), interrupts.raising():  # noqa: PT012  the order is the point
        with interrupts.waiting(interruptible=False):
            interrupts.request("the door")
            threading.Event().wait(0.2)
        done = True
        interrupts.check()
    assert done


def test_handlers_are_put_back() -> None:
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGUSR1)
    before = [signal.getsignal(number) for number in numbers]
    with Interrupts().raising():
        assert [signal.getsignal(number) for number in numbers] != before
    assert [signal.getsignal(number) for number in numbers] == before


def test_a_run_in_another_thread_is_interrupted_by_its_next_call() -> None:
    interrupts = Interrupts()
    heard: list[str] = []

    def run() -> None:
        try:
            with interrupts.raising():
                interrupts.check()
                interrupts.request("the door")
                # Somebody else's call, one that switches off for example, is not the run's.
                other = threading.Thread(target=interrupts.check)
                other.start()
                other.join()
                interrupts.check()
        except Interrupted as stop:
            heard.append(str(stop))
            interrupts.shutdown_begins()
            interrupts.check()

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    assert heard == ["interrupted by the door"]


VICTIM = """
import os, signal, threading
from bench.safety.interrupts import Interrupted, Interrupts
for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
    signal.signal(number, lambda *_: None)  # what comes after the run has ended
os.write(1, b"up")
while os.read(0, 1) == b"n":
    interrupts, told = Interrupts(), []
    interrupts.listen(told.append)
    try:
        with interrupts.raising():
            os.write(1, b"r")
            try:
                with interrupts.waiting():
                    while True:
                        threading.Event().wait(0.001)
            finally:
                interrupts.shutdown_begins()
    except Interrupted:
        os.write(1, b"i" if told else b"?")
"""


def test_signals_in_quick_succession_hang_nothing() -> None:
    """Two and three signals within microseconds, as an impatient hand or a supervisor sends them."""
    draw = random.Random(1)  # noqa: S311  chance, not secrecy
    with subprocess.Popen([sys.executable, "-c", VICTIM], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as victim:
        assert victim.stdin is not None
        assert victim.stdout is not None
        try:
            assert _told(victim.stdout, 2) == b"up"
            for _ in range(150):
                os.write(victim.stdin.fileno(), b"n")
                assert _told(victim.stdout, 1) == b"r"
                for _ in range(draw.choice((1, 2, 3))):
                    victim.send_signal(draw.choice((signal.SIGINT, signal.SIGTERM, signal.SIGHUP)))
                    for _ in range(draw.randrange(300)):
                        pass
                assert _told(victim.stdout, 1) == b"i"
        finally:
            victim.kill()


def _told(stream: Any, count: int) -> bytes:
    timer = threading.Timer(20.0, stream.close)
    timer.start()
    try:
        return os.read(stream.fileno(), count)
    finally:
        timer.cancel()


def test_who_was_first_is_named_whoever_follows() -> None:
    interrupts = Interrupts()
    with interrupts.raising():
        signal.raise_signal(signal.SIGINT)
        interrupts.request("the guardian, which carried out the shutdown")
        assert interrupts.requested_by == "Ctrl-C"
