"""The statistics of a line: what the database summed up, with what statistics say of it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, time

from sqlalchemy import Connection, Engine

from bench.eol.narrowing import ALL_OF_A_NAME, Narrowing, joined_names
from bench.eol.statistics.association import Association, association
from bench.eol.statistics.capability import Capability, of_moments, spread_within
from bench.eol.statistics.control_chart import Chart, individuals_chart
from bench.eol.statistics.drift import Drift, drift
from bench.eol.statistics.normality import Normality, anderson_darling, bulk
from bench.eol.statistics.percentile_capability import PercentileCapability, by_percentiles, needed, ranks_of
from bench.eol.store.distribution import Distribution, distribution
from bench.eol.store.insertion import settled
from bench.eol.store.motors import figures_of_failed
from bench.eol.store.order_statistics import values_at
from bench.eol.store.records import own_labels
from bench.eol.store.selection import Selection, choose, golden_motors
from bench.eol.store.study import tests_of
from bench.eol.store.tallies import (
    Failures,
    failures_by_parameter,
    failures_by_procedure,
    held_against_limits,
    latest,
    parameters,
    rows_of_neighbours,
    without_compiling,
)
from bench.eol.verdict import Verdict
from bench.eol.yields import SHIFTS, Grouping, MotorYields, motor_yields
from bench.files.toml_file import nearest
from bench.i18n.errors import UsageError
from drivers.interfaces.text import Text, text
from procedures.known_parameters import definition_of
from reports.labels import ParameterLabels

#: Level of significance at which figures are taken not to be normal.
NORMALITY_ALPHA = 0.01
#: What failed most, so many names, is looked for in the other figures.
_FAILURES = 5


@dataclass(frozen=True)
class Yield:
    """Number of tests by verdict, and the yields of the motors that were judged, each counted once."""

    verdicts: Mapping[Verdict, int]
    motors: MotorYields


@dataclass(frozen=True)
class Golden:
    """A golden motor's figures of one parameter at one socket: when (UTC), how much, the drift they show, and their chart (stability).

    Each socket has its own instruments, and drifts by itself.
    """

    serial_number: str
    station: str
    socket: str
    times: tuple[datetime, ...]
    values: tuple[float, ...]
    drift: Drift
    chart: Chart | None


@dataclass(frozen=True)
class ParameterStatistics:
    """One parameter: its distribution, Cp and Cpk by the spread within, Pp and Ppk by the overall one, its chart, golden motors.

    Where the test of normality rejects, `percentiles` has Pp and Ppk in their place, and Cp and Cpk mean nothing.
    `serial_numbers` and `values` are the chart's points, the latest last; `chart` is None where there are fewer than two.
    """

    distribution: Distribution
    normality: Normality
    within: Capability
    overall: Capability
    percentiles: PercentileCapability | None
    serial_numbers: tuple[str, ...]
    values: tuple[float, ...]
    chart: Chart | None
    golden: tuple[Golden, ...]


@dataclass(frozen=True)
class LineStatistics:
    """All of it: which records, yields, what failed, each parameter, those with limits first, and what goes with failures."""

    selection: Selection
    yields: Yield
    by_parameter: tuple[Failures, ...]
    by_procedure: tuple[Failures, ...]
    parameters: Mapping[str, ParameterStatistics]
    associations: tuple[Association, ...]
    #: That several batches of one name are taken together, None where they are not.
    joined: Text | None


@dataclass(frozen=True)
class StatisticsRequest:
    """The records and the statistics requested; every parameter if none is named.

    `last` is the chart's number of points, `rules` are Nelson's where other ones than the usual are to be looked for.
    """

    batches: Sequence[str] = ()
    model: str = ""
    parameters: Sequence[str] = ()
    golden: Sequence[str] = ()
    last: int = 100
    rules: Sequence[int] = ()
    confidence: float = 0.95
    by: Sequence[Grouping] = ()
    shifts: Sequence[time] = SHIFTS
    narrowing: Narrowing = ALL_OF_A_NAME

    def choose(self, connection: Connection, golden: Sequence[str]) -> Selection:
        """Return the records that are wanted, without the `golden` motors. Raises InputError where there are none."""
        narrowed = self.narrowing.condition(connection, self.batches) if self.narrowing.anything else None
        return choose(connection, self.batches, self.model, golden, narrowed)


def line_statistics(engine: Engine, wanted: StatisticsRequest) -> LineStatistics:
    """Return the statistics of a database's records. Raises InputError where there are none, or a name is unknown."""
    with settled(engine) as connection:
        without_compiling(connection)
        wanted = replace(wanted, golden=golden_motors(connection, wanted.golden))
        selection = wanted.choose(connection, wanted.golden)
        names = known_names(connection, wanted.parameters)
        neighbours = rows_of_neighbours(connection, names, selection)
        found = {name: _parameter(connection, name, selection, wanted, neighbours[name]) for name in names}
        statistics = {name: each for name, each in found.items() if each is not None}
        by_parameter = failures_by_parameter(connection, selection)
        by_procedure = failures_by_procedure(connection, selection)
        narrowed = selection.narrowed
        return LineStatistics(
            selection,
            Yield(selection.verdicts, motor_yields(connection, selection, wanted.by, wanted.shifts, wanted.confidence)),
            tuple(by_parameter),
            tuple(by_procedure),
            dict(sorted(statistics.items(), key=lambda item: not _has_limits(item[1]))),
            _associations(connection, selection, by_parameter, by_procedure, statistics, wanted.confidence),
            joined_names(connection, wanted.batches, narrowed),
        )


def measured_parameters(engine: Engine, wanted: StatisticsRequest) -> list[str]:
    """Return the parameters of which the wanted records have figures: those that failed most first, those without limits last.

    Raises InputError as `line_statistics` does.
    """
    with settled(engine) as connection:
        without_compiling(connection)
        selection = wanted.choose(connection, golden_motors(connection, wanted.golden))
        there = [name for name in parameters(connection) if latest(connection, name, selection, 1)]
        worst = [each.name for each in failures_by_parameter(connection, selection) if each.failed]
        judged = {name: held_against_limits(connection, name, selection) for name in there}
        return sorted(there, key=lambda name: (worst.index(name) if name in worst else len(worst), not judged[name]))


def parameter_labels(engine: Engine) -> ParameterLabels:
    """Return what readers call the parameters of the records, as they say or as is known here."""
    with settled(engine) as connection:
        own = own_labels(connection)
        unsaid = [definition_of(name) for name in parameters(connection) if name not in own]
    return ParameterLabels({each.name: each.label.render() for each in unsaid if each is not None} | own)


def known_names(connection: Connection, requested: Sequence[str]) -> list[str]:
    """Return the requested parameters, all that there are where none is. Raises UsageError for one that is not there."""
    known = parameters(connection)
    for name in requested:
        if name not in known:
            raise UsageError(
                text("the records have no parameter {name!r}; {hint}", name=name, hint=nearest(name, known))
            )
    return list(requested) or known


def _parameter(
    connection: Connection,
    name: str,
    selection: Selection,
    wanted: StatisticsRequest,
    rows: Sequence[Sequence[float]],
) -> ParameterStatistics | None:
    figures = distribution(connection, name, selection)
    if figures is None:
        return None
    within, freedom = spread_within(rows)
    points = latest(connection, name, selection, wanted.last)
    values = [value for _, value in points]
    golden = tests_of(connection, name, wanted.golden) if wanted.golden else {}
    moments = (figures.count, figures.mean)
    sample = [value for row in rows for value in row]
    normality = anderson_darling(sample)
    # One motor far off is what a chart is for, and no reason to take its limits away.
    skewed = anderson_darling(bulk(sample)).rejected(NORMALITY_ALPHA)
    other = normality.rejected(NORMALITY_ALPHA)
    possible = _possible(name)
    return ParameterStatistics(
        distribution=figures,
        normality=normality,
        percentiles=_percentiles(connection, figures, selection, wanted.confidence) if other else None,
        within=of_moments(*moments, within, figures.limits, wanted.confidence, freedom=freedom),
        overall=of_moments(*moments, figures.standard_deviation, figures.limits, wanted.confidence),
        serial_numbers=tuple(serial for serial, _ in points),
        values=tuple(values),
        chart=individuals_chart(values, rules=wanted.rules, normal=not skewed, possible=possible)
        if len(values) > 1
        else None,
        golden=tuple(_golden(*there, tests, possible, wanted.confidence) for there, tests in golden.items()),
    )


def _percentiles(
    connection: Connection, figures: Distribution, selection: Selection, confidence: float
) -> PercentileCapability:
    ranks = ranks_of(figures.count, confidence)
    values = values_at(connection, figures, selection, needed(ranks, figures.count))
    return by_percentiles(figures.count, ranks, values, figures.limits)


def _possible(name: str) -> tuple[float, float]:
    """Return the range of a parameter's possible values; all numbers for one that no table has."""
    definition = definition_of(name)
    if definition is None:
        return -math.inf, math.inf
    bounds = definition.bounds
    return bounds.low, math.inf if bounds.high is None else bounds.high


def _has_limits(each: ParameterStatistics) -> bool:
    return math.isfinite(each.distribution.limits.low) or math.isfinite(each.distribution.limits.high)


def _associations(
    connection: Connection,
    selection: Selection,
    by_parameter: Sequence[Failures],
    by_procedure: Sequence[Failures],
    statistics: Mapping[str, ParameterStatistics],
    confidence: float,
) -> tuple[Association, ...]:
    """Return in which figures the motors that failed stand out for certain, by failure, the farthest first."""
    procedures = {each.name for each in by_procedure}
    failed = [each for each in (*by_parameter, *by_procedure) if each.failed]
    worst = sorted(failed, key=lambda each: -each.failed)[:_FAILURES]
    found = []
    for failure in worst:
        for name, values in figures_of_failed(
            connection, selection, failure.name, of_procedure=failure.name in procedures
        ).items():
            if name in statistics and name != failure.name:
                figures = statistics[name].distribution
                moments = (figures.mean, figures.standard_deviation)
                tests = len(worst) * len(statistics)
                each = association(failure.name, name, values, *moments, confidence, tests)
                found += [each] if each is not None and each.certain else []
    order = [failure.name for failure in worst]
    return tuple(sorted(found, key=lambda each: (order.index(each.failure), -abs(each.offset))))


def _golden(
    serial: str,
    station: str,
    socket: str,
    tests: Sequence[tuple[datetime, float]],
    possible: tuple[float, float],
    confidence: float,
) -> Golden:
    times, values = [at for at, _ in tests], [value for _, value in tests]
    chart = individuals_chart(values, possible=possible) if len(values) > 1 else None
    result = drift([at.timestamp() for at in times], values, confidence)
    return Golden(serial, station, socket, tuple(times), tuple(values), result, chart)
