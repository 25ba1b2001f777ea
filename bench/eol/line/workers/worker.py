"""A socket's process: it tests one motor after the other, each in a run with its journal, and hands their records over."""

import queue
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import replace
from datetime import UTC, datetime
from functools import cached_property
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING

from bench.eol.limits import GuardBand
from bench.eol.line.judging import MotorJudge
from bench.eol.line.motor_record import KeptWaveforms, UnitTest, new_folder, record_of
from bench.eol.line.packing import pack_run
from bench.eol.line.preparation.line_file import station_of
from bench.eol.line.preparation.prepare import operator_of, planned_of
from bench.eol.line.preparation.procedure_times import ProcedureTimes, write_times
from bench.eol.line.workers.instrument_sharing import LeaseDecision, LeaseReply, SocketLeases
from bench.eol.line.workers.messages import (
    FromWorker,
    MotorDone,
    NoMoreMotors,
    Ready,
    Stop,
    Task,
    TimeReached,
    WorkerFailed,
    WorkerSetup,
)
from bench.eol.line.workers.virtual_socket import SocketMotors, VirtualSocket, seed_of
from bench.eol.line.workers.worker_status import WorkerStatus, give_heartbeats
from bench.eol.record import MotorRecord
from bench.i18n.errors import FileError, InputError, at, told
from bench.i18n.language import translator
from bench.journal.disk import StandingReserve
from bench.journal.errors import NoRoomError, RecordError
from bench.run.console import console_on
from bench.run.context import RunContext, station_context
from bench.run.needs import check_needs
from bench.run.plan import Planned
from bench.run.request import RunOptions, RunRequest, UnitReference
from bench.run.run import carry_out
from bench.run.simulation import InProcessSimulation
from bench.run.software import software
from bench.safety.interrupts import Interrupts
from bench.safety.ownership.owner import Owner, Ownership, Unowned
from bench.safety.ownership.state_folder import state_folder
from bench.station.clock import wall_date
from bench.station.library_logs import quieten_libraries
from bench.station.sharing import NotShared, Sharing
from bench.station.station_file import Station
from drivers.interfaces import Clock
from drivers.interfaces.text import text_of
from procedures.core.bench import Role

if TYPE_CHECKING:
    from rich.console import Console

#: A run is stuck that was asked to end so long (s) ago, and what its shutdown may wait besides, and has not.
_OVERDUE = 60.0


def work(connection: Connection, lifeline: int, status: int, owner: int) -> None:
    """Test what the coordinator sends until it sends no more; the others are descriptors of this process.

    `lifeline` is open for as long as this process or its guardian lives, `status` the workers' shared memory, and `owner`
    that of the batch's claims.
    """
    try:
        worker = Worker(connection.recv(), lifeline, status, owner)
    except (EOFError, ConnectionError):
        return
    except InputError as error:
        connection.send(WorkerFailed(text_of(error)))
        return
    channel = Channel(connection, worker.stop)
    worker.channel = channel
    packing: Future[None] | None = None
    with suppress(OSError), ThreadPoolExecutor(1, "packing") as beside:
        channel.send(Ready())
        while (task := channel.task()) is not None:
            done = worker.test(task)
            channel.send(done)
            if packing is not None:
                # One at a time: a disk that is slower than the line is waited for.
                packing.result()
            packing = beside.submit(_pack, done.record)
    worker.reserve.release()


def _pack(record: MotorRecord) -> None:
    # A journal that cannot be packed stays as it is; `eol pack` tries again.
    with suppress(OSError, FileError):
        pack_run(record)


class Channel:
    """A worker's end of the connection to the coordinator, read on a thread of its own whatever the worker is doing.

    `stop` is called there with the reason when the run under way is to end. A coordinator that has gone is a reason too:
    nobody would keep the record.
    """

    def __init__(self, connection: Connection, stop: Callable[[str], None]) -> None:
        self._connection = connection
        self._stop = stop
        self._tasks: queue.SimpleQueue[Task | NoMoreMotors] = queue.SimpleQueue()
        self._replies: queue.SimpleQueue[LeaseReply] = queue.SimpleQueue()
        threading.Thread(target=self._read, name="coordinator", daemon=True).start()

    def task(self) -> Task | None:
        """Return the next motor; None when there are no more."""
        task = self._tasks.get()
        return task if isinstance(task, Task) else None

    def decision(self, ticket: int) -> LeaseDecision:
        """Return the decision on a lease request, when it comes."""
        while (reply := self._replies.get()).ticket != ticket:
            pass
        return reply.decision

    def send(self, message: FromWorker) -> None:
        """Send it to the coordinator. Raises OSError where that has gone."""
        self._connection.send(message)

    def _read(self) -> None:
        try:
            while True:
                self._receive(self._connection.recv())
        except (EOFError, OSError):
            self._stop("the end of the batch's process")
            self._tasks.put(NoMoreMotors())

    def _receive(self, message: object) -> None:
        if isinstance(message, Stop):
            self._stop(message.by)
        elif isinstance(message, LeaseReply):
            self._replies.put(message)
        elif isinstance(message, Task | NoMoreMotors):
            self._tasks.put(message)


class Worker:
    """Tests motors at one socket; `channel` is set before the first."""

    channel: Channel

    def __init__(self, setup: WorkerSetup, lifeline: int, status: int, owner: int) -> None:
        quieten_libraries()
        self._setup, self._batch = setup, setup.batch
        self._shared = frozenset(Role(role) for role in setup.shared)
        self._station = station_of(setup.content, setup.source) if setup.content else None
        twin = station_of(setup.twin_of, setup.source) if setup.twin_of else None
        self._virtual_socket = VirtualSocket(SocketMotors.of(setup.batch), setup.number, self._shared, twin)
        self._lifeline = lifeline
        self._status = WorkerStatus(status, setup.sockets)
        self._owner: Ownership = Unowned()
        if setup.owner_name:
            self._owner = Owner(state_folder(), setup.owner_name, owner)
        known = self._station or twin
        self._catalogues = self._batch.plan.catalogues(known.catalogues if known else None)
        self._versions = software(self._catalogues)
        self._plans: dict[tuple[str, ...], list[Planned]] = {}
        self._interrupts = Interrupts()
        self._stopped = ""
        self._reported_time = 0.0
        self._testing = False
        #: Made and removed with every motor it would cost as much as a commit.
        self.reserve = StandingReserve(Path(setup.batch.folder) / f".reserve-{setup.number}")
        items = self._station.way_down.items if self._station else ()
        self._overdue = _OVERDUE + sum(item.within for item in items if item.measures)
        give_heartbeats(self._status, setup.number, self._stuck)

    @cached_property
    def _console(self) -> "Console":
        return console_on(sys.stderr)

    def stop(self, by: str) -> None:
        """Shut down the present run, from any thread, and begin none after it; the second time in a hurry."""
        if self._stopped:
            self._interrupts.hurry.set()
        self._stopped = by
        self._interrupts.request(by)

    def test(self, task: Task) -> MotorDone:
        """Test one motor; return its record and the line's time at its end. Never raises for what happens there."""
        self._interrupts = Interrupts()
        if self._stopped:
            self._interrupts.request(self._stopped)
        batch = self._batch
        translate = translator(batch.request.language)
        judge = MotorJudge(task.checks, batch.limits, batch.plan.guard, batch.plan.minimum_ratio, translate)
        if task.golden_limits is not None:
            # They follow from what is measured itself, errors included.
            judge = MotorJudge(task.checks, task.golden_limits, GuardBand.SHARED, 0.0, translate)
        test = UnitTest(task, judge, KeptWaveforms(batch.plan.keep_waveforms), datetime.now(UTC))
        self._testing = True
        try:
            self._run(test)
        except (InputError, OSError) as error:
            test.cause = told(error)
            test.unwritten = error if isinstance(error, RecordError | NoRoomError) else None
        except Exception as error:  # noqa: BLE001  one motor's trouble must not end the line
            test.cause = at(type(error).__name__, text_of(error))
        finally:
            self._testing = False
        record = record_of(test, batch, self._setup.name)
        remedy = test.unwritten.remedy if test.unwritten else None
        left_on = test.finished.left_on if test.finished else ()
        return MotorDone(record, task.at + record.bench_time, remedy, left_on)

    def _stuck(self) -> bool:
        return self._testing and self._interrupts.delays().get("started_after", 0.0) > self._overdue

    def _run(self, test: UnitTest) -> None:
        batch, task = self._batch, test.task
        planned = self._planned(task)
        motor = replace(batch.motor, nameplate=replace(batch.motor.nameplate, serial_number=task.serial_number))
        request = RunRequest(
            procedures=[each.name for each in planned],
            motor=motor,
            station=self._setup.source,
            language=batch.request.language,
            runs=Path(batch.folder),
            operator=operator_of(batch.request.operator, self._station),
            person=batch.request.person,
            seed=seed_of(batch.request.seed, task.serial_number, task.number),
        )
        with self._context(task, request) as context:
            times = None
            if batch.request.procedure_times:
                times = ProcedureTimes(test.judge.after, context, lambda: _recording(context))
            check_needs(planned, context.station)
            used = {role for each in planned for role in each.procedure.roles} | context.operator.roles
            test.folder = new_folder(Path(batch.folder), task)
            # What is virtual is not left on by a power cut, and a virtual motor is measured again.
            durable = self._station is not None
            if durable:
                self.reserve.keep()
            options = RunOptions(
                after=times.after if times else test.judge.after,
                procedure_clock=times.clock if times else None,
                warnings=context.station.check_calibrations(wall_date(), used),
                listeners=(test.waveforms.on_event,),
                folder=test.folder,
                versions=self._versions,
                waveforms=test.waveforms,
                lifelines=() if self._station is None else (self._lifeline,),
                durable=durable,
                reserve=self.reserve if durable else None,
                unit=UnitReference(batch.name, task.number, self._setup.name),
                write_result=False,
            )
            test.finished = carry_out(request, planned, context, self._interrupts, options)
            if times:
                write_times(test.folder.path, test.judge.attempts, times.needless)

    def _planned(self, task: Task) -> list[Planned]:
        names = tuple(check.name for check in task.checks)
        if names not in self._plans:
            self._plans[names] = planned_of(task.checks, self._batch.plan.source, self._catalogues.procedures)
        return self._plans[names]

    def _context(self, task: Task, request: RunRequest) -> AbstractContextManager[RunContext]:
        if self._station is not None:
            return self._real_context(self._station, task, request)
        return self._virtual_socket.context(
            task.serial_number,
            request.seed,
            lambda now: self._reach(task.at + now),
            lambda clock: self._sharing(clock, task.at, virtual=True),
        )

    @contextmanager
    def _real_context(self, station: Station, task: Task, request: RunRequest) -> Iterator[RunContext]:
        with station_context(station, request, self._console, self._interrupts) as context:
            yield replace(context, sharing=self._sharing(context.clock, task.at, virtual=False), owner=self._owner)

    def _sharing(self, clock: Clock, offset: float, *, virtual: bool) -> Sharing:
        if not self._shared:
            return NotShared()
        return SocketLeases(self._shared, clock, offset, self.channel.send, self.channel.decision, virtual=virtual)

    def _reach(self, now: float) -> None:
        self._status.reach(self._setup.number, now)
        awaited = self._status.awaited(self._setup.number)
        if awaited and now > awaited != self._reported_time:
            self._reported_time = awaited
            self.channel.send(TimeReached(now))


def _recording(context: RunContext) -> bool:
    """Tell whether a virtual bench's oscilloscope is taking a record."""
    simulation = context.simulation
    if not isinstance(simulation, InProcessSimulation) or "oscilloscope" not in simulation.bench.roles:
        return False
    acquisition = getattr(simulation.bench.instrument("oscilloscope"), "acquisition", None)
    return acquisition is not None and bool(acquisition.state == "SING")
