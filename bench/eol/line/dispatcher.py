"""Gives motors and shared instruments to sockets, in the order of the sockets' times."""

import math
from collections.abc import Sequence
from datetime import UTC, datetime
from time import monotonic

from bench.eol.line.admission.next_motor import Admission
from bench.eol.line.batch_listener import BatchListener
from bench.eol.line.batch_log import BatchLog, BatchMotor
from bench.eol.line.preparation.line_file import ProductionLine
from bench.eol.line.preparation.procedure_order import sampled
from bench.eol.line.stop_request import StopRequest
from bench.eol.line.workers.instrument_sharing import Arbiter, LeaseDecision, LeaseReply, LeaseRequest
from bench.eol.line.workers.messages import NoMoreMotors, Task
from bench.eol.line.workers.worker_slots import WorkerSlot, WorkerSlots
from bench.eol.plan import PlannedCheck


class Dispatcher:
    """Decides by the time (s) that each socket has reached: its bench's on a virtual line, else the wall's."""

    def __init__(
        self,
        line: ProductionLine,
        checks: Sequence[PlannedCheck],
        admission: Admission,
        log: BatchLog,
        listener: BatchListener,
        slots: WorkerSlots,
        stop: StopRequest,
    ) -> None:
        self._checks = tuple(checks)
        self._admission, self._log, self._listener = admission, log, listener
        self._slots, self._status, self._stop = slots, slots.status, stop
        self._virtual, self._timeout = line.is_virtual, line.timeout
        self._start = monotonic()
        self._braked: set[str] = set()
        self._arbiter = Arbiter({number: socket.name for number, socket in enumerate(line.sockets)})

    @property
    def undecided(self) -> bool:
        """Return whether a request waits for its decision."""
        return self._arbiter.waited_for() < math.inf

    def time(self, bench_time: float) -> float:
        """Return the line's time (s) when a bench's is this."""
        return bench_time if self._virtual else monotonic() - self._start

    def request_motor(self, slot: WorkerSlot) -> None:
        """Queue a socket for the next motor; it gets none once the batch is to stop."""
        if self.takes_no_more(slot.name):
            self.dismiss(slot)
            return
        slot.waits_for_motor = True
        self._arbiter.request(slot.number, self.time(slot.time), (), "the next motor")

    def request_lease(self, slot: WorkerSlot, request: LeaseRequest) -> None:
        """Queue a socket for shared instruments."""
        slot.ticket = request.ticket
        time = self.time(request.time)
        self._arbiter.request(slot.number, time, request.instruments, request.purpose, self._timeout)

    def release(self, slot: WorkerSlot, bench_time: float) -> None:
        """Take back the shared instruments that a socket has, or its request for them."""
        self._arbiter.release(slot.number, self.time(bench_time))

    def advance(self, slot: WorkerSlot, bench_time: float) -> None:
        """Note that a virtual bench has reached this time (s)."""
        self._arbiter.advance(slot.number, bench_time)

    def dismiss(self, slot: WorkerSlot) -> None:
        """Send a worker away, and stop waiting for its socket."""
        slot.idle = slot.waits_for_motor = False
        slot.leaving = True
        self._arbiter.leave(slot.number, slot.time)
        slot.process.send(NoMoreMotors())

    def brake(self, socket: str) -> None:
        """Give a socket no more motors, or the whole line where none is named; what is under way comes to its end."""
        self._braked.add(socket)
        self._admission.close(socket)

    def takes_no_more(self, socket: str) -> bool:
        """Tell whether a socket takes no more motors, because the batch is to stop or a brake holds it."""
        return bool(self._stop.by) or bool(self._braked & {"", socket})

    def leave(self, slot: WorkerSlot) -> None:
        """Remove a socket whose worker has ended from all queues; its instruments are free."""
        self._arbiter.leave(slot.number, self.time(self._status.reached(slot.number)))

    def rejoin(self, slot: WorkerSlot, time: float) -> None:
        """Take a socket with a new worker in again at this time (s)."""
        slot.time = time
        self._status.reach(slot.number, time)
        self._arbiter.join(slot.number, self.time(time))

    def dispatch(self) -> None:
        """Give out what can be given now."""
        self._serve_idle()
        while decisions := self._decisions():
            for decision in decisions:
                slot = self._slots.at[decision.socket]
                if slot.waits_for_motor:
                    self._give_motor(slot, decision.at)
                else:
                    slot.process.send(LeaseReply(slot.ticket, decision))

    def _give_motor(self, slot: WorkerSlot, at: float) -> None:
        """Give a socket its motor; without one it is idle, and nobody waits for its time."""
        slot.waits_for_motor = False
        motor = None if self.takes_no_more(slot.name) else self._next_motor(slot.name)
        # What was requested has been decided; it holds nothing.
        self._arbiter.release(slot.number, at)
        if motor is not None:
            slot.task = self._task(motor, slot.name, at)
            slot.started, slot.time = datetime.now(UTC), at
            self._status.reach(slot.number, at)
            self._log.begin(motor, slot.name)
            self._listener.begun(motor, slot.name)
            slot.process.send(slot.task)
        elif self.takes_no_more(slot.name) or self._admission.ended:
            self.dismiss(slot)
        else:
            slot.idle, slot.time = True, at
            self._arbiter.leave(slot.number, at)
            self._tell_golden_due(slot)

    def _task(self, motor: BatchMotor, socket: str, at: float) -> Task:
        """Return the task for a motor; one that is tested again, or to watch the station, has all checks."""
        once = motor.test_number == 1 and not motor.golden
        return Task(
            motor.number,
            motor.serial_number,
            sampled(self._checks, motor.number) if once else self._checks,
            at,
            motor.test_number,
            motor.again_by,
            self._admission.gate.limits(motor.serial_number, socket) if motor.golden else None,
        )

    def _tell_golden_due(self, slot: WorkerSlot) -> None:
        """Say that an idle socket waits for a golden motor, once each time."""
        due = self._admission.gate.due(slot.name)
        if due is not None and not slot.golden_told:
            self._listener.trouble(due)
        slot.golden_told = due is not None

    def _next_motor(self, socket: str) -> BatchMotor | None:
        while (motor := self._admission.take(socket)) is not None:
            if isinstance(motor, BatchMotor):
                return motor
            self._listener.refused(motor)
        return None

    def _serve_idle(self) -> None:
        """Give idle sockets what has come meanwhile."""
        for slot in list(self._slots.at.values()):
            if slot.idle:
                now = self.time(max([slot.time, *(self._status.reached(number) for number in self._slots.at)]))
                slot.idle = False
                self._arbiter.join(slot.number, now)
                self._give_motor(slot, now)

    def _decisions(self) -> list[LeaseDecision]:
        """Return what can be decided now; nothing where a worker must get further first."""
        while True:
            for slot in self._slots.at.values():
                if not slot.idle:
                    self._arbiter.advance(slot.number, self.time(self._status.reached(slot.number)))
            decisions = self._arbiter.decide()
            if decisions or not self._await_times():
                return decisions

    def _await_times(self) -> bool:
        """Have sockets report when they pass the time that others wait for; true where one has passed it meanwhile."""
        awaited = self._arbiter.waited_for()
        if not self._virtual or awaited == math.inf:
            return False
        passed = False
        for slot in self._slots.at.values():
            if slot.task is not None and self._arbiter.reached(slot.number) <= awaited:
                self._status.wait_for(slot.number, awaited or 1e-9)
                passed = passed or self._status.reached(slot.number) > awaited
        return passed
