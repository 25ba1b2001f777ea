"""The worker processes of a line: one is started for each socket, and one that is frozen, stuck or dead is terminated."""

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from multiprocessing.connection import Connection
from time import monotonic

from bench.eol.line.preparation.line_file import ProductionLine
from bench.eol.line.workers.messages import Batch, Task, WorkerSetup
from bench.eol.line.workers.worker_process import ForkServer, WorkerProcess
from bench.eol.line.workers.worker_status import Heartbeat, WorkerStatus
from bench.safety.ownership.owner import Owner
from drivers.interfaces.text import Text, text

#: How often (s) the workers are looked at, although none has sent anything.
INTERVAL = 0.05
#: A worker without a heartbeat for so long (s) is ended, and so is one that is still there so long after the
#: second request to stop. Its guardian has as long again, before a person is told to look.
_SILENCE_LIMIT, _STOP_LIMIT = 10.0, 15.0
#: A look counts as this long (s) at most: a line that was stopped itself has not seen what heartbeats there were.
_LONGEST_LOOK = 1.0


@dataclass
class WorkerSlot:
    """A socket with its worker: `task` is under way, `time` is the line's (s) at which it is free."""

    number: int
    name: str
    process: WorkerProcess
    ready: bool = False
    task: Task | None = None
    started: datetime = field(default_factory=lambda: datetime.now(UTC))
    time: float = 0.0
    ticket: int = 0
    deaths: int = 0
    #: Its connection has ended; its guardian may still be there.
    dying: bool = False
    idle: bool = False
    waits_for_motor: bool = False
    leaving: bool = False
    #: Whether it was said that a golden motor is due there.
    golden_told: bool = False
    heartbeat: Heartbeat = field(default_factory=Heartbeat)
    #: Why it was ended, and for how long (s) its guardian has not left since.
    ended: Text | str = ""
    unguarded: float = 0.0

    @property
    def source(self) -> Connection | int:
        """The source that becomes readable when the worker sends a message, or has ended, its guardian too."""
        return self.process.lifeline if self.dying else self.process.connection


class WorkerSlots:
    """The line's sockets and their workers, by number in `at`.

    `owner` has the instruments of all sockets, and so have the workers and their guardians; `trouble` is called with what a
    person must see to.
    """

    def __init__(
        self,
        line: ProductionLine,
        batch: Batch,
        fork_server: ForkServer,
        owner: Owner | None,
        trouble: Callable[[Text], None],
    ) -> None:
        self.at: dict[int, WorkerSlot] = {}
        self.status, self._descriptor = WorkerStatus.create(len(line.sockets))
        self._line, self._batch = line, batch
        self._fork_server = fork_server
        self._owner = owner
        self._trouble = trouble
        self._looked = monotonic()
        self._since_second_stop = 0.0

    def start(self, number: int) -> WorkerSlot:
        """Start a socket's worker."""
        socket = self._line.sockets[number]
        self.status.beat(number, 0)
        setup = WorkerSetup(
            batch=self._batch,
            number=number,
            name=socket.name,
            sockets=len(self._line.sockets),
            source=self._line.source,
            content=socket.station.content if socket.station else "",
            shared=tuple(sorted(role.value for role in self._line.shared)),
            owner_name=self._owner.identifier if self._owner else "",
            twin_of=socket.twin_of.content if socket.twin_of else "",
        )
        descriptors = self._owner.descriptors if self._owner else ()
        process = WorkerProcess(self._fork_server, setup, self._descriptor, descriptors)
        slot = self.at[number] = WorkerSlot(number, socket.name, process)
        return slot

    def remove(self, slot: WorkerSlot) -> Text | None:
        """Close a worker's connection and wait for its end; return how that was, None where it left by itself."""
        del self.at[slot.number]
        return slot.process.close()

    def supervise(self, stops: int) -> list[WorkerSlot]:
        """End workers that are frozen or stuck; return those dead whose guardian need not be waited for any more.

        `stops` is how often the batch was requested to stop.
        """
        now = monotonic()
        if now - self._looked < INTERVAL:
            return []
        passed, self._looked = min(now - self._looked, _LONGEST_LOOK), now
        self._since_second_stop += passed if stops > 1 else 0.0
        abandoned = []
        for slot in list(self.at.values()):
            if not slot.dying:
                self._check_heartbeat(slot, passed)
            elif self._guardian_is_late(slot, passed) and self._since_second_stop > _STOP_LIMIT:
                # Nobody is there who could request more.
                abandoned.append(slot)
        return abandoned

    def close(self) -> None:
        """Close what is shared with the workers."""
        self.status.close()
        os.close(self._descriptor)

    def _check_heartbeat(self, slot: WorkerSlot, passed: float) -> None:
        slot.heartbeat.observe(self.status.beats(slot.number), passed)
        if slot.ended:
            return
        if slot.heartbeat.silent > _SILENCE_LIMIT:
            slot.ended = text("did not respond for {time:g} s and ", time=_SILENCE_LIMIT)
        elif self._since_second_stop > _STOP_LIMIT:
            slot.ended = text("had not ended {time:g} s after the second request to stop and ", time=_STOP_LIMIT)
        if slot.ended:
            slot.process.kill()

    def _guardian_is_late(self, slot: WorkerSlot, passed: float) -> bool:
        before, slot.unguarded = slot.unguarded, slot.unguarded + passed
        if before <= _STOP_LIMIT < slot.unguarded:
            self._trouble(
                text(
                    "socket {name}: its process has ended, but its guardian has not ended for {time:g} s; check "
                    "that everything there is off",
                    name=slot.name,
                    time=_STOP_LIMIT,
                )
            )
        return slot.unguarded > _STOP_LIMIT
