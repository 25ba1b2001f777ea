"""A run that energises everything and then keeps busy in one manner or another, in a process that is forked for the study."""

import faulthandler
import gc
import json
import os
import random
import signal
import sys
import threading
import time
import weakref
from contextlib import suppress
from datetime import datetime, timedelta, tzinfo
from pathlib import Path
from typing import Any

from bench.cli.output import console_on
from bench.journal.run_folder import existing_run_folder
from bench.motor.motor_file import load_motor
from bench.run.request import RunRequest
from bench.run.run import run
from procedures.core.steps import step
from tests.studies.energised.held_run import Hold

#: What the study asks a run's stacks with.
STACKS = signal.SIGUSR2
#: What a reading is told with, before anything else is asked.
READING = b"r\n"
_JUMP = 7200.0


class Busy(Hold):
    """What `Hold` holds, with more to do meanwhile; every reading is told as soon as it is there."""

    #: How long (bench time, s) nothing is told after an error that was handled.
    quiet = 0.0

    def finish(self) -> None:
        """End at once."""

    def measure(self) -> None:
        if self.then[0] == "finish":
            # A run that goes on: what was left on is off already, and there is nothing more to do.
            return
        if self.then[0] == "nested":
            self.quiet = float(self.then[1])
            self.hold_nested()
        else:
            self.hold()

    def readings(self, *_: str) -> None:
        while True:
            self._read()

    def commands(self) -> None:
        for number in range(1_000_000):
            self.bench.dynamometer.set_speed(25.0 + number % 10)
            self.bench.inverter.set_current(0.8 + 0.1 * (number % 4))
            self._read()

    @step("9.9/2", "Hold, with errors in an inner block that are handled")
    def hold_nested(self) -> None:
        bench, told = self.bench, False
        with bench.dynamometer.driving_speed(30.0), bench.supply.energised(5.0, 1.0):
            while True:
                with suppress(_HandledError), bench.inverter.driving_current(1.0):
                    if not told:
                        told = bool(os.write(1, b"energised\n"))
                        sys.stdin.readline()
                    self._read()
                    raise _HandledError
                # An outer block that goes on without a sign for longer than the guardian gives to an end.
                bench.clock.sleep(self.quiet)
                bench.supply.measure_voltage()
                os.write(1, READING)

    def compute(self) -> None:
        total = 0
        while True:
            total += sum(number * number for number in range(1000))

    def finalizer(self) -> None:
        while True:
            _Finalized(self)
            self._read()

    def weak_callback(self) -> None:
        while True:
            target = _Target()
            kept = weakref.ref(target, lambda _: self._linger())
            del target
            assert kept() is None
            self._read()

    def collector_callback(self) -> None:
        def callback(phase: str, _: object) -> None:
            if phase == "start":
                self._linger()

        gc.callbacks.append(callback)
        try:
            while True:
                gc.collect(0)
                self._read()
        finally:
            gc.callbacks.remove(callback)

    def clock_jumps(self, seed: str) -> None:
        draw = random.Random(int(seed))  # noqa: S311  chance, not secrecy
        wall = _Wall()
        threading.Thread(target=wall.jump_about, args=(draw,), daemon=True).start()
        self.readings()

    def _linger(self) -> None:
        self._read()
        self.bench.clock.sleep(0.2)

    def _read(self) -> None:
        bench = self.bench
        for read in (bench.supply.measure_voltage, bench.inverter.measure_current, bench.dynamometer.measure):
            read()
            os.write(1, READING)


class _Finalized:
    def __init__(self, procedure: Busy) -> None:
        self._procedure = procedure

    def __del__(self) -> None:
        self._procedure._linger()


class _Target:
    pass


class _HandledError(Exception):
    """An error that the procedure knows what to do with."""


class _Wall:
    """The wall's clock of this process, which is put forward and back; the monotonic one goes on, as a computer's does."""

    def __init__(self) -> None:
        self.offset = 0.0
        wall, wall_ns, wall_self = time.time, time.time_ns, self

        class Jumping(datetime):
            @classmethod
            def now(cls, tz: tzinfo | None = None) -> Any:
                return datetime.now(tz) + timedelta(seconds=wall_self.offset)

        time.time = lambda: wall() + self.offset
        time.time_ns = lambda: wall_ns() + int(self.offset * 1e9)
        for name, module in list(sys.modules.items()):
            if name.partition(".")[0] in ("bench", "drivers", "procedures"):
                for key, value in list(vars(module).items()):
                    if value is datetime:
                        setattr(module, key, Jumping)
                    elif value is wall:
                        setattr(module, key, time.time)

    def jump_about(self, draw: random.Random) -> None:
        pause = threading.Event()
        while True:
            self.offset = draw.choice((-1.0, 1.0)) * draw.uniform(0.1, _JUMP)
            pause.wait(draw.uniform(0.01, 0.3))


def hold_busily(station: str, runs: Path, then: tuple[str, ...], resume: str) -> None:
    """Run in a process that was forked for it."""
    faulthandler.register(STACKS, file=2, all_threads=True)
    Hold.runs, Hold.then = runs, then
    wishes = RunRequest(
        procedures=["hold"],
        motor=load_motor("lg-400w"),
        station=station,
        language="en",
        runs=runs,
        operator="virtual",
        resume=existing_run_folder(resume, runs) if resume else None,
    )
    done = run(wishes, {"hold": Busy}, console_on(sys.stderr))
    told: dict[str, Any] = {"status": done.view.status, "cause": done.view.cause}
    os.write(1, b"\n" + json.dumps(told).encode() + b"\n")
