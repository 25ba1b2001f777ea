"""A socket: one motor's passage after the other, each a run with its journal, judged by the plan."""

import shutil
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.clock import wall_date
from bench.commands.output import console_on
from bench.eol.line.channel import Channel
from bench.eol.line.judging import MotorJudge, described
from bench.eol.line.leases import Leases
from bench.eol.line.line_file import station_of
from bench.eol.line.messages import Passed, Setup, Task
from bench.eol.line.passage_names import identifier, new_folder
from bench.eol.line.preparation import planned_of
from bench.eol.line.times import Times
from bench.eol.line.virtual_motors import drawn_motor, seed_of
from bench.eol.record import Measured, MotorRecord
from bench.eol.verdict import Verdict
from bench.errors import InputError
from bench.files.station import Station
from bench.plan import Planned, check_roles
from bench.record.run_folder import RunFolder
from bench.record.waveforms import NoWaveforms, WaveformFolder
from bench.safety.interrupts import Interrupts
from bench.session import Finished, How, Wishes, carry_out, quieten_libraries
from bench.sharing import Alone, Sharing
from bench.software import software
from bench.surroundings import Place, place_at
from drivers.interfaces import Clock
from procedures.bench import Role

if TYPE_CHECKING:
    from sim_instruments.bench import VirtualBench


class Socket:
    """Measures motors at one socket; `channel` is set before the first."""

    channel: Channel

    def __init__(self, setup: Setup) -> None:
        quieten_libraries()
        self._batch, self._place = setup.batch, setup.place
        self._shared = frozenset(Role(role) for role in setup.place.shared)
        self._station = station_of(setup.place.content, setup.place.source) if setup.place.content else None
        self._times = Times(setup.place.times, setup.place.sockets)
        self._versions = software()
        self._plans: dict[tuple[str, ...], list[Planned]] = {}
        self._interrupts = Interrupts()
        self._stopped = ""
        self._told = 0.0

    def stop(self, by: str) -> None:
        """Have the run under way take its way down, from any thread, and none begin after it."""
        self._stopped = by
        self._interrupts.request(by)

    def measure(self, task: Task) -> tuple[MotorRecord, float]:
        """Measure one motor; return its record and the line's time (s) at its end. Never raises for what happens there."""
        self._interrupts = Interrupts()
        if self._stopped:
            self._interrupts.request(self._stopped)
        batch = self._batch
        judge = MotorJudge(task.checks, batch.limits, batch.plan.guard, batch.plan.minimum_ratio)
        passage = _Passage(task, judge, Path(batch.folder), datetime.now(UTC))
        try:
            planned = self._planned(task)
            passage.planned = len(planned)
            motor = replace(batch.motor, nameplate=replace(batch.motor.nameplate, serial_number=task.serial_number))
            wishes = Wishes(
                procedures=[each.name for each in planned],
                motor=motor,
                station=self._place.source,
                language=batch.language,
                runs=Path(batch.folder),
                operator=batch.operator,
                person=batch.person,
                seed=seed_of(batch.seed, task.serial_number, task.number),
            )
            with self._where(task, wishes) as where:
                check_roles(planned, where.station)
                used = {role for each in planned for role in each.procedure.roles}
                folder = passage.make_folder()
                how = How(
                    after=judge.after,
                    warnings=where.station.check_calibrations(wall_date(), used),
                    listeners=(passage.hear,),
                    folder=folder,
                    versions=self._versions,
                    lifelines=(self._place.lifeline,),
                    waveforms=NoWaveforms if batch.plan.keep_waveforms == "none" else WaveformFolder,
                    about={"batch": batch.name, "number": task.number, "keep_waveforms": batch.plan.keep_waveforms},
                )
                passage.done = carry_out(wishes, planned, where, self._interrupts, how)
        except (InputError, OSError) as error:
            passage.cause = str(error)
        except Exception as error:  # noqa: BLE001  one motor's trouble must not end the line
            passage.cause = f"{type(error).__name__}: {error}"
        record = self._record(passage)
        self._tidy(record, passage)
        return record, task.at + record.bench_time

    def _planned(self, task: Task) -> list[Planned]:
        names = tuple(check.name for check in task.checks)
        if names not in self._plans:
            self._plans[names] = planned_of(task.checks, self._batch.plan.source)
        return self._plans[names]

    def _where(self, task: Task, wishes: Wishes) -> AbstractContextManager[Place]:
        if self._station is not None:
            return self._real(self._station, task, wishes)
        from bench.eol.line.virtual_socket import units, virtual_place

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
            yield replace(where, sharing=self._leases(where.clock, task.at, virtual=False))

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

    def _record(self, passage: "_Passage") -> MotorRecord:
        batch, task, judge, done = self._batch, passage.task, passage.judge, passage.done
        figures: tuple[Measured, ...] = ()
        bench_time, cause, aborted = 0.0, passage.cause, False
        if done is not None:
            figures = tuple(judge.measured(p) for p in done.view.parameters().parameters.values())
            bench_time, aborted = done.view.bench_time, done.view.status == "aborted"
            cause = cause or done.view.cause
        verdict = judge.verdict(figures, aborted=aborted, planned=passage.planned)
        if passage.cause and verdict is Verdict.PASS:
            verdict = Verdict.ERROR
        return MotorRecord(
            identifier=identifier(batch.uid, task.number),
            batch=batch.name,
            number=task.number,
            plan=batch.plan.name,
            plan_sha256=batch.plan.sha256,
            station=batch.line,
            socket=self._place.name,
            person=batch.person,
            model=batch.motor.nameplate.name,
            serial_number=task.serial_number,
            started=passage.started,
            ended=datetime.now(UTC),
            verdict=verdict,
            first_pass=judge.first_pass(verdict),
            bench_time=bench_time,
            measured=figures,
            checks=judge.attempts,
            cause="" if verdict is Verdict.PASS else _cause(judge, figures, cause),
            run=str(passage.folder.path) if passage.folder else "",
            journal_sha256=done.journal_sha256 if done else "",
            waveforms=passage.waveforms if self._keeps(verdict) else {},
        )

    def _keeps(self, verdict: Verdict) -> bool:
        return self._batch.plan.keep_waveforms == "all" or (
            self._batch.plan.keep_waveforms == "failed" and verdict is not Verdict.PASS
        )

    def _tidy(self, record: MotorRecord, passage: "_Passage") -> None:
        if passage.folder is not None and not self._keeps(record.verdict):
            shutil.rmtree(passage.folder.waveforms, ignore_errors=True)


@dataclass
class _Passage:
    """What is known of one motor's passage so far; `hear` takes the journal's events."""

    task: Task
    judge: MotorJudge
    runs: Path
    started: datetime
    planned: int = 0
    folder: RunFolder | None = None
    done: Finished | None = None
    cause: str = ""
    waveforms: dict[str, str] = field(default_factory=dict)

    def make_folder(self) -> RunFolder:
        """Make the run's folder. Raises OSError."""
        self.folder = new_folder(self.runs, self.task)
        return self.folder

    def hear(self, kind: str, data: Mapping[str, Any]) -> None:
        """Note the waveforms' files."""
        if kind == "waveforms" and data["file"]["path"]:
            self.waveforms[data["file"]["path"]] = data["file"]["sha256"]


def _cause(judge: MotorJudge, figures: Sequence[Measured], cause: str) -> str:
    """Return why a motor did not pass: what its last attempts said, then its figures, then what ended the run."""
    last = {attempt.procedure: attempt.cause for attempt in judge.attempts}
    said = [f"{procedure}: {words}" for procedure, words in last.items() if words]
    if not said:
        said = [described(figure) for figure in figures if figure.verdict is not Verdict.PASS]
    return "; ".join(said) or cause
