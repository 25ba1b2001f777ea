"""A socket: one motor's passage after the other, each a run with its journal, judged by the plan."""

import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from bench.eol.line.accounting import Accounts, write_times
from bench.eol.line.heartbeat import give_signs
from bench.eol.line.judging import MotorJudge
from bench.eol.line.kept_waveforms import KeptWaveforms
from bench.eol.line.leases import Leases
from bench.eol.line.line_file import station_of
from bench.eol.line.messages import Passed, Setup, Task
from bench.eol.line.motor_record import Passage, record_of
from bench.eol.line.preparation import operator_of, planned_of
from bench.eol.line.times import Times
from bench.eol.line.unit_names import new_folder
from bench.eol.line.virtual_motors import drawn_motor, seed_of
from bench.eol.line.worker_channel import Channel
from bench.eol.record import MotorRecord
from bench.i18n.errors import InputError, message
from bench.i18n.language import translator
from bench.journal.journal import DURABLE
from bench.run.console import console_on
from bench.run.context import Place, place_at
from bench.run.plan import Planned, check_roles
from bench.run.run import How, Wishes, carry_out
from bench.run.software import software
from bench.safety.interrupts import Interrupts
from bench.safety.ownership.owner import Owner, Ownership, Unowned
from bench.safety.ownership.state_folder import state_folder
from bench.station.clock import wall_date
from bench.station.library_logs import quieten_libraries
from bench.station.sharing import Alone, Sharing
from bench.station.station_file import Station
from drivers.interfaces import Clock
from procedures.core.bench import Role

if TYPE_CHECKING:
    from bench.eol.line.virtual_socket import Stations
    from sim_instruments.bench import VirtualBench


#: A run that was asked to end so long (s) ago, and what its way down may wait besides, and has not is stuck.
_OVERDUE = 60.0


class Socket:
    """Measures motors at one socket; `channel` is set before the first."""

    channel: Channel

    def __init__(self, setup: Setup) -> None:
        quieten_libraries()
        self._batch, self._place = setup.batch, setup.place
        self._shared = frozenset(Role(role) for role in setup.place.shared)
        self._station = station_of(setup.place.content, setup.place.source) if setup.place.content else None
        self._times = Times(setup.place.times, setup.place.sockets)
        self._owner: Ownership = Unowned()
        if setup.place.owner_name:
            self._owner = Owner(state_folder(), setup.place.owner_name, setup.place.owner)
        self._versions = software()
        self._plans: dict[tuple[str, ...], list[Planned]] = {}
        self._interrupts = Interrupts()
        self._stopped = ""
        self._told = 0.0
        self._stations: Stations | None = None
        self._measuring = False
        items = self._station.way_down.items if self._station else ()
        self._overdue = _OVERDUE + sum(item.within for item in items if item.measures)
        give_signs(self._times, setup.place.socket, self._stuck)

    def stop(self, by: str) -> None:
        """Have the run under way take its way down, from any thread, and none begin after it; the second time in a hurry."""
        if self._stopped:
            self._interrupts.hurry.set()
        self._stopped = by
        self._interrupts.request(by)

    def measure(self, task: Task) -> tuple[MotorRecord, float]:
        """Measure one motor; return its record and the line's time (s) at its end. Never raises for what happens there."""
        self._interrupts = Interrupts()
        if self._stopped:
            self._interrupts.request(self._stopped)
        batch = self._batch
        judge = MotorJudge(task.checks, batch.limits, batch.plan.guard, batch.plan.minimum_ratio)
        passage = Passage(task, judge, KeptWaveforms(batch.plan.keep_waveforms), datetime.now(UTC))
        self._measuring = True
        try:
            self._run(passage)
        except (InputError, OSError) as error:
            passage.cause = message(error, translator(batch.language))
        except Exception as error:  # noqa: BLE001  one motor's trouble must not end the line
            passage.cause = f"{type(error).__name__}: {error}"
        finally:
            self._measuring = False
        record = record_of(passage, batch, self._place.name)
        return record, task.at + record.bench_time

    def _stuck(self) -> bool:
        return self._measuring and self._interrupts.delays().get("started_after", 0.0) > self._overdue

    def _run(self, passage: Passage) -> None:
        batch, task = self._batch, passage.task
        planned = self._planned(task)
        motor = replace(batch.motor, nameplate=replace(batch.motor.nameplate, serial_number=task.serial_number))
        wishes = Wishes(
            procedures=[each.name for each in planned],
            motor=motor,
            station=self._place.source,
            language=batch.language,
            runs=Path(batch.folder),
            operator=operator_of(batch.operator, self._station),
            person=batch.person,
            seed=seed_of(batch.seed, task.serial_number, task.number),
        )
        with self._where(task, wishes) as where:
            times = Accounts(passage.judge.after, where, lambda: _recording(where)) if batch.accounting else None
            check_roles(planned, where.station)
            used = {role for each in planned for role in each.procedure.roles} | where.operators_roles
            passage.folder = new_folder(Path(batch.folder), task)
            how = How(
                after=times.after if times else passage.judge.after,
                waits=times.clock if times else lambda clock: clock,
                warnings=where.station.check_calibrations(wall_date(), used),
                listeners=(passage.waveforms.hear,),
                folder=passage.folder,
                versions=self._versions,
                waveforms=passage.waveforms.sink,
                lifelines=() if self._station is None else (self._place.lifeline,),
                # What is virtual is not left on by a power cut, and a virtual motor is measured again.
                durable=DURABLE if self._station else frozenset({"run_finished"}),
                reserve=self._station is not None,
                about={"batch": batch.name, "number": task.number, "socket": self._place.name},
                concluded=lambda _folder, _view, _translate: {},
            )
            passage.done = carry_out(wishes, planned, where, self._interrupts, how)
            if times:
                write_times(passage.folder.path, passage.judge.attempts, times.needless)

    def _planned(self, task: Task) -> list[Planned]:
        names = tuple(check.name for check in task.checks)
        if names not in self._plans:
            self._plans[names] = planned_of(task.checks, self._batch.plan.source)
        return self._plans[names]

    def _where(self, task: Task, wishes: Wishes) -> AbstractContextManager[Place]:
        if self._station is not None:
            return self._real(self._station, task, wishes)
        from bench.eol.line.virtual_socket import Stations, units, virtual_place

        self._stations = self._stations or Stations()

        batch, number = self._batch, self._place.socket
        nominal = batch.motor.virtual_motor()
        truth = nominal
        if batch.motor.six_step is None:
            truth, _ = drawn_motor(nominal, batch.plan.spread, seed_of(batch.seed, task.serial_number))

        def sharing(bench: "VirtualBench") -> Sharing:
            return self._leases(bench.clock, task.at, virtual=True)

        return virtual_place(
            truth,
            batch.motor.six_step,
            units(batch.seed, number, self._shared),
            wishes.seed,
            lambda now: self._reach(task.at + now),
            sharing,
            fixture=batch.operator != "virtual",
            station=self._stations.at,
        )

    @contextmanager
    def _real(self, station: Station, task: Task, wishes: Wishes) -> Iterator[Place]:
        with place_at(
            station,
            wishes.motor,
            wishes.operator,
            answers=None,
            seed=wishes.seed,
            console=console_on(sys.stderr),
            language=wishes.language,
            interrupts=self._interrupts,
        ) as where:
            yield replace(where, sharing=self._leases(where.clock, task.at, virtual=False), owner=self._owner)

    def _leases(self, clock: Clock, offset: float, *, virtual: bool) -> Sharing:
        if not self._shared:
            return Alone()
        channel = self.channel
        return Leases(self._shared, clock, offset, channel.send, channel.answer, virtual=virtual)

    def _reach(self, now: float) -> None:
        number = self._place.socket
        self._times.reach(number, now)
        awaited = self._times.awaited(number)
        if awaited and now > awaited != self._told:
            self._told = awaited
            self.channel.send(Passed(now))


def _recording(where: Place) -> bool:
    """Tell whether a virtual bench's oscilloscope is taking a record."""
    from sim_instruments.bench import VirtualBench

    bench = where.in_process
    return isinstance(bench, VirtualBench) and bench.oscilloscope.acquisition.state == "SING"
