"""The stop logic alone: thousands of quick doubles, triples and fours, some microseconds apart."""

import os
import random
import select
import signal
import subprocess
import sys
from dataclasses import dataclass, field
from time import monotonic

from tests.studies.energised.held import quiet
from tests.studies.kills.ends import STOPS

#: Not heard for so long (s) is a hang, however busy the machine.
_PATIENCE = 30.0
#: A run's main thread within the stop logic, again and again: it waits, computes or is in a call that it must not be raised in.
_VICTIM = """
import faulthandler, os, signal, sys, threading
from bench.safety.interrupts import Interrupted, Interrupts
faulthandler.register(signal.SIGUSR2, file=2, all_threads=True)
for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
    signal.signal(number, lambda *_: None)  # what comes after the run has ended
pause = threading.Event()

def wait(interrupts):
    with interrupts.waiting():
        while True:
            pause.wait(0.001)

def block(interrupts):
    with interrupts.waiting():
        pause.wait()

def call(interrupts):
    while True:
        with interrupts.waiting(interruptible=False):
            pause.wait(0.0005)

def check(interrupts):
    while True:
        sum(range(100))
        interrupts.check()

os.write(1, b"u")
while (what := os.read(0, 1)) in b"wbck" and what:
    interrupts, told = Interrupts(), []
    interrupts.listen(told.append)
    try:
        with interrupts.raising():
            os.write(1, b"r")
            try:
                {b"w": wait, b"b": block, b"c": call, b"k": check}[what](interrupts)
            finally:
                interrupts.shutdown_begins()
                for _ in range(3):
                    with interrupts.waiting():
                        pause.wait(0.0001)
    except Interrupted:
        os.write(1, b"i")
    if not told:
        os.write(2, b"nobody was told\\n")
"""


@dataclass
class Quick:
    """How many bursts, how many of them hung, and what else was found."""

    bursts: int = 0
    hangs: int = 0
    longest: float = 0.0
    found: list[str] = field(default_factory=list)


def bursts(count: int, seed: str, *, patience: float = _PATIENCE) -> Quick:
    """Send so many bursts of two to four signals and return what became of them."""
    draw = random.Random(seed)  # noqa: S311  moments, no secrets
    done = Quick()
    victim = _Victim()
    try:
        for number in range(count):
            done.bursts += 1
            began = victim.burst(draw)
            if victim.heard(patience) != b"i":
                done.hangs += 1
                done.found.append(f"burst {number} of {seed}: {victim.stacks()}")
                victim = _Victim()
                continue
            done.longest = max(done.longest, monotonic() - began)
    finally:
        if said := victim.close():
            done.found.append(said)
    return done


class _Victim:
    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", _VICTIM],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=quiet(),
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._to, self._from = self._process.stdin.fileno(), self._process.stdout.fileno()
        assert self.heard(60.0) == b"u"

    def burst(self, draw: random.Random) -> float:
        """Have it begin anew and send a burst; return when (s, monotonic)."""
        os.write(self._to, draw.choice((b"w", b"b", b"c", b"k")))
        assert self.heard(60.0) == b"r"
        for _moment in range(int(10.0 ** draw.uniform(0.0, 4.0))):
            pass
        began = monotonic()
        for _number in range(draw.choice((2, 2, 3, 3, 4))):
            self._process.send_signal(draw.choice(STOPS))
            for _moment in range(int(10.0 ** draw.uniform(0.0, 3.5))):
                pass
        return began

    def heard(self, seconds: float) -> bytes:
        """Return what it says, nothing where it says nothing in time."""
        ready, _, _ = select.select([self._from], [], [], seconds)
        return os.read(self._from, 1) if ready else b""

    def stacks(self) -> str:
        """Return where it hangs, and end it."""
        self._process.send_signal(signal.SIGUSR2)
        select.select([self._process.stderr], [], [], 5.0)
        self._process.kill()
        return self._process.communicate()[1].decode(errors="replace")

    def close(self) -> str:
        """End it; return what it said on standard error."""
        self._process.kill()
        return self._process.communicate()[1].decode(errors="replace")
