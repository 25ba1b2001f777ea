"""A watch on a thread, and what it hears and commands there: a clock, instruments and a journal without a bench."""

import os
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

from bench.journal.codec import data_of
from bench.safety.guardian.lateness import RunQueue
from bench.safety.guardian.protocol import encode
from bench.safety.guardian.watch import Watch
from bench.safety.shutdown import Outcome
from bench.safety.shutdown_items import Measured
from bench.station.shutdown_sequence import Item, ShutdownAction, item
from procedures.core.bench import Recorder, Role
from procedures.core.events import Event

ZERO, DISABLE = item(ShutdownAction.COMMAND_ZERO, Role.INVERTER), item(ShutdownAction.DISABLE, Role.INVERTER)
OFF, DECAYED = item(ShutdownAction.OUTPUT_OFF, Role.SUPPLY), item(ShutdownAction.VOLTAGE_DECAYED, Role.SUPPLY)


class Clock:
    """A clock (s) that stands still until it is moved on, and counts how often it was looked at."""

    def __init__(self) -> None:
        self.now = 1000.0
        self._looks = 0

    def __call__(self) -> float:
        self._looks += 1
        return self.now

    def move_on(self, seconds: float) -> None:
        """Move on, and see that the watch has noticed, and has heard what it was told before."""
        self.heard()
        self.now += seconds
        self.heard()

    def heard(self) -> None:
        """Wait until the watch has gone round some times, which takes it some looks each."""
        until, pause = self._looks + 12, threading.Event()
        for _ in range(4000):
            if self._looks >= until:
                return
            pause.wait(0.005)
        raise AssertionError("the watch does not look at its clock")


class Starved(RunQueue):
    """Threads of a run that have waited for a processor for a minute."""

    def waited(self) -> float:
        return 60.0


class Instruments:
    """Counts what is done."""

    def __init__(self, *items: Item) -> None:
        self.items = items or (OFF, DECAYED)
        self.done: list[ShutdownAction] = []
        #: The roles that were commanded.
        self.commanded: list[Role] = []
        self.busy: set[Role] = set()
        #: What a measurement finds wrong, nothing where all is off.
        self.still = ""
        #: How long (s) each measurement was allowed to take.
        self.allowed: list[float] = []

    def is_busy(self, role: Role) -> bool:
        return role in self.busy

    def shut_down(
        self,
        items: Sequence[Item],
        recorder: Recorder,
        *,
        longest: float,
        hurry: bool = False,
        wanted: Callable[[Item], bool] | None = None,
    ) -> list[Outcome]:
        outcomes = []
        for one in items:
            if wanted is None or wanted(one):
                self.done.append(one.do)
                self.commanded.append(one.role)
                found = Measured(0.1, "V") if one.measures else None
                self.allowed += [longest] if one.measures else []
                outcomes.append(Outcome(one, self.still if one.measures else "", found))
        return outcomes


class Journal:
    def __init__(self) -> None:
        self.events: list[tuple[str, dict[str, Any]]] = []

    def record(self, event: Event) -> None:
        self.events.append((event.kind, data_of(event)))


class Watched:
    """A watch on a thread, and the run's end of its pipe."""

    def __init__(
        self,
        *items: Item,
        heartbeat: float = 30.0,
        stalled: float = 30.0,
        record: Recorder | None = None,
        queue: RunQueue | None = None,
    ) -> None:
        self.instruments, self.journal = Instruments(*items), Journal()
        self.said: list[dict[str, Any]] = []
        self.incoming, self.outgoing = os.pipe()
        record = record or self.journal
        queue = queue or RunQueue(os.getpid())
        self.watch = Watch(self.instruments, record, self.incoming, self.said.append, heartbeat, stalled, queue)
        self.thread = threading.Thread(target=self.watch.run)
        self.thread.start()

    def tell(self, *messages: dict[str, Any], **message: Any) -> None:
        """Send messages, all at once."""
        os.write(self.outgoing, b"".join(map(encode, messages or (message,))))

    def ended(self) -> list[str]:
        """Return the causes for which it acted, once it has left."""
        self.thread.join(20.0)
        assert not self.thread.is_alive()
        return [data["cause"] for kind, data in self.journal.events if kind == "took"]

    def until(self, condition: Callable[[], object]) -> None:
        deadline = time.monotonic() + 20.0
        while not condition():
            assert time.monotonic() < deadline, self.said
            self.thread.join(0.005)

    def all_said(self, key: str) -> list[Any]:
        return [message[key] for message in list(self.said) if key in message]

    def await_said(self, key: str) -> Any:
        self.until(lambda: self.all_said(key))
        return self.all_said(key)[0]

    def await_done(self, *items: ShutdownAction) -> None:
        self.until(lambda: len(self.instruments.done) >= len(items))
        assert self.instruments.done == list(items)

    def close(self) -> None:
        for end in (self.incoming, self.outgoing):
            try:
                os.close(end)
            except OSError:
                continue
