"""The time of each procedure, and its needless part: seen on the virtual bench, where every state can be read."""

import json
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from bench.eol.record import CheckRecord
from bench.run.context import RunContext
from bench.run.retry_policy import After, Attempt, Next
from drivers.interfaces import Clock

#: The file in a run's folder that holds the times.
FILE = "times.json"
#: A wait this short (s) is the interval between two readings.
_INTERVAL = 0.02
#: How often the bench's state is read during one wait.
_SAMPLES = 40
#: What differs less than this from how it is at the wait's end has settled: relative to the largest value, and in A or rad/s.
_CURRENT, _SPEED, _FLOOR = 1.0e-4, 1.0e-3, 1.0e-4


class TimedClock:
    """A procedure's clock; a wait is needed for as long as currents and speed are not yet what they are at its end.

    What instruments, drivers, relays and actuators take goes by their own clocks and is all needed; so is what passes while
    something is `measuring`, and the interval between two readings. `state` gives the terminals' currents (A) and the shaft's
    speed (rad/s) now; `needless` is the time (s) waited beyond need.
    """

    def __init__(self, clock: Clock, state: Callable[[], Sequence[float]], measuring: Callable[[], bool]) -> None:
        self._clock = clock
        self._state = state
        self._measuring = measuring
        self.needless = 0.0

    def now(self) -> float:
        """Return the bench time (s)."""
        return self._clock.now()

    def sleep(self, seconds: float) -> None:
        """Wait for a time (s) in small parts, reading the bench's state after each."""
        if seconds <= _INTERVAL or self._measuring():
            self._clock.sleep(max(0.0, seconds))
            return
        began = self.now()
        states = [tuple(self._state())]
        for sample in range(1, _SAMPLES + 1):
            self._clock.sleep(max(0.0, began + seconds * sample / _SAMPLES - self.now()))
            states.append(tuple(self._state()))
        unsettled = max((sample for sample, state in enumerate(states) if not _alike(state, states[-1])), default=-1)
        self.needless += seconds * (1.0 - (unsettled + 1) / _SAMPLES)


class ProcedureTimes:
    """The needless time (s) of one motor's procedures, by name; `after` passes on what follows each attempt."""

    def __init__(self, after: After, context: RunContext, measuring: Callable[[], bool]) -> None:
        self._after = after
        #: What procedures wait by.
        self.clock = TimedClock(context.clock, lambda: bench_state(context.simulation.actual_state()), measuring)
        self._before = 0.0
        self.needless: dict[str, float] = defaultdict(float)

    def after(self, attempt: Attempt) -> Next:
        """Add what the attempt waited needlessly."""
        self.needless[attempt.planned.name] += self.clock.needless - self._before
        self._before = self.clock.needless
        return self._after(attempt)


def bench_state(actual: Mapping[str, Any]) -> tuple[float, ...]:
    """Return the terminals' currents (A) and the shaft's speed (rad/s) from a virtual bench's actual state."""
    return (*actual["terminal_currents"].values(), actual["shaft_speed"])


def write_times(folder: Path, attempts: Sequence[CheckRecord], needless: Mapping[str, float]) -> None:
    """Write by procedure how long (s) it took in all its attempts, and how much of that was needless."""
    taken: dict[str, float] = defaultdict(float)
    for attempt in attempts:
        taken[attempt.procedure] += attempt.duration
    times = {name: {"time": time, "needless": needless.get(name, 0.0)} for name, time in taken.items()}
    (folder / FILE).write_text(json.dumps(times), encoding="utf-8")


def read_times(folder: Path) -> dict[str, dict[str, float]]:
    """Return what `write_times` wrote."""
    times: dict[str, dict[str, float]] = json.loads((folder / FILE).read_text(encoding="utf-8"))
    return times


def _alike(one: Sequence[float], other: Sequence[float]) -> bool:
    *currents, speed = zip(one, other, strict=True)
    largest = max((abs(a) for pair in currents for a in pair), default=0.0)
    return all(abs(a - b) <= _CURRENT * largest + _FLOOR for a, b in currents) and abs(speed[0] - speed[1]) <= (
        _SPEED * max(abs(speed[0]), abs(speed[1])) + 10.0 * _FLOOR
    )
