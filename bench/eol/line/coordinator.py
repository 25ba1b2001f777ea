"""The heart of a line: hands out motors, decides who gets what is shared, keeps every record, and outlives its workers."""

import os
import signal
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from multiprocessing.connection import Connection, wait
from time import monotonic
from types import FrameType
from typing import Protocol

from bench.eol.line.admission import Admission, Refused
from bench.eol.line.arbiter import Answer, Arbiter
from bench.eol.line.batch_log import Begun, Ledger
from bench.eol.line.cut_off import cut_off_record
from bench.eol.line.heartbeat import Pulse
from bench.eol.line.line_file import Line
from bench.eol.line.messages import (
    Batch,
    Broken,
    Done,
    FromWorker,
    GaveBack,
    Leave,
    Passed,
    Place,
    Ready,
    Setup,
    Stop,
    Task,
    Told,
    Want,
)
from bench.eol.line.order import sampled
from bench.eol.line.process import Nursery, WorkerProcess
from bench.eol.line.times import Times
from bench.eol.plan import Check
from bench.eol.record import MotorRecord
from bench.eol.store.faults import StoreError
from bench.eol.store.waiting import Waiting
from bench.i18n.errors import InputError, said_by
from bench.safety.ownership.owner import Owner
from drivers.interfaces.text import Text, text

#: A socket whose worker dies this often in a row, with no motor measured meanwhile, is given up.
_DEATHS = 3
#: How often (s) the line looks up although nobody has said anything.
_LOOK = 0.05
#: A worker that gives no sign of life for so long (s) is ended, and so is one that is still there so long after the
#: second wish to stop. Its guardian has as long again, before a person is told to look.
_SILENT, _HURRY = 10.0, 15.0
#: A look counts as this long (s) at most: a line that was stopped itself has not heard what there was.
_LONGEST_LOOK = 1.0
#: How often and for how long (s) a record that the database does not take is tried again.
_TRY, _TRIES = 1.0, 30.0
_SIGNALS: dict[int, str] = {signal.SIGINT: "Ctrl-C", signal.SIGTERM: "SIGTERM", signal.SIGHUP: "SIGHUP"}


class Saves(Protocol):
    """Where records go."""

    def save(self, record: MotorRecord) -> None:
        """Keep a record, durably. Raises StoreError."""


class Hears(Protocol):
    """Who is told of what happens on the line."""

    def begun(self, motor: Begun, socket: str) -> None:
        """Hear that a motor is measured from now on."""

    def done(self, record: MotorRecord) -> None:
        """Hear that a motor's record is kept."""

    def refused(self, refused: Refused) -> None:
        """Hear that a serial number is not measured."""

    def trouble(self, words: Text) -> None:
        """Hear of something that went wrong and concerns no motor's figures."""

    def waits(self, waiting: Waiting) -> None:
        """Hear what of the records waits to be stored or forwarded, at each change and from any thread."""


@dataclass
class _Seat:
    """A socket with its worker: `task` is under way, `time` is the line's (s) at which it is free."""

    number: int
    name: str
    process: WorkerProcess
    ready: bool = False
    task: Task | None = None
    began: datetime = field(default_factory=lambda: datetime.now(UTC))
    time: float = 0.0
    ticket: int = 0
    deaths: int = 0
    dying: bool = False
    idle: bool = False
    waits_for_motor: bool = False
    leaving: bool = False
    pulse: Pulse = field(default_factory=Pulse)
    #: Why it was ended, and for how long (s) its guardian has not left since.
    ended: Text | str = ""
    unguarded: float = 0.0


class Coordinator:
    """Runs one batch; `run` returns when every motor has its record, or the batch was stopped.

    `owner` has the instruments of all sockets, and so have the workers and their guardians.

    Raises InputError where no socket can work, and StoreError where records cannot be kept any more; then no motor that has none
    was called done.
    """

    def __init__(
        self,
        line: Line,
        batch: Batch,
        checks: Sequence[Check],
        admission: Admission,
        keeper: Saves,
        ledger: Ledger,
        ears: Hears,
        nursery: Nursery,
        owner: Owner | None = None,
    ) -> None:
        self._nursery = nursery
        self._owner = owner
        self._line, self._batch, self._checks = line, batch, tuple(checks)
        self._admission, self._keeper, self._ledger, self._ears = admission, keeper, ledger, ears
        self._virtual = line.is_virtual
        self._start = monotonic()
        self._times, self._descriptor = Times.made(len(line.sockets))
        self._arbiter = Arbiter({number: socket.name for number, socket in enumerate(line.sockets)})
        self._seats: dict[int, _Seat] = {}
        self._stopped = ""
        self._stops = 0
        self._looked, self._hurried = self._start, 0.0
        self._wake = os.pipe()
        for end in self._wake:
            os.set_blocking(end, False)

    def run(self) -> str:
        """Measure the batch; return why it was stopped before its end, empty where it was not."""
        try:
            with self._signals():
                for number in range(len(self._line.sockets)):
                    self._seats[number] = self._seat(number)
                while self._seats:
                    self._look()
        finally:
            self._close()
        return self._stopped

    def stop(self, by: str) -> None:
        """Have every socket take its way down and the batch end, from any thread; the second time without waiting."""
        self._stopped = self._stopped or by
        self._stops += 1
        os.write(self._wake[1], b"s")

    # the loop

    def _look(self) -> None:
        heard = wait(self._sources(), timeout=self._patience())
        by_connection: dict[object, _Seat] = {seat.process.connection: seat for seat in self._seats.values()}
        lifelines = {seat.process.lifeline: seat for seat in self._seats.values()}
        for source in heard:
            if source in by_connection:
                self._hear(by_connection[source])
            elif isinstance(source, int) and source in lifelines and lifelines[source].dying:
                self._bury(lifelines[source])
            elif source == self._wake[0]:
                os.read(self._wake[0], 100)
                self._tell_all_to_stop()
        self._look_after_the_silent()
        self._seat_waiting()
        self._decide()

    def _sources(self) -> list[Connection | int]:
        sources: list[Connection | int] = [self._wake[0]]
        for seat in self._seats.values():
            sources.append(seat.process.lifeline if seat.dying else seat.process.connection)
        descriptor = self._admission.descriptor
        if descriptor is not None and any(seat.idle for seat in self._seats.values()):
            sources.append(descriptor)
        return sources

    def _patience(self) -> float | None:
        return _LOOK if self._arbiter.waited_for() < float("inf") else 1.0

    def _hear(self, seat: _Seat) -> None:
        try:
            while seat.process.connection.poll():
                self._take(seat, seat.process.connection.recv())
        except (EOFError, OSError):
            # Its lease goes on until its guardian, too, is done.
            seat.dying = True

    def _take(self, seat: _Seat, message: FromWorker) -> None:
        number = seat.number
        match message:
            case Ready():
                seat.ready = True
                self._next_for(seat)
            case Want():
                seat.ticket = message.ticket
                timeout = self._line.timeout
                self._arbiter.request(number, self._time(message.time), message.wanted, message.purpose, timeout)
            case GaveBack():
                self._arbiter.release(number, self._time(message.time))
            case Passed():
                self._arbiter.advance(number, message.time)
            case Done():
                self._arbiter.release(number, self._time(message.time))
                seat.deaths = 0
                self._finish(seat, message.record, self._time(message.time))
                self._next_for(seat)
            case Broken():
                self._dismiss(seat)
                raise InputError(message.words)

    def _time(self, virtual: float) -> float:
        return virtual if self._virtual else monotonic() - self._start

    # motors

    def _next_for(self, seat: _Seat) -> None:
        """Have a socket get the next motor, in its turn."""
        if self._stopped:
            self._send_away(seat)
            return
        seat.waits_for_motor = True
        self._arbiter.request(seat.number, self._time(seat.time), (), "the next motor")

    def _give_motor(self, seat: _Seat, at: float) -> None:
        """Give a socket its motor; without one it is idle, and nobody waits for its time."""
        seat.waits_for_motor = False
        motor = None if self._stopped else self._admitted()
        # What was asked for has been decided; it holds nothing.
        self._arbiter.release(seat.number, at)
        if motor is None:
            if self._stopped or self._admission.ended:
                self._send_away(seat)
            else:
                seat.idle, seat.time = True, at
                self._arbiter.leave(seat.number, at)
            return
        seat.task = Task(motor.number, motor.serial_number, sampled(self._checks, motor.number), at)
        seat.began, seat.time = datetime.now(UTC), at
        self._times.reach(seat.number, at)
        self._ledger.begin(motor, seat.name)
        self._ears.begun(motor, seat.name)
        seat.process.send(seat.task)

    def _admitted(self) -> Begun | None:
        while (given := self._admission.take()) is not None:
            if isinstance(given, Begun):
                return given
            self._ears.refused(given)
        return None

    def _seat_waiting(self) -> None:
        """Give idle sockets what has come meanwhile."""
        for seat in list(self._seats.values()):
            if seat.idle:
                now = max([seat.time, *(self._times.reached(other) for other in self._seats)])
                seat.idle = False
                self._arbiter.join(seat.number, self._time(now))
                self._give_motor(seat, self._time(now))

    def _finish(self, seat: _Seat, record: MotorRecord, time: float) -> None:
        self._save(record)
        self._admission.done(record.serial_number)
        seat.task, seat.time = None, time
        self._ears.done(record)

    def _save(self, record: MotorRecord) -> None:
        """Keep a record, durably; a database that is busy or full for a while is tried again."""
        until = monotonic() + _TRIES
        told = False
        while True:
            try:
                self._keeper.save(record)
            except StoreError as error:
                if not told:
                    self._ears.trouble(
                        text(
                            "the record of motor {number} ({serial_number}) is not kept yet: {error}",
                            number=record.number,
                            serial_number=record.serial_number,
                            error=said_by(error),
                        )
                    )
                told = True
                if monotonic() > until or self._stopped:
                    raise StoreError(
                        text(
                            "the record of motor {number} ({serial_number}) could not be kept: {error}. Its run is in "
                            "{run}; mend that and begin the batch again: it goes on where it is",
                            number=record.number,
                            serial_number=record.serial_number,
                            error=said_by(error),
                            run=record.run,
                        )
                    ) from error
                wait([self._wake[0]], timeout=_TRY)
            else:
                return

    # what is shared

    def _decide(self) -> None:
        while True:
            self._look_at_times()
            answers = self._arbiter.decide()
            for answer in answers:
                self._tell(answer)
            if not answers and not self._ask_times():
                return

    def _tell(self, answer: Answer) -> None:
        seat = self._seats[answer.socket]
        if seat.waits_for_motor:
            self._give_motor(seat, answer.at)
        else:
            seat.process.send(Told(seat.ticket, answer))

    def _look_at_times(self) -> None:
        for seat in self._seats.values():
            if not seat.idle:
                self._arbiter.advance(seat.number, self._time(self._times.reached(seat.number)))

    def _ask_times(self) -> bool:
        """Have sockets tell when they pass what others wait for; true where one has passed it meanwhile."""
        awaited = self._arbiter.waited_for()
        if not self._virtual or awaited == float("inf"):
            return False
        passed = False
        for seat in self._seats.values():
            if seat.task is not None and self._arbiter.reached(seat.number) <= awaited:
                self._times.wait_for(seat.number, awaited or 1e-9)
                passed = passed or self._times.reached(seat.number) > awaited
        return passed

    # workers

    def _seat(self, number: int) -> _Seat:
        socket = self._line.sockets[number]
        self._times.beat(number, 0)
        place = Place(
            socket=number,
            name=socket.name,
            sockets=len(self._line.sockets),
            source=self._line.source,
            content=socket.station.content if socket.station else "",
            shared=tuple(sorted(role.value for role in self._line.shared)),
            timeout=self._line.timeout,
            lifeline=-1,
            times=-1,
            owner_name=self._owner.identifier if self._owner else "",
        )
        descriptors = self._owner.descriptors if self._owner else ()
        process = WorkerProcess(self._nursery, Setup(self._batch, place), self._descriptor, descriptors)
        return _Seat(number, socket.name, process)

    def _send_away(self, seat: _Seat) -> None:
        seat.leaving = True
        self._arbiter.leave(seat.number, seat.time)
        seat.process.send(Leave())

    def _dismiss(self, seat: _Seat) -> Text | None:
        del self._seats[seat.number]
        self._arbiter.leave(seat.number, self._time(self._times.reached(seat.number)))
        return seat.process.close()

    def _bury(self, seat: _Seat) -> None:
        """Take leave of a worker that has gone, its guardian too: free what it held, keep its motor's record, fill its seat."""
        how = self._dismiss(seat)
        if seat.leaving and seat.task is None:
            return
        how = Text("{why}{how}", {"why": seat.ended, "how": how}) if how else text("left its work")
        if seat.task is not None:
            record = cut_off_record(self._batch, seat.name, seat.task, seat.began, how, stopped=self._stopped)
            self._finish(seat, record, self._times.reached(seat.number))
        self._ears.trouble(text("the process of socket {name} {how}", name=seat.name, how=how))
        deaths = seat.deaths + 1
        if self._stopped:
            return
        if deaths >= _DEATHS:
            words = text(
                "socket {name} is given up: its process died {deaths} times in a row", name=seat.name, deaths=deaths
            )
            self._ears.trouble(words)
            if not self._seats:
                raise InputError(text("{words}, and no other is left", words=words))
            return
        time = seat.time
        fresh = self._seat(seat.number)
        fresh.deaths, fresh.time = deaths, time
        self._seats[seat.number] = fresh
        self._times.reach(seat.number, time)
        self._arbiter.join(seat.number, self._time(time))

    def _look_after_the_silent(self) -> None:
        """End workers that are frozen or stuck, and take leave of those whose guardian does not."""
        now = monotonic()
        if now - self._looked < _LOOK:
            return
        passed, self._looked = min(now - self._looked, _LONGEST_LOOK), now
        self._hurried += passed if self._stops > 1 else 0.0
        for seat in list(self._seats.values()):
            if seat.dying:
                self._wait_for_guardian(seat, passed)
                continue
            seat.pulse.look(self._times.beats(seat.number), passed)
            if seat.ended:
                continue
            if seat.pulse.silent > _SILENT:
                seat.ended = text("gave no sign of life for {time:g} s and ", time=_SILENT)
            elif self._hurried > _HURRY:
                seat.ended = text("had not ended {time:g} s after the second wish to stop and ", time=_HURRY)
            if seat.ended:
                seat.process.kill()

    def _wait_for_guardian(self, seat: _Seat, passed: float) -> None:
        before, seat.unguarded = seat.unguarded, seat.unguarded + passed
        if before <= _HURRY < seat.unguarded:
            self._ears.trouble(
                text(
                    "socket {name}: its process has gone, and its guardian has not left for {time:g} s; see to it that "
                    "everything there is off",
                    name=seat.name,
                    time=_HURRY,
                )
            )
        # Nobody is there who could wish for more.
        if seat.unguarded > _HURRY and self._hurried > _HURRY:
            self._bury(seat)

    # its end

    def _tell_all_to_stop(self) -> None:
        for seat in list(self._seats.values()):
            if seat.task is not None:
                seat.process.send(Stop(self._stopped))
            elif seat.ready and not seat.leaving:
                seat.idle = seat.waits_for_motor = False
                self._send_away(seat)

    @contextmanager
    def _signals(self) -> Iterator[None]:
        if threading.current_thread() is not threading.main_thread():
            yield
            return

        # The byte that makes the loop look up is written by the interpreter.
        before_fd = signal.set_wakeup_fd(self._wake[1], warn_on_full_buffer=False)
        before = {number: signal.signal(number, self._signalled) for number in _SIGNALS}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)
            signal.set_wakeup_fd(before_fd)

    def _signalled(self, number: int, _frame: FrameType | None) -> None:
        # Attributes only: a handler runs between any two steps of this thread, and within another handler.
        self._stopped = self._stopped or _SIGNALS[number]
        self._stops += 1

    def _close(self) -> None:
        for seat in list(self._seats.values()):
            # Its connection ends, and with it its run takes the way down.
            self._dismiss(seat)
        self._times.close()
        os.close(self._descriptor)
        for end in self._wake:
            os.close(end)
