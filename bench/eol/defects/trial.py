"""One virtual motor measured by all procedures of a plan, on a virtual bench of its own."""

import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from bench.distribution.work import Task
from bench.eol.defects.cases import DefectCase
from bench.eol.line.judging import MotorJudge, half_width
from bench.eol.line.motor_record import KeptWaveforms
from bench.eol.line.preparation.line_file import station_of
from bench.eol.line.preparation.prepare import planned_of
from bench.eol.line.preparation.procedure_order import sampled
from bench.eol.line.workers.messages import Batch
from bench.eol.line.workers.virtual_socket import SocketMotors, VirtualSocket, seed_of
from bench.i18n.errors import InputError
from bench.journal.run_folder import RunFolder
from bench.run.needs import check_needs
from bench.run.plan import Planned
from bench.run.request import RunOptions, RunRequest
from bench.run.retry_policy import Attempt, Next
from bench.run.run import carry_out
from bench.run.software import check_code, software
from bench.safety.interrupts import Interrupts
from bench.station.library_logs import quieten_libraries
from bench.station.sharing import NotShared
from procedures.core.procedure_error import NotModelledError


@dataclass(frozen=True)
class FigureReading:
    """One figure of a motor: value and expanded uncertainty (95 %) in `unit`."""

    value: float
    expanded: float
    unit: str


@dataclass(frozen=True)
class Attempted:
    """The figures of the last attempt at a procedure, those withheld, and the time (s) of all attempts; `refused` is the reason
    if there are none.

    `unmodelled` says that it was the virtual bench that refused, for what it cannot do: that is nothing against the motor.
    """

    readings: Mapping[str, FigureReading] = field(default_factory=dict)
    withheld: tuple[str, ...] = ()
    duration: float = 0.0
    refused: str = ""
    unmodelled: bool = False


@dataclass(frozen=True)
class MotorTrial:
    """A motor of a case (its number, -1 for a sound one) by what each procedure gave; `number` decides what is sampled.

    `felt` says that its defect had a part in what was measured; `ended` why its run could not be carried through.
    """

    case: int
    number: int
    procedures: Mapping[str, Attempted]
    bench_time: float
    felt: bool = True
    ended: str = ""


@dataclass(frozen=True)
class TrialSetup:
    """The common setup of all motors: the batch, and the text and name of the station whose twin each bench is, if any.

    `code` is the hash of the program that is to measure everywhere, any where it is empty.
    """

    batch: Batch
    cases: tuple[DefectCase, ...]
    twin: str = ""
    source: str = ""
    code: str = ""

    def begin(self) -> Callable[[Task], MotorTrial]:
        """Return what measures a motor on a bench of this process: its case, its number there, and its number of all.

        Raises InputError where this is another program.
        """
        check_code(self.code)
        bench = TrialBench(self)
        return lambda task: bench.measure(*task)


class TrialBench:
    """Measures one motor after the other."""

    def __init__(self, setup: TrialSetup) -> None:
        quieten_libraries()
        self._setup, batch = setup, setup.batch
        self._twin = station_of(setup.twin, setup.source) if setup.twin else None
        catalogues = batch.plan.catalogues(self._twin.catalogues if self._twin else None)
        self._known = catalogues.procedures
        self._versions = software(catalogues)

    def measure(self, case: int, motor: int, number: int) -> MotorTrial:
        """Measure the motor of this number in its case; `number` counts all, and decides which procedures a line samples it by.

        Never raises for what happens there.
        """
        batch = self._setup.batch
        kept = _Kept(MotorJudge(batch.plan.checks, batch.limits, batch.plan.guard, batch.plan.minimum_ratio))
        drawn = f"{self._setup.cases[case].key if case >= 0 else 'sound'} {motor}"
        folder = Path(tempfile.mkdtemp(prefix="motorbench-trial-"))
        felt, ended, time = True, "", 0.0
        try:
            checks = sampled(batch.plan.checks, number)
            planned = planned_of(checks, batch.plan.source, self._known)
            felt, ended, time = self._run(case, drawn, folder, kept, planned)
        except (InputError, OSError) as error:
            ended = str(error)
        except Exception as error:  # noqa: BLE001  one motor's trouble must not end the check
            ended = f"{type(error).__name__}: {error}"
        finally:
            shutil.rmtree(folder, ignore_errors=True)
        return MotorTrial(case, number, kept.last, time, felt, ended)

    def _run(
        self, case: int, drawn: str, folder: Path, kept: "_Kept", planned: Sequence[Planned]
    ) -> tuple[bool, str, float]:
        batch = self._setup.batch
        # Each motor's bench has errors of its own: what a line's sockets differ by is part of what is found.
        seed = seed_of(batch.request.seed, drawn)
        socket = VirtualSocket(replace(SocketMotors.of(batch), seed=seed), 0, (), self._twin)
        request = RunRequest(
            procedures=[each.name for each in planned],
            motor=replace(batch.motor, nameplate=replace(batch.motor.nameplate, serial_number="V")),
            station="virtual",
            language="en",
            runs=folder,
            operator=batch.request.operator,
            seed=seed,
        )
        specimen = self._setup.cases[case].specimen if case >= 0 else None
        with socket.context("V", seed, lambda _: None, lambda _: NotShared(), specimen) as context:
            check_needs(planned, context.station)
            options = RunOptions(
                after=kept.after,
                folder=RunFolder(folder),
                versions=self._versions,
                waveforms=KeptWaveforms("none"),
                durable=False,
                write_result=False,
            )
            done = carry_out(request, planned, context, Interrupts(), options)
            unfelt = len(context.simulation.unfelt_faults())
        faults = len(specimen.faults) if specimen else 0
        ended = "" if done.view.status == "completed" or kept.last else done.view.cause
        return not faults or unfelt < faults, ended, done.view.bench_time


class _Kept:
    """Keeps each procedure's last attempt, and goes on whatever came of it; the plan's repetitions are done."""

    def __init__(self, judge: MotorJudge) -> None:
        self._judge = judge
        self.last: dict[str, Attempted] = {}

    def after(self, attempt: Attempt) -> Next:
        name, before = attempt.planned.name, self.last.get(attempt.planned.name)
        readings = {
            each.name: FigureReading(each.value, half_width(each.coverage_interval), each.unit)
            for each in (attempt.result.parameters if attempt.result else ())
        }
        duration = attempt.ended - attempt.started + (before.duration if before else 0.0)
        # What a procedure promises and does not give is missing as what it withholds is.
        lacking = () if attempt.result is None else tuple(set(attempt.planned.procedure.parameters) - readings.keys())
        self.last[name] = Attempted(
            readings,
            tuple(sorted(lacking)),
            duration,
            "" if attempt.result else attempt.cause,
            isinstance(attempt.error, NotModelledError),
        )
        following = self._judge.after(attempt)
        return Next.GO_ON if following is Next.STOP else following
