"""Brake, clutch and coupling of the rotor actuator: they obey some time after they are told."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from enum import IntFlag

from sim_instruments.clock import BenchClock


class Part(IntFlag):
    """What the actuator's outputs move, by the bit of 60FEh and 60FDh; set is closed or engaged."""

    BRAKE = 1 << 16
    CLUTCH = 1 << 17
    COUPLING = 1 << 18


PARTS = (Part.BRAKE, Part.CLUTCH, Part.COUPLING)
#: How long each takes (s), either way.
DELAYS = {Part.BRAKE: 0.05, Part.CLUTCH: 0.08, Part.COUPLING: 0.3}


class Mechanism:
    """Where the parts are; `moved(part, closed)` is asked as one arrives and says whether it could, with `lock` held."""

    def __init__(
        self, clock: BenchClock, lock: AbstractContextManager[object], moved: Callable[[Part, bool], bool]
    ) -> None:
        self._clock = clock
        self._lock = lock
        self._moved = moved
        self.commanded = Part(0)
        self.state = Part(0)
        self._under_way: dict[Part, Callable[[], None]] = {}

    def command(self, wanted: Part) -> None:
        """Have the parts go where the bits say."""
        for part in PARTS:
            closed = part in wanted
            if closed is (part in self.commanded):
                continue
            self.commanded ^= part
            undo = self._under_way.pop(part, None)
            if undo is not None:
                undo()
            if closed is not (part in self.state):
                due = self._clock.now() + DELAYS[part]
                self._under_way[part] = self._clock.call_at(due, self._arrival(part, closed))

    def _arrival(self, part: Part, closed: bool) -> Callable[[], None]:
        def arrive() -> None:
            with self._lock:
                self._arrive(part, closed)

        return arrive

    def _arrive(self, part: Part, closed: bool) -> None:
        self._under_way.pop(part, None)
        before = self.state
        self.state = self.state | part if closed else self.state & ~part
        if not self._moved(part, closed):
            self.state = before
            self.commanded = self.commanded & ~part if closed else self.commanded | part
