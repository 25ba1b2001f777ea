"""For tests of plans and drivers: virtual motors with known true values, measured and judged as on a production line."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from bench.eol.diagnosis.diagnose import diagnose
from bench.eol.diagnosis.diagnosed import Diagnosis
from bench.eol.limits import ParameterLimits
from bench.eol.line.judging import MotorJudge
from bench.eol.line.preparation.prepare import planned_of, prepare
from bench.eol.plan import Plan
from bench.eol.record import CheckRecord, MeasuredFigure
from bench.eol.verdict import Verdict
from bench.files.toml_file import nearest
from bench.i18n.errors import InputError
from bench.journal.run_folder import RunFolder
from bench.motor.motor_file import MotorFile, load_motor
from bench.run.needs import check_needs
from bench.run.plan import Planned, make_plan
from bench.run.request import RunOptions, RunRequest
from bench.run.run import carry_out
from bench.safety.interrupts import Interrupts
from bench.station.library_logs import quieten_libraries
from bench.station.station_file import VIRTUAL
from bench.testing.benches import BenchUnderTest, RequestedBench
from bench.virtual.fault_file import given_faults
from procedures.core.parameter_set import ParameterSet
from procedures.core.result import Parameter, Withheld

__all__ = [
    "BenchUnderTest",
    "Judged",
    "MeasuredRun",
    "PlanUnderTest",
    "RequestedBench",
    "assert_holds_truth",
    "run_planned",
    "run_procedures",
    "virtual_motor",
]


@dataclass(frozen=True)
class MeasuredRun:
    """A run on the virtual bench: how it ended, its results, the true values, and the folder of its record.

    `status` is `completed`, `failed` or `aborted`, `warnings` are the identifiers of what the run warned of, `left` tells what was
    really so on the bench after the shutdown, `withheld` why there is no figure of a parameter that procedures withheld,
    `findings` what else each procedure found.
    """

    status: str
    cause: str
    parameters: Mapping[str, Parameter]
    warnings: tuple[str, ...]
    truth: Mapping[str, float]
    left: Mapping[str, Any]
    folder: RunFolder
    withheld: Mapping[str, tuple[Withheld, ...]] = field(default_factory=dict)
    findings: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


@dataclass(frozen=True)
class Judged:
    """The result of a plan for one motor: verdict, figures with their limits, every attempt, the run, and the defective parts."""

    verdict: Verdict
    first_pass: bool
    figures: Mapping[str, MeasuredFigure]
    attempts: tuple[CheckRecord, ...]
    run: MeasuredRun
    diagnoses: tuple[Diagnosis, ...] = ()


def virtual_motor(reference: str = "lg-400w", **truth: Any) -> MotorFile:
    """Return a shipped motor, or one by its file, with some of its true values changed (fields of VirtualMotor, SI units).

    Raises InputError for a field that it has not.
    """
    motor = load_motor(reference)
    nominal = motor.virtual_motor()
    fields = list(nominal.__dataclass_fields__)
    for name in truth:
        if name not in fields:
            raise InputError(f"a virtual motor has no {name!r}: {nearest(name, fields)}")
    return replace(motor, virtual=replace(nominal, **truth))


def run_procedures(
    names: Sequence[str],
    motor: MotorFile,
    runs: Path,
    *,
    seed: int,
    settings: Mapping[str, object],
    faults: Sequence[str],
    bench: RequestedBench | None = None,
) -> MeasuredRun:
    """Measure a virtual motor by procedures, through the real drivers. Raises InputError for unknown names or settings.

    `bench` says on which bench, a standard one with virtual hands where it is None.
    """
    asked = bench or RequestedBench(operator="virtual")
    planned = make_plan(names, [f"{name}={_toml(value)}" for name, value in settings.items()], asked.procedures())
    return run_planned(planned, motor, runs, seed=seed, faults=faults, bench=asked)


class PlanUnderTest:
    """A user's end-of-line plan, read and checked; `measure` judges virtual motors by it.

    The bench is that of `motorbench eol run` on virtual sockets: with a fixture unless `operator` is virtual, instruments with
    individual errors drawn from the seed, the twins of a `station` file's where one is named.
    """

    def __init__(self, path: Path, runs: Path, *, station: Path | str = VIRTUAL, operator: str = "") -> None:
        prepared = prepare(path, str(station), None, operator)
        self.plan: Plan = prepared.plan
        self.motor = prepared.motor
        self.limits: Mapping[str, ParameterLimits] = prepared.limits
        self._runs = runs
        self._bench = RequestedBench(prepared.line.source, operator, drawn_errors=True)
        known = self.plan.catalogues(prepared.line.catalogues).procedures
        self._planned = planned_of(self.plan.checks, self.plan.source, known)

    def measure(
        self,
        motor: MotorFile | None = None,
        *,
        seed: int = 0,
        faults: Sequence[str] = (),
        disturbances: Path | str | None = None,
        **truth: Any,
    ) -> Judged:
        """Measure and judge one motor: the plan's own type, with some true values changed, or another."""
        if motor is None:
            motor = virtual_motor(self.plan.motor, **truth)
        elif truth:
            raise InputError("give a motor, or true values to change in the plan's own")
        judge = MotorJudge(self.plan.checks, self.limits, self.plan.guard, self.plan.minimum_ratio)
        options = RunOptions(after=judge.after)
        bench = replace(self._bench, disturbances=None if disturbances is None else Path(disturbances))
        ran = run_planned(self._planned, motor, self._runs, seed=seed, faults=faults, options=options, bench=bench)
        found = ParameterSet(dict(ran.parameters), {}, (), dict(ran.withheld))
        figures = {figure.parameter: figure for figure in judge.figures(found)}
        verdict = judge.verdict(figures.values(), aborted=ran.status == "aborted", planned=len(self._planned))
        diagnoses: tuple[Diagnosis, ...] = ()
        if verdict is Verdict.FAIL:
            diagnoses = diagnose(ran.findings, figures.values(), judge.errors, self.motor.nameplate.expected)
        return Judged(verdict, judge.first_pass(verdict), figures, judge.attempts, ran, diagnoses)


def assert_holds_truth(
    found: MeasuredRun | Judged | Mapping[str, Parameter],
    truth: Mapping[str, float] | None = None,
    *,
    names: Iterable[str] | None = None,
    times: float = 2.0,
) -> None:
    """Assert that the 95 % intervals, stretched `times` about their values, contain the true values; with 2, about one in 10 000 does not.

    `names` are the parameters to look at, else all that have a truth; at least one has to.
    Raises AssertionError that lists every miss with value, interval and truth.
    """
    ran = found.run if isinstance(found, Judged) else found
    parameters = ran.parameters if isinstance(ran, MeasuredRun) else ran
    true = truth if truth is not None else ran.truth if isinstance(ran, MeasuredRun) else {}
    looked = list(names) if names is not None else [name for name in parameters if name in true]
    if not looked:
        raise AssertionError("there is nothing to compare: no parameter has a known truth")
    misses = []
    for name in looked:
        if name not in parameters or name not in true:
            misses.append(f"{name}: {'not measured' if name not in parameters else 'no truth is known'}")
            continue
        parameter = parameters[name]
        low, high = (parameter.value + times * (side - parameter.value) for side in parameter.coverage_interval)
        if not low <= true[name] <= high:
            misses.append(
                f"{name} = {parameter.value:.6g} {parameter.unit}, {low:.6g} … {high:.6g} does not hold the truth {true[name]:.6g}"
            )
    if misses:
        raise AssertionError("\n".join(misses))


def run_planned(
    planned: Sequence[Planned],
    motor: MotorFile,
    runs: Path,
    *,
    seed: int,
    faults: Sequence[str] = (),
    options: RunOptions | None = None,
    interrupts: Interrupts | None = None,
    bench: RequestedBench | None = None,
) -> MeasuredRun:
    """Carry out a run on the virtual bench in this process; `interrupts` are what may stop it."""
    quieten_libraries()
    asked = bench or RequestedBench(operator="virtual")
    interrupts = interrupts or Interrupts()
    request = RunRequest(
        [each.name for each in planned],
        motor,
        VIRTUAL,
        "en",
        runs,
        operator=asked.operator,
        seed=seed,
        faults=given_faults(None, faults),
        disturbances=asked.disturbances,
        guardian=False,
    )
    with asked.context(request, interrupts) as context:
        check_needs(planned, context.station)
        done = carry_out(request, planned, context, interrupts, options or RunOptions())
    return MeasuredRun(
        done.view.status,
        done.view.cause,
        done.view.parameters().parameters,
        tuple(notice.identifier for _, notice in done.view.warnings()),
        done.view.truth,
        done.left,
        done.folder,
        done.view.parameters().withheld,
        {name: result.findings for name, result in done.view.finished.items()},
    )


def _toml(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, int | float) else f"'{value}'" if isinstance(value, str) else str(value)
