"""The heart of a line: has its workers test a batch's motors, saves every record, and outlives its workers."""

from collections.abc import Sequence
from multiprocessing.connection import Connection, wait
from pathlib import Path

from bench.eol.line.admission.next_motor import Admission
from bench.eol.line.batch_listener import BatchListener
from bench.eol.line.batch_log import BatchLog
from bench.eol.line.brakes import Brakes, left_on
from bench.eol.line.dispatcher import Dispatcher
from bench.eol.line.motor_record import cut_off_record, left_on_by_guardian
from bench.eol.line.preparation.line_file import ProductionLine
from bench.eol.line.record_writer import RecordDestination, save_with_retries
from bench.eol.line.stop_request import StopRequest
from bench.eol.line.workers.instrument_sharing import LeaseRelease, LeaseRequest
from bench.eol.line.workers.messages import Batch, FromWorker, MotorDone, Ready, Stop, TimeReached, WorkerFailed
from bench.eol.line.workers.worker_process import ForkServer
from bench.eol.line.workers.worker_slots import INTERVAL, WorkerSlot, WorkerSlots
from bench.eol.plan import PlannedCheck
from bench.eol.record import MotorRecord
from bench.i18n.errors import InputError
from bench.safety.ownership.owner import Owner
from drivers.interfaces.text import Text, text

#: A socket whose worker dies this often in a row, with no motor measured meanwhile, is given up.
_DEATHS = 3


class Coordinator:
    """Runs one batch; `run` returns when every motor has its record, or the batch was stopped.

    `owner` has the instruments of all sockets, and so have the workers and their guardians.

    Raises InputError where no socket can work, and StoreError where records cannot be kept any more; then no motor that has none
    was called done.
    """

    def __init__(
        self,
        line: ProductionLine,
        batch: Batch,
        checks: Sequence[PlannedCheck],
        admission: Admission,
        records: RecordDestination,
        log: BatchLog,
        listener: BatchListener,
        fork_server: ForkServer,
        owner: Owner | None = None,
    ) -> None:
        self._batch, self._sockets = batch, len(line.sockets)
        self._admission, self._records, self._listener = admission, records, listener
        self._stop = StopRequest()
        self._slots = WorkerSlots(line, batch, fork_server, owner, listener.trouble)
        self._dispatcher = Dispatcher(line, checks, admission, log, listener, self._slots, self._stop)
        self._brakes = Brakes(batch.plan.brakes)
        self._told = set[str]()

    def run(self) -> str:
        """Measure the batch; return why it was stopped before its end, empty where it was not."""
        try:
            with self._stop.by_signals():
                for number in range(self._sockets):
                    self._slots.start(number)
                while self._slots.at:
                    self._step()
        finally:
            for slot in list(self._slots.at.values()):
                # Its connection ends, and with it its run shuts down.
                self._remove(slot)
            self._slots.close()
            self._stop.close()
        return self._stop.by

    def stop(self, by: str) -> None:
        """Shut down every socket and end the batch, from any thread; the second time without waiting."""
        self._stop.request(by)

    def _step(self) -> None:
        readable = wait(self._sources(), timeout=INTERVAL if self._dispatcher.undecided else 1.0)
        for slot in list(self._slots.at.values()):
            if slot.source in readable:
                if slot.dying:
                    self._reap(slot)
                else:
                    self._receive(slot)
        if self._stop.descriptor in readable:
            self._stop.acknowledge()
            self._stop_all()
        for slot in self._slots.supervise(self._stop.count):
            self._reap(slot)
        self._dispatcher.dispatch()

    def _sources(self) -> list[Connection | int]:
        sources = [self._stop.descriptor, *(slot.source for slot in self._slots.at.values())]
        descriptor = self._admission.descriptor
        if descriptor is not None and any(slot.idle for slot in self._slots.at.values()):
            sources.append(descriptor)
        return sources

    def _receive(self, slot: WorkerSlot) -> None:
        try:
            while slot.process.connection.poll():
                self._handle(slot, slot.process.connection.recv())
        except (EOFError, OSError):
            # Its lease goes on until its guardian, too, is done.
            slot.dying = True

    def _handle(self, slot: WorkerSlot, message: FromWorker) -> None:
        match message:
            case Ready():
                slot.ready = True
                self._dispatcher.request_motor(slot)
            case LeaseRequest():
                self._dispatcher.request_lease(slot, message)
            case LeaseRelease():
                self._dispatcher.release(slot, message.time)
            case TimeReached():
                self._dispatcher.advance(slot, message.time)
            case MotorDone():
                self._dispatcher.release(slot, message.time)
                slot.deaths = 0
                self._finish(slot, message.record, self._dispatcher.time(message.time))
                self._hold_where_on(message.record, message.left_on)
                self._tell_once(message.remedy)
                self._dispatcher.request_motor(slot)
            case WorkerFailed():
                self._remove(slot)
                raise InputError(message.reason)

    def _finish(self, slot: WorkerSlot, record: MotorRecord, time: float) -> None:
        save_with_retries(self._records, record, self._stop, self._listener.trouble)
        self._admission.done(record.serial_number)
        self._admission.gate.done(record)
        slot.task, slot.time = None, time
        self._listener.done(record)
        for brake in self._brakes.observe(record):
            self._dispatcher.brake(brake.socket)
            self._listener.braked(brake)

    def _hold_where_on(self, record: MotorRecord, what: Sequence[str]) -> None:
        if what:
            brake = left_on(record, what)
            self._dispatcher.brake(brake.socket)
            self._listener.braked(brake)

    def _tell_once(self, remedy: Text | None) -> None:
        if remedy is not None and str(remedy) not in self._told:
            self._told.add(str(remedy))
            self._listener.trouble(
                text(
                    "a motor's run could not be written. {remedy}; the same command continues the batch", remedy=remedy
                )
            )

    def _stop_all(self) -> None:
        for slot in list(self._slots.at.values()):
            if slot.task is not None:
                slot.process.send(Stop(self._stop.by))
            elif slot.ready and not slot.leaving:
                self._dispatcher.dismiss(slot)

    def _remove(self, slot: WorkerSlot) -> Text | None:
        self._dispatcher.leave(slot)
        return self._slots.remove(slot)

    def _reap(self, slot: WorkerSlot) -> None:
        """Remove a worker that has gone, its guardian too: free what it held, save its motor's record, start another."""
        how = self._remove(slot)
        if slot.leaving and slot.task is None:
            return
        how = Text("{why}{how}", {"why": slot.ended, "how": how}) if how else text("stopped working")
        if slot.task is not None:
            record = cut_off_record(self._batch, slot.name, slot.task, slot.started, how, stopped=self._stop.by)
            may_be_on = left_on_by_guardian(Path(self._batch.folder), slot.task)
            self._finish(slot, record, self._slots.status.reached(slot.number))
            self._hold_where_on(record, may_be_on)
        deaths = slot.deaths + 1
        over = self._dispatcher.takes_no_more(slot.name)
        words = text("the process of socket {name} {how}", name=slot.name, how=how)
        if not over and deaths < _DEATHS:
            words = text("{words}; a new process takes the socket", words=words)
        self._listener.trouble(words)
        if over:
            return
        if deaths >= _DEATHS:
            words = text(
                "socket {name} is given up: its process died {deaths} times in a row", name=slot.name, deaths=deaths
            )
            self._listener.trouble(words)
            if not self._slots.at:
                raise InputError(text("{words}, and no other socket is left", words=words))
            return
        successor = self._slots.start(slot.number)
        successor.deaths = deaths
        self._dispatcher.rejoin(successor, slot.time)
