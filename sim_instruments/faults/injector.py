"""Brings described faults onto the bench when their time, step or message comes, and mends them."""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from sim_instruments.faults.description import ActiveFault, Description, Mend
from sim_instruments.faults.line_faults import MessageWatch

if TYPE_CHECKING:
    from sim_instruments.faults.target import FaultTarget

State = Literal["waiting", "present", "over"]
#: Hears what becomes of a fault: "fault_began" or "fault_mended", and the fault as it was given.
Listener = Callable[[str, dict[str, Any]], None]


@dataclass
class _Entry:
    described: Description
    state: State = "waiting"
    starts: int = 0
    due: Mend | None = None
    begun: ActiveFault | None = None

    @property
    def felt(self) -> bool:
        return self.begun is not None and self.begun.was_felt()

    def mend(self) -> None:
        if self.state == "present" and self.begun is not None:
            self.begun.mend()


class Injector:
    """The faults of one bench. Bench time moves them, so that nothing depends on the wall's."""

    def __init__(self, bench: "FaultTarget") -> None:
        self._bench = bench
        self._lock = threading.RLock()
        self._entries: list[_Entry] = []
        self._listeners: list[Listener] = []

    def listen(self, listener: Listener) -> None:
        """Add a listener to every fault that begins or ends."""
        self._listeners.append(listener)

    def add(self, described: Description) -> None:
        """Take a fault, for at once or for its time. Raises ValueError where this bench cannot have it."""
        described.check(self._bench)
        entry = _Entry(described)
        with self._lock:
            self._entries.append(entry)
            if described.step is not None:
                return
            if described.message is not None:
                self._watch(entry)
                return
            start = self._bench.clock.now() if described.at is None else described.at
            self._begin_at(entry, start + described.after)

    def step_started(self, step: str, procedure: str = "") -> None:
        """Take note that a procedure begins a step."""
        with self._lock:
            for entry in tuple(self._entries):
                described = entry.described
                if entry.state != "waiting" or described.step != step or entry.due is not None:
                    continue
                if described.procedure is not None and procedure and described.procedure != procedure:
                    continue
                entry.starts += 1
                if entry.starts == described.occurrence:
                    self._begin_at(entry, self._bench.clock.now() + described.after)

    def listed(self) -> list[dict[str, Any]]:
        """Return every fault as it was given, with its state (waiting, present or over) and whether it was felt."""
        with self._lock:
            return [{**entry.described.told(), "state": entry.state, "felt": entry.felt} for entry in self._entries]

    def unfelt(self) -> list[dict[str, Any]]:
        """Return those as they were given that never began, or struck no message."""
        with self._lock:
            return [entry.described.told() for entry in self._entries if not entry.felt]

    def clear(self) -> None:
        """Mend what is there and forget what waits."""
        with self._lock:
            for entry in self._entries:
                if entry.due is not None:
                    entry.due()
                entry.mend()
            self._entries.clear()

    def _watch(self, entry: _Entry) -> None:
        message = entry.described.message
        if message is None:
            raise ValueError(f"{entry.described.fault} waits for no message")
        faults = self._bench.faults(message.role)

        def seen() -> None:
            self._begin_at(entry, self._bench.clock.now() + entry.described.after)

        watch = (
            MessageWatch.on(message.pattern or "", seen)
            if message.count is None
            else MessageWatch.at(message.count, seen)
        )
        faults.watch(watch)
        entry.due = lambda: faults.unwatch(watch)

    def _begin_at(self, entry: _Entry, time: float) -> None:
        with self._lock:
            entry.due = None
            if time <= self._bench.clock.now():
                self._begin(entry)
            else:
                entry.due = self._bench.clock.call_at(time, lambda: self._begin(entry))

    def _begin(self, entry: _Entry) -> None:
        with self._lock:
            entry.due, entry.state = None, "present"
            entry.begun = entry.described.begin(self._bench)
            duration = entry.described.duration
            if duration is not None:
                end = self._bench.clock.now() + duration
                entry.due = self._bench.clock.call_at(end, lambda: self._end(entry))
        self._tell("fault_began", entry)

    def _end(self, entry: _Entry) -> None:
        with self._lock:
            entry.due = None
            entry.mend()
            entry.state = "over"
        self._tell("fault_mended", entry)

    def _tell(self, kind: str, entry: _Entry) -> None:
        for listener in tuple(self._listeners):
            listener(kind, entry.described.told())
