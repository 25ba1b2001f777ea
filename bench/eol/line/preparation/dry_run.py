"""A plan tried on virtual benches before a motor comes: how long it takes, what waits for what, which limits cannot be decided."""

import io
import math
import tempfile
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from bench.eol.limits import GuardBand, ParameterLimits, judge, least_ratio
from bench.eol.line.admission.next_motor import RefusedSerial
from bench.eol.line.batch import run_prepared
from bench.eol.line.batch_listener import BatchListener
from bench.eol.line.preparation.line_file import LineSocket, ProductionLine
from bench.eol.line.preparation.prepare import BatchRequest, Prepared, prepare
from bench.eol.line.preparation.procedure_times import read_times
from bench.eol.line.preparation.stored_names import plan_name_fault
from bench.eol.line.workers.worker_process import ForkServer
from bench.eol.plan_file import SpreadSection
from bench.eol.record import MeasuredFigure, MotorRecord
from bench.eol.told_causes import cause_of
from bench.eol.verdict import Verdict
from bench.i18n.errors import InputError, at
from bench.i18n.language import translator
from bench.journal.journal_file import read_journal
from bench.journal.run_folder import RunFolder
from bench.journal.run_view import view_of
from bench.rehearsal.assumed import completed
from bench.rehearsal.counterparts import counterparts_of
from drivers.interfaces.text import Text, text, word
from procedures.verification.verified_channels import RANGE_WARNING
from reports.labels import ParameterLabels


@dataclass(frozen=True)
class ProcedureTime:
    """A procedure's mean time (s), and what of it instruments, actuators and the motor need."""

    procedure: str
    time: float
    floor: float

    @property
    def overhead(self) -> float:
        """The time beyond its floor, relative to the floor."""
        return self.time / self.floor - 1.0 if self.floor > 0.0 else 0.0


@dataclass(frozen=True)
class LimitFinding:
    """A finding about a limit: the figure of a motor of the type, its expanded uncertainty (95 %), and the problem."""

    parameter: str
    unit: str
    value: float
    expanded: float
    low: float
    high: float
    ratio: float
    fault: Text | None


@dataclass(frozen=True)
class DryRun:
    """The result of a plan's dry run: `cycle` (s) is a motor's mean time at its socket, of which it `waits` for what others have.

    A procedure of every n-th motor counts with an n-th of its time. `aside` (s) is the shutdown and what else is no procedure's;
    the floor has it. Each socket's first motor does not count for the waits: all sockets begin at once then, and never again.
    `per_hour` is what the line of all sockets measures; `troubles` are causes of motors that did not pass, `differences` those
    between the station and what stood for it, `unverified` figures that rest on records in ranges which the plan does not verify,
    `notes` what of the plan is allowed and likely a mistake.
    """

    plan: str
    sockets: int
    motors: int
    cycle: float
    floor: float
    waits: float
    aside: float
    per_hour: float
    procedures: tuple[ProcedureTime, ...]
    limits: tuple[LimitFinding, ...]
    troubles: tuple[Text, ...] = ()
    assumed: tuple[str, ...] = ()
    differences: tuple[str, ...] = ()
    unverified: tuple[Text, ...] = ()
    notes: tuple[Text, ...] = ()
    labels: ParameterLabels = field(default_factory=lambda: ParameterLabels({}))

    @property
    def overhead(self) -> float:
        """The time that software adds to a cycle, relative to the floor; waiting for other sockets apart."""
        return (self.cycle - self.waits) / self.floor - 1.0 if self.floor > 0.0 else 0.0

    @property
    def over_floor(self) -> float:
        """The cycle over its floor, waiting included."""
        return self.cycle / self.floor if self.floor > 0.0 else 1.0

    @property
    def good(self) -> bool:
        """Return whether every limit can be decided and a motor of the type passes."""
        return not self.troubles and all(not limit.fault for limit in self.limits)

    def as_dict(self) -> dict[str, Any]:
        """Return it in JSON's types."""
        content = asdict(self)
        del content["labels"]
        content["limits"] = [{**asdict(each), "fault": str(each.fault or "")} for each in self.limits]
        content["unverified"] = [str(each) for each in self.unverified]
        content["troubles"] = [each.render(translator("en")) for each in self.troubles]
        content["notes"] = [str(each) for each in self.notes]
        content["procedures"] = [{**asdict(each), "overhead": each.overhead} for each in self.procedures]
        return content | {"overhead": self.overhead, "over_floor": self.over_floor, "good": self.good}


def dry_run(
    request: BatchRequest,
    fork_server: ForkServer | None = None,
    progress: Callable[[int, int], None] = lambda _done, _all: None,
) -> DryRun:
    """Measure some motors exactly of the type by the plan; nothing of the station is opened, nothing is kept; `fork_server` as for a batch.

    `progress` hears how many of all are done.

    Raises InputError for a plan, motor or station that is not right, KeyboardInterrupt where it was stopped.
    """
    prepared, assumed = virtually(prepare(request.plan, request.station, request.sockets, request.operator))
    # Said before anything is measured: what cannot stand for an instrument is refused here.
    differences = tuple(dict.fromkeys(_differences(prepared.line)))
    sockets = len(prepared.line.sockets)
    # Sampling tests come with the first motor, the most that one can take.
    motors = 3 * sockets if request.motors is None else request.motors
    listener = _DryRunListener(lambda done: progress(done, motors))
    with tempfile.TemporaryDirectory(prefix="motorbench-check-") as folder:
        tried = replace(
            request,
            runs=Path(folder),
            batch="check",
            serials="",
            motors=motors,
            records=str(Path(folder) / "records.sqlite"),
            procedure_times=True,
        )
        _, stopped = run_prepared(prepared, tried, listener, io.StringIO(), fork_server)
        if stopped:
            # The times of a part would be taken for the plan's.
            raise KeyboardInterrupt
        return _summary(prepared, listener.records, assumed, differences)


def virtually(prepared: Prepared) -> tuple[Prepared, tuple[str, ...]]:
    """Return the same plan on as many virtual benches, for motors that do not differ; and what was assumed of the motor."""
    line, (motor, assumed) = prepared.line, completed(prepared.motor)
    sockets = tuple(LineSocket(socket.name, None, socket.station) for socket in line.sockets)
    plan = replace(
        prepared.plan,
        spread=SpreadSection(),
        serial_pattern=r"V\d{6}",
        keep_waveforms="none",
        # One that fails must not hide the others.
        checks=tuple(replace(check, on_failure="go_on") for check in prepared.plan.checks),
        plugins=prepared.plan.plugins.model_copy(update={"records": []}),
    )
    return replace(prepared, plan=plan, motor=motor, line=replace(line, sockets=sockets)), assumed


def _summary(
    prepared: Prepared, records: Sequence[MotorRecord], assumed: tuple[str, ...], differences: tuple[str, ...]
) -> DryRun:
    times: dict[str, float] = defaultdict(float)
    needless: dict[str, float] = defaultdict(float)
    count = Counter[str]()
    for record in records:
        for name, taken in read_times(Path(record.run)).items() if record.run else ():
            times[name] += taken["time"]
            needless[name] += taken["needless"]
            count[name] += 1
    procedures = tuple(
        ProcedureTime(check.name, times[check.name] / n, (times[check.name] - needless[check.name]) / n)
        for check in prepared.plan.checks
        if (n := count[check.name])
    )
    shares = {check.name: 1.0 / check.every for check in prepared.plan.checks}
    working = sum(each.time * shares[each.procedure] for each in procedures)
    needed = sum(each.floor * shares[each.procedure] for each in procedures)
    sockets = len(prepared.line.sockets)
    # What is no procedure's: the shutdown, which every motor has, and waiting for others, which the luckiest has not.
    beside = [record.bench_time - sum(check.duration for check in record.checks) for record in _settled(records)]
    aside = min(beside, default=0.0)
    waits = sum(beside) / max(1, len(beside)) - aside
    cycle = working + aside + waits
    return DryRun(
        plan=prepared.plan.name,
        sockets=sockets,
        motors=len(records),
        cycle=cycle,
        floor=needed + aside,
        waits=waits,
        aside=aside,
        per_hour=3600.0 * sockets / cycle if cycle > 0.0 else 0.0,
        procedures=procedures,
        limits=tuple(_limits(prepared, records)),
        troubles=tuple({record.cause: cause_of(record) for record in records if record.cause}.values()),
        assumed=assumed,
        differences=differences,
        unverified=tuple(_unverified(records)),
        notes=(*prepared.notes, *filter(None, [plan_name_fault(prepared.plan)])),
        labels=prepared.labels,
    )


def _settled(records: Sequence[MotorRecord]) -> list[MotorRecord]:
    """Return the records without each socket's first, where there are others."""
    seen = set[str]()
    later = []
    for record in records:
        if record.socket in seen:
            later.append(record)
        seen.add(record.socket)
    return later or list(records)


def _differences(line: ProductionLine) -> Iterator[str]:
    """Say what stands for the instruments of the line's stations, where that is not their own counterpart."""
    for socket in line.sockets:
        for counterpart in (counterparts_of(socket.twin_of) if socket.twin_of else {}).values():
            yield from (str(difference) for difference in counterpart.differences)


def _unverified(records: Sequence[MotorRecord]) -> Iterator[Text]:
    """Say which procedures' figures rest on records in ranges that were not verified, each once."""
    told = set[str]()
    for record in records:
        if not record.run:
            continue
        for procedure, notice in view_of(read_journal(RunFolder(Path(record.run)).journal).events).warnings():
            if notice.identifier == RANGE_WARNING and procedure not in told:
                told.add(procedure)
                yield at(word(procedure), notice.message)


def _limits(prepared: Prepared, records: Sequence[MotorRecord]) -> list[LimitFinding]:
    findings = []
    for parameter, bounds in sorted(prepared.limits.items()):
        figures = [figure for record in records for figure in record.measured if figure.parameter == parameter]
        nothing = LimitFinding(parameter, "", math.nan, math.nan, bounds.low, bounds.high, math.nan, None)
        if any(figure.verdict is Verdict.NOT_JUDGED for figure in figures):
            fault = text("not judged: the figure was withheld")
            findings.append(replace(nothing, unit=figures[0].unit, fault=fault))
        elif figures:
            findings.append(_finding(prepared, bounds, max(figures, key=lambda figure: figure.expanded)))
        else:
            findings.append(replace(nothing, fault=text("it was not measured")))
    return findings


def _finding(prepared: Prepared, bounds: ParameterLimits, figure: MeasuredFigure) -> LimitFinding:
    plan, expanded = prepared.plan, figure.expanded
    ratio = (
        bounds.within(prepared.parameters[figure.parameter].bounds).tolerance / (2.0 * expanded)
        if expanded
        else math.inf
    )
    least, fault = least_ratio(plan.guard, plan.minimum_ratio, bounds), None
    if figure.verdict is not Verdict.ERROR and not bounds.low <= figure.value <= bounds.high:
        fault = text("a motor of the type lies outside")
    elif ratio < least:
        fault = text(
            "undecidable: the tolerance is {ratio:.2g} times the 95 % interval's width, {least:g} are asked for",
            ratio=ratio,
            least=least,
        )
    elif plan.guard is GuardBand.STRICT and ratio <= 1.0:
        fault = text("the guard bands leave nothing to accept")
    elif judge(figure.value, expanded, bounds, plan.guard).verdict is not Verdict.PASS:
        fault = text("a motor of the type lies nearer to the limit than the guard band")
    return LimitFinding(figure.parameter, figure.unit, figure.value, expanded, bounds.low, bounds.high, ratio, fault)


class _DryRunListener(BatchListener):
    def __init__(self, progress: Callable[[int], None]) -> None:
        self.records: list[MotorRecord] = []
        self._progress = progress

    def done(self, record: MotorRecord) -> None:
        self.records.append(record)
        self._progress(len(self.records))

    def refused(self, refused: RefusedSerial) -> None:
        raise InputError(refused.why)

    def trouble(self, words: Text) -> None:
        raise InputError(words)
