"""What a procedure waits for longer than the motor needs: told apart on the virtual bench, where every state can be looked at."""

import json
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from bench.eol.record import CheckRecord
from bench.run.context import Place
from bench.run.retry_policy import After, Attempt, Next
from drivers.interfaces import Clock

#: The file in a run's folder that holds the times.
FILE = "times.json"
#: A wait this short (s) is the interval between two readings.
_INTERVAL = 0.02
#: Looks at the bench during one wait.
_LOOKS = 40
#: What differs less than this from how it is at the wait's end has settled: relative to the largest value, and in A or rad/s.
_CURRENT, _SPEED, _LITTLE = 1.0e-4, 1.0e-3, 1.0e-4


class AccountedClock:
    """A clock for procedures; a wait is needed for as long as currents and speed are not yet what they are at its end.

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
        """Let the time (s) pass in small parts, looking at the bench after each."""
        if seconds <= _INTERVAL or self._measuring():
            self._clock.sleep(max(0.0, seconds))
            return
        began = self.now()
        seen = [tuple(self._state())]
        for look in range(1, _LOOKS + 1):
            self._clock.sleep(max(0.0, began + seconds * look / _LOOKS - self.now()))
            seen.append(tuple(self._state()))
        unsettled = max((look for look, state in enumerate(seen) if not _alike(state, seen[-1])), default=-1)
        self.needless += seconds * (1.0 - (unsettled + 1) / _LOOKS)


class Accounts:
    """The needless time (s) of one motor's procedures, by name; `after` passes on what follows each attempt."""

    def __init__(self, after: After, where: Place, measuring: Callable[[], bool]) -> None:
        self._after = after
        self._clock = AccountedClock(where.clock, lambda: bench_state(where.really()), measuring)
        self._before = 0.0
        self.needless: dict[str, float] = defaultdict(float)

    def clock(self, _: Clock) -> Clock:
        """Return the clock that procedures wait by."""
        return self._clock

    def after(self, attempt: Attempt) -> Next:
        """Enter what the attempt waited needlessly."""
        self.needless[attempt.planned.name] += self._clock.needless - self._before
        self._before = self._clock.needless
        return self._after(attempt)


def bench_state(truth: Mapping[str, Any]) -> tuple[float, ...]:
    """Return the terminals' currents (A) and the shaft's speed (rad/s) from what is really so on a virtual bench."""
    return (*truth["terminal_currents"].values(), truth["shaft_speed"])


def write_times(folder: Path, attempts: Sequence[CheckRecord], needless: Mapping[str, float]) -> None:
    """Write by procedure how long (s) it took in all its attempts, and how much of that was needless."""
    taken: dict[str, float] = defaultdict(float)
    for attempt in attempts:
        taken[attempt.procedure] += attempt.duration
    told = {name: {"time": time, "needless": needless.get(name, 0.0)} for name, time in taken.items()}
    (folder / FILE).write_text(json.dumps(told), encoding="utf-8")


def read_times(folder: Path) -> dict[str, dict[str, float]]:
    """Return what `write_times` wrote."""
    found: dict[str, dict[str, float]] = json.loads((folder / FILE).read_text(encoding="utf-8"))
    return found


def _alike(one: Sequence[float], other: Sequence[float]) -> bool:
    *currents, speed = zip(one, other, strict=True)
    largest = max((abs(a) for pair in currents for a in pair), default=0.0)
    return all(abs(a - b) <= _CURRENT * largest + _LITTLE for a, b in currents) and abs(speed[0] - speed[1]) <= (
        _SPEED * max(abs(speed[0]), abs(speed[1])) + 10.0 * _LITTLE
    )
