"""A run that energises everything at once, says so, and once told to go on does what it is to do: for tests that end it in every manner.

What it does once everything is on: wait, disk-full, deadlock, lose ROLE.
"""

import json
import resource
import signal
import sys
import threading
from contextlib import ExitStack
from pathlib import Path
from typing import Any, ClassVar

from bench.motor.motor_file import load_motor
from bench.run.console import console_on
from bench.run.request import RunRequest
from bench.run.run import run
from procedures.core.bench import Role
from procedures.core.procedure import Procedure, Settings
from procedures.core.steps import step


class Hold(Procedure[Settings]):
    """Supply, dynamometer and inverter on, until somebody ends it."""

    name: ClassVar[str] = "hold"
    title: ClassVar[str] = "Hold"
    section: ClassVar[str] = "9.9"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.SUPPLY, Role.DYNAMOMETER, Role.INVERTER})
    gives: ClassVar[tuple[str, ...]] = ()
    runs: ClassVar[Path]
    then: ClassVar[tuple[str, ...]]

    def measure(self) -> None:
        self.hold()

    @step("9.9/1", "Hold")
    def hold(self) -> None:
        bench = self.bench
        with ExitStack() as on:
            on.enter_context(bench.dynamometer.driving_speed(30.0))
            on.enter_context(bench.inverter.driving_current(1.0))
            on.enter_context(bench.supply.energised(5.0, 1.0))
            print("energised", flush=True)
            # Whoever started it looks first.
            sys.stdin.readline()
            getattr(self, self.then[0].replace("-", "_"))(*self.then[1:])

    def wait(self) -> None:
        self.bench.clock.sleep(1e6)

    def deadlock(self) -> None:
        # Nothing that Python could interrupt: no handler runs while the signals stay blocked.
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM, signal.SIGUSR1})
        threading.Event().wait()

    def disk_full(self) -> None:
        journal = next(self.runs.glob("*/journal.jsonl"))
        limit = journal.stat().st_size + 10
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
        self.bench.supply.measure_voltage()

    def lose(self, role: str) -> None:
        print("measuring", flush=True)
        while True:
            getattr(self.bench, role).measure_current()


def hold(station: str, runs: Path, then: tuple[str, ...]) -> None:
    """Run in a process that was forked for it."""
    Hold.runs, Hold.then = runs, then
    motor = load_motor("lg-400w")
    wishes = RunRequest(procedures=["hold"], motor=motor, station=station, language="en", runs=runs, operator="virtual")
    done = run(wishes, {"hold": Hold}, console_on(sys.stderr))
    told: dict[str, Any] = {"status": done.view.status, "cause": done.view.cause}
    print(json.dumps(told), flush=True)
