"""Checks of a procedure: results against true values of random motors, its record, and an abort at every step."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from bench.journal.journal import Listener
from bench.motor.motor_file import MotorFile, load_motor
from bench.plugins.catalogues import Catalogues, installed
from bench.run.plan import Planned, make_plan
from bench.run.request import RunOptions
from bench.safety.interrupts import Interrupts
from bench.testing import MeasuredRun, RequestedBench, assert_holds_truth, run_planned
from bench.testing.conformance.repeated import check_repeated
from bench.testing.conformance.report import Checks, ConformanceReport
from bench.testing.conformance.run_record import check_record
from bench.virtual.fault_hooks import StepReporter

#: How far (relative) the values of a random motor lie from the shipped one's.
_SPREAD = 0.2
_VARIED = ("d_axis_inductance", "q_axis_inductance", "flux_linkage", "inertia")
#: What a bench must not be left with.
_ON = ("output_on", "energised", "inverter_enabled", "six_step_enabled", "dynamometer_enabled")
Truth = Callable[[MotorFile], Mapping[str, float]]


def check_procedure(
    name: str,
    runs: Path,
    *,
    motor: str = "lg-400w",
    motors: int = 3,
    benches: int = 3,
    settings: Sequence[str] = (),
    truth: Truth | None = None,
    before: Sequence[str] = (),
    catalogues: Catalogues | None = None,
    seed: int = 0,
) -> ConformanceReport:
    """Check a procedure on `motors` random virtual motors near a shipped one, and abort it at each of its steps.

    `settings` are assignments like "repeats=3". `truth` gives the true values of parameters of its own by name; figures that have
    none are compared between `benches` whose instruments err differently, and the report says that their truth was not looked at.
    `before` are procedures that have to run first. `runs` is the folder that records go to. What is withheld on one motor is no
    mistake, what is given on none is. Raises InputError for a procedure that is not there.
    """
    checks, generator = Checks(), np.random.default_rng(seed)
    known = (catalogues or installed()).procedures
    planned = make_plan([*before, name], list(settings), known)
    gives = known[name].parameters
    steps: list[str] = []
    done: list[MeasuredRun] = []
    compared: set[str] = set()
    for number in range(motors):
        each = random_motor(motor, generator)
        options = RunOptions(listeners=[_noting(name, steps)])
        done.append(run_planned(planned, each, runs, seed=seed + number, options=options))
        compared |= _check_run(done[-1], checks, gives, truth and truth(each))
        check_record(done[-1], checks, name, "after a run")
    given = {each for ran in done for each in gives if each in ran.parameters}
    never = sorted(gives) if not given else []
    remedy = (
        "On a bench without disturbances a figure is withheld by false alarm only: look at its cause and its message"
    )
    checks.that("gives a figure of one motor at least", not never, f"{', '.join(never)}: withheld on every one", remedy)
    checks.that("it has steps", bool(steps), "no step began", "Decorate its methods with @step")
    if unknown := sorted(given - compared):
        sentence = "whether it is true was not checked, for no truth is known: give truth=… to the check"
        checks.unchecked.append(f"{', '.join(unknown)}: {sentence}")
        measure = partial(_on_bench, planned, random_motor(motor, generator), runs, seed)
        check_repeated(measure, benches, checks, gives, unknown, done)
    for step in dict.fromkeys(steps):
        _abort(planned, random_motor(motor, generator), runs, name, step, checks, seed)
    return checks.report(f"{name} (procedure)")


def random_motor(reference: str, generator: np.random.Generator) -> MotorFile:
    """Return a shipped motor with random true values near its own."""
    motor = load_motor(reference)
    nominal = motor.virtual_motor()
    changed: dict[str, Any] = {
        key: getattr(nominal, key) * float(generator.uniform(1.0 - _SPREAD, 1.0 + _SPREAD)) for key in _VARIED
    }
    share = float(generator.uniform(1.0 - _SPREAD, 1.0 + _SPREAD))
    a, b, c = nominal.phase_resistances
    return replace(motor, virtual=replace(nominal, phase_resistances=(a * share, b * share, c * share), **changed))


def _noting(procedure: str, steps: list[str]) -> Listener:
    def begins(step: str, of: str) -> None:
        if of == procedure:
            steps.append(step)

    return StepReporter(begins).hear


def _on_bench(planned: Sequence[Planned], motor: MotorFile, runs: Path, seed: int, number: int) -> MeasuredRun:
    """Return the run of a motor on a bench whose instruments err within their data sheets."""
    bench = RequestedBench(operator="virtual", drawn_errors=True)
    return run_planned(planned, motor, runs, seed=seed + number, bench=bench)


def _check_run(ran: MeasuredRun, checks: Checks, gives: Mapping[str, Any], own: Mapping[str, float] | None) -> set[str]:
    """Check one run; return the figures that were compared with their truth."""
    checks.that("completed", ran.status == "completed", f"{ran.status}: {ran.cause}", "Find out by the run's journal")
    _check_left(ran, checks, "after a run")
    given = [each for each in gives if each in ran.parameters]
    remedy = "Report each parameter"
    withheld = [each for each in gives if each in ran.withheld]
    checks.that("gives what it declares", bool(given or withheld) or not gives, f"none of {sorted(gives)}", remedy)
    true = {**ran.truth, **(own or {})}
    compared = [each for each in given if each in true]
    for each in given:
        declared, found = gives[each], ran.parameters[each]
        checks.that(f"{each}: unit", found.unit == declared.unit, f"{found.unit}", f"It is declared in {declared.unit}")
    for each in compared:
        try:
            assert_holds_truth(ran.parameters, true, names=[each])
        except AssertionError as error:
            checks.that(f"{each}: holds the truth", False, str(error), "Compare estimator, unit and uncertainty")
        else:
            checks.that(f"{each}: holds the truth", True, "", "")
    return set(compared)


def _check_left(ran: MeasuredRun, checks: Checks, when: str) -> None:
    on = [key for key in _ON if ran.left.get(key)]
    remedy = "Switch on in a with block only, and turn the shaft by an action"
    checks.that(f"nothing is left energised {when}", not on, f"{', '.join(on)}", remedy)


def _abort(
    planned: Sequence[Planned], motor: MotorFile, runs: Path, name: str, step: str, checks: Checks, seed: int
) -> None:
    interrupts = Interrupts()

    def begins(found: str, of: str) -> None:
        if of == name and found == step:
            interrupts.request("conformance check")

    options = RunOptions(listeners=[StepReporter(begins).hear])
    ran = run_planned(planned, motor, runs, seed=seed, options=options, interrupts=interrupts)
    remedy = "Let nothing swallow the interruption: no bare except, no loop without an instrument or the clock"
    checks.that(f"aborted at {step}", ran.status == "aborted", f"{ran.status}: {ran.cause}", remedy)
    _check_left(ran, checks, f"after an abort at {step}")
    check_record(ran, checks, name, f"after an abort at {step}")
