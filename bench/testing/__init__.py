"""For tests of other people's plans and drivers: virtual motors whose truth is known, measured and judged as on a line."""

import io
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from bench.eol.limits import ParameterLimits
from bench.eol.line.judging import MotorJudge
from bench.eol.line.preparation import check_parameters, planned_of
from bench.eol.plan import Plan, load_plan
from bench.eol.record import CheckRecord, MeasuredFigure
from bench.eol.verdict import Verdict
from bench.files.toml_file import nearest
from bench.i18n.errors import InputError
from bench.journal.run_folder import RunFolder
from bench.motor.motor_file import MotorFile, load_motor
from bench.plugins.catalogues import installed
from bench.run.console import console_on
from bench.run.context import run_context
from bench.run.needs import check_needs
from bench.run.plan import Planned, make_plan
from bench.run.request import RunOptions, RunRequest
from bench.run.run import carry_out
from bench.safety.interrupts import Interrupts
from bench.station.library_logs import quieten_libraries
from bench.virtual.fault_file import given_faults
from bench.virtual.fault_hooks import inject
from bench.virtual.true_values import true_values
from procedures.core.parameter_set import ParameterSet
from procedures.core.result import Parameter, Withheld
from procedures.known_parameters import known_parameters
from sim_instruments.bench import VirtualBench

if TYPE_CHECKING:
    from pyvisa.resources import MessageBasedResource


@dataclass(frozen=True)
class Ran:
    """A run on the virtual bench: how it ended, what it found, what is true, and where its record lies.

    `status` is `completed`, `failed` or `aborted`, `warnings` are the identifiers of what the run warned of, `left` tells what was
    really so on the bench after the shutdown, `withheld` why there is no figure of a parameter that procedures withheld.
    """

    status: str
    cause: str
    parameters: Mapping[str, Parameter]
    warnings: tuple[str, ...]
    truth: Mapping[str, float]
    left: Mapping[str, Any]
    folder: RunFolder
    withheld: Mapping[str, tuple[Withheld, ...]] = field(default_factory=dict)


@dataclass(frozen=True)
class Judged:
    """What a plan says of one motor: verdict, figures with their limits, every attempt, and the run behind it."""

    verdict: Verdict
    first_pass: bool
    figures: Mapping[str, MeasuredFigure]
    attempts: tuple[CheckRecord, ...]
    run: Ran


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


class BenchUnderTest:
    """A virtual bench in this process, for a driver of one's own: instruments by address, their world, and its truth."""

    def __init__(self, motor: MotorFile, seed: int, faults: Sequence[str]) -> None:
        self._open = ExitStack()
        nominal = motor.virtual_motor()
        self.bench = self._open.enter_context(VirtualBench(nominal, seed=seed, six_step=motor.six_step, sockets=False))
        self.truth = true_values(known_parameters(), nominal, motor.six_step)
        self.inject(*faults)

    def inject(self, *faults: str) -> None:
        """Have faults happen, each in a few words like "supply: silence at 12". Raises InputError for words that say none."""
        inject(given_faults(None, faults), self.bench.injector.add)

    def resource(self, role: str, **options: Any) -> "MessageBasedResource":
        """Open the instrument of a role by PyVISA, as its maker's manual has it; closed at the bench's end."""
        from pyvisa import ResourceManager

        addresses = {name: where for name, where in self.bench.addresses().items() if "::" in str(where)}
        if role not in addresses:
            raise InputError(f"there is no instrument {role!r} with a VISA address: {nearest(role, list(addresses))}")
        opened = ResourceManager(self.bench.visa_library).open_resource(str(addresses[role]), **options)
        self._open.callback(opened.close)
        return cast("MessageBasedResource", opened)

    def close(self) -> None:
        """Close what was opened."""
        self._open.close()


def run_procedures(
    names: Sequence[str],
    motor: MotorFile,
    runs: Path,
    *,
    seed: int,
    settings: Mapping[str, object],
    faults: Sequence[str],
) -> Ran:
    """Measure a virtual motor by procedures, all by the real drivers. Raises InputError for names and settings that are none."""
    planned = make_plan(names, [f"{name}={_toml(value)}" for name, value in settings.items()], installed().procedures)
    return run_planned(planned, motor, runs, seed=seed, faults=faults)


class PlanUnderTest:
    """An end-of-line plan of one's own, read and checked; `measure` judges virtual motors by it."""

    def __init__(self, path: Path, runs: Path) -> None:
        self.plan: Plan = load_plan(path)
        self._runs = runs
        known = self.plan.catalogues().procedures
        self._planned = planned_of(self.plan.checks, self.plan.source, known)
        check_parameters(self.plan, self._planned, known)
        self.motor = load_motor(self.plan.motor, known)
        self.limits: Mapping[str, ParameterLimits] = self.plan.limits(self.motor.nameplate.expected)

    def measure(
        self, motor: MotorFile | None = None, *, seed: int = 0, faults: Sequence[str] = (), **truth: Any
    ) -> Judged:
        """Measure and judge one motor: the plan's own type, with some true values changed, or another."""
        if motor is None:
            motor = virtual_motor(self.plan.motor, **truth)
        elif truth:
            raise InputError("give a motor, or true values to change in the plan's own")
        judge = MotorJudge(self.plan.checks, self.limits, self.plan.guard, self.plan.minimum_ratio)
        options = RunOptions(after=judge.after)
        ran = run_planned(self._planned, motor, self._runs, seed=seed, faults=faults, options=options)
        found = ParameterSet(dict(ran.parameters), {}, (), dict(ran.withheld))
        figures = {figure.parameter: figure for figure in judge.figures(found)}
        verdict = judge.verdict(figures.values(), aborted=ran.status == "aborted", planned=len(self._planned))
        return Judged(verdict, judge.first_pass(verdict), figures, judge.attempts, ran)


def assert_holds_truth(
    found: Ran | Judged | Mapping[str, Parameter],
    truth: Mapping[str, float] | None = None,
    *,
    names: Iterable[str] | None = None,
    times: float = 2.0,
) -> None:
    """Assert that the 95 % intervals, stretched `times` about their values, hold the truth; twice is about one miss in 10 000.

    `names` are the parameters to look at, else all that have a truth; at least one has to.
    Raises AssertionError that lists every miss with value, interval and truth.
    """
    ran = found.run if isinstance(found, Judged) else found
    parameters = ran.parameters if isinstance(ran, Ran) else ran
    true = truth if truth is not None else ran.truth if isinstance(ran, Ran) else {}
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
) -> Ran:
    """Carry out a run on the virtual bench in this process; `interrupts` are what may stop it."""
    quieten_libraries()
    given = given_faults(None, faults)
    interrupts = interrupts or Interrupts()
    request = RunRequest(
        [each.name for each in planned], motor, "virtual", "en", runs, seed=seed, faults=given, guardian=False
    )
    with run_context(request, console_on(io.StringIO()), interrupts) as context:
        check_needs(planned, context.station)
        done = carry_out(request, planned, context, interrupts, options or RunOptions())
    return Ran(
        done.view.status,
        done.view.cause,
        done.view.parameters().parameters,
        tuple(notice.identifier for _, notice in done.view.warnings()),
        done.view.truth,
        done.left,
        done.folder,
        done.view.parameters().withheld,
    )


def _toml(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, int | float) else f"'{value}'" if isinstance(value, str) else str(value)
