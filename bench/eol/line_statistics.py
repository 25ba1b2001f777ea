"""The statistics of a line: what the database summed up, with what statistics say of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Literal

from sqlalchemy import Connection, Engine

from bench.eol.statistics.capability import Capability, of_moments, spread_within
from bench.eol.statistics.control_chart import Chart, individuals_chart
from bench.eol.statistics.drift import Drift, drift
from bench.eol.statistics.gauge import GaugeStudy, gauge_study
from bench.eol.statistics.proportion import Proportion, proportion
from bench.eol.store.insertion import settled
from bench.eol.store.records import own_labels
from bench.eol.store.selection import Selection, choose
from bench.eol.store.study import crossed, tests_of
from bench.eol.store.tallies import (
    Distribution,
    Failures,
    distribution,
    failures_by_parameter,
    failures_by_procedure,
    held_against_limits,
    latest,
    parameters,
    rows_of_neighbours,
    without_compiling,
)
from bench.eol.verdict import Verdict
from bench.files.toml_file import nearest
from bench.i18n.errors import InputError
from drivers.interfaces.text import text
from procedures.known_parameters import definition_of
from reports.labels import ParameterLabels

#: Rules of the control chart that are looked for where none are named (Nelson's numbers).
RULES = (1, 2, 3, 5, 6)


@dataclass(frozen=True)
class Yield:
    """Yields are shares of the motors that were judged: passed or failed. One that the station could not measure is neither."""

    verdicts: Mapping[Verdict, int]
    first_pass: Proportion
    final: Proportion


@dataclass(frozen=True)
class Golden:
    """A golden motor's figures of one parameter: when (UTC), how much, and the drift they show."""

    serial_number: str
    times: tuple[datetime, ...]
    values: tuple[float, ...]
    drift: Drift


@dataclass(frozen=True)
class ParameterStatistics:
    """One parameter: its distribution, Cp and Cpk by the spread within, Pp and Ppk by the overall one, its chart, golden motors.

    `serial_numbers` and `values` are the chart's points, the latest last; `chart` is None where there are fewer than two.
    """

    distribution: Distribution
    within: Capability
    overall: Capability
    serial_numbers: tuple[str, ...]
    values: tuple[float, ...]
    chart: Chart | None
    golden: tuple[Golden, ...]


@dataclass(frozen=True)
class LineStatistics:
    """All of it: which records, yields, what failed, and each parameter."""

    selection: Selection
    yields: Yield
    by_parameter: tuple[Failures, ...]
    by_procedure: tuple[Failures, ...]
    parameters: Mapping[str, ParameterStatistics]


@dataclass(frozen=True)
class StatisticsRequest:
    """Which records and what of them; every parameter where none is named. `last` is the chart's number of points."""

    batches: Sequence[str] = ()
    model: str = ""
    parameters: Sequence[str] = ()
    golden: Sequence[str] = ()
    last: int = 100
    rules: Sequence[int] = RULES
    confidence: float = 0.95


def line_statistics(engine: Engine, wanted: StatisticsRequest) -> LineStatistics:
    """Return the statistics of a database's records. Raises InputError where there are none, or a name is unknown."""
    with settled(engine) as connection:
        without_compiling(connection)
        selection = choose(connection, wanted.batches, wanted.model, wanted.golden)
        names = _names(connection, wanted.parameters)
        statistics = {name: _parameter(connection, name, selection, wanted) for name in names}
        return LineStatistics(
            selection,
            _yield(selection, wanted.confidence),
            tuple(failures_by_parameter(connection, selection)),
            tuple(failures_by_procedure(connection, selection)),
            {name: each for name, each in statistics.items() if each is not None},
        )


def measured_parameters(engine: Engine, wanted: StatisticsRequest) -> list[str]:
    """Return the parameters of which the wanted records have figures: those that failed most first, those without limits last.

    Raises InputError as `line_statistics` does.
    """
    with settled(engine) as connection:
        without_compiling(connection)
        selection = choose(connection, wanted.batches, wanted.model, wanted.golden)
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


def gauge_studies(
    engine: Engine, wanted: StatisticsRequest, appraiser: Literal["person", "socket"], alpha: float
) -> dict[str, tuple[GaugeStudy, str]]:
    """Return the gauge study of each parameter with its unit. Raises InputError where the records are no crossed study."""
    with settled(engine) as connection:
        selection = choose(connection, wanted.batches, wanted.model, wanted.golden)
        studies = {}
        for name in _names(connection, wanted.parameters):
            if not wanted.parameters and not latest(connection, name, selection, 1):
                continue
            study = crossed(connection, name, selection, appraiser)
            studies[name] = (gauge_study(study.values, alpha=alpha, confidence=wanted.confidence), study.unit)
        return studies


def _names(connection: Connection, requested: Sequence[str]) -> list[str]:
    known = parameters(connection)
    for name in requested:
        if name not in known:
            raise InputError(
                text("the records have no parameter {name!r}; {hint}", name=name, hint=nearest(name, known))
            )
    return list(requested) or known


def _yield(selection: Selection, confidence: float) -> Yield:
    passed = selection.verdicts[Verdict.PASS]
    judged = passed + selection.verdicts[Verdict.FAIL]
    return Yield(
        selection.verdicts,
        proportion(selection.first_pass, judged, confidence),
        proportion(passed, judged, confidence),
    )


def _parameter(
    connection: Connection, name: str, selection: Selection, wanted: StatisticsRequest
) -> ParameterStatistics | None:
    figures = distribution(connection, name, selection)
    if figures is None:
        return None
    within, freedom = spread_within(rows_of_neighbours(connection, name, selection))
    points = latest(connection, name, selection, wanted.last)
    values = [value for _, value in points]
    golden = tests_of(connection, name, wanted.golden) if wanted.golden else {}
    moments = (figures.count, figures.mean)
    return ParameterStatistics(
        distribution=figures,
        within=of_moments(*moments, within, figures.limits, wanted.confidence, freedom=freedom),
        overall=of_moments(*moments, figures.standard_deviation, figures.limits, wanted.confidence),
        serial_numbers=tuple(serial for serial, _ in points),
        values=tuple(values),
        chart=individuals_chart(values, rules=wanted.rules) if len(values) > 1 else None,
        golden=tuple(_golden(serial, tests, wanted.confidence) for serial, tests in golden.items()),
    )


def _golden(serial: str, tests: Sequence[tuple[datetime, float]], confidence: float) -> Golden:
    times, values = [at for at, _ in tests], [value for _, value in tests]
    return Golden(serial, tuple(times), tuple(values), drift([at.timestamp() for at in times], values, confidence))
