"""Checks of figures without a known true value: one motor on several benches, the same motor again, and other motors."""

from collections.abc import Callable, Collection, Mapping
from itertools import combinations
from typing import Any

from bench.testing import MeasuredRun
from bench.testing.conformance.report import Checks
from procedures.core.parameter_definition import ParameterDefinition
from procedures.core.result import Parameter

#: How far two figures may be apart, by the intervals (95 %) of both; twice is about one false alarm in 10 000.
_TIMES = 2.0
#: Gives the run of one motor on a bench of its own, by its seed, whose instruments err within their data sheets.
Measure = Callable[[int], MeasuredRun]


def check_repeated(
    measure: Measure,
    benches: int,
    checks: Checks,
    gives: Mapping[str, ParameterDefinition],
    names: Collection[str],
    others: Collection[MeasuredRun],
) -> None:
    """Check that figures agree between `benches` within their uncertainty, repeat, and depend on what is measured.

    `names` are those to look at, `others` runs of other motors.
    """
    runs = [measure(number) for number in range(benches)]
    for ran in runs:
        remedy = "Instruments err within their data sheets there: allow for it"
        checks.that("completed on other benches", ran.status == "completed", f"{ran.status}: {ran.cause}", remedy)
    again = measure(0)
    for name in names:
        found = [ran.parameters[name] for ran in runs if name in ran.parameters]
        for one, other in combinations(found, 2):
            _agree(checks, name, one, other)
        first, second = (value_of(ran, name) for ran in (runs[0], again))
        remedy = "Take time from the bench's clock and chance from nowhere: a run can be told again then"
        what = f"{second} instead of {first}"
        checks.that(f"{name}: the same seed gives the same figure", first == second, what, remedy)
        values = {each for ran in (*runs, *others) if (each := value_of(ran, name)) is not None}
        advice = "Estimate it from readings"
        fixed = len(values) == 1 and not gives[name].whole and len(found) + len(others) > 1
        checks.that(f"{name}: rests on what is measured", not fixed, f"{values} of every motor", advice)


def value_of(ran: MeasuredRun, name: str) -> Any:
    """Return a run's figure, None where it has none."""
    return ran.parameters[name].value if name in ran.parameters else None


def _agree(checks: Checks, name: str, one: Parameter, other: Parameter) -> None:
    halves = [max(abs(side - each.value) for side in each.coverage_interval) for each in (one, other)]
    allowed = _TIMES * (halves[0] ** 2 + halves[1] ** 2) ** 0.5
    remedy = "Two benches whose instruments err differently give it: compare its uncertainty with what it rests on"
    checks.close(f"{name}: repeatable within its uncertainty", one.value, other.value, allowed, remedy)
