"""Studies of a gauge out of a line's records: crossed, by ranges, type 1, linearity."""

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Literal

from sqlalchemy import Connection, Engine

from bench.eol.line_statistics import StatisticsRequest, known_names
from bench.eol.statistics.gauge import GaugeStudy, gauge_study
from bench.eol.statistics.gauge_types import Linearity, RangeStudy, TypeOneStudy, linearity, range_study, type_one
from bench.eol.store.insertion import settled
from bench.eol.store.selection import Selection
from bench.eol.store.study import crossed, figures_of, latest_limits
from bench.eol.store.tallies import latest
from bench.i18n.errors import InputError
from drivers.interfaces.text import text

Appraiser = Literal["person", "socket"]


def gauge_studies(
    engine: Engine, wanted: StatisticsRequest, appraiser: Appraiser, alpha: float
) -> dict[str, tuple[GaugeStudy, str]]:
    """Return the gauge study of each parameter with its unit. Raises InputError where the records are no crossed study."""
    with _chosen(engine, wanted) as (connection, selection):
        studies = {}
        for name in _measured(connection, wanted, selection):
            study = crossed(connection, name, selection, appraiser)
            studies[name] = (gauge_study(study.values, alpha=alpha, confidence=wanted.confidence), study.unit)
        return studies


def range_studies(engine: Engine, wanted: StatisticsRequest, appraiser: Appraiser) -> dict[str, tuple[RangeStudy, str]]:
    """Return the study of each parameter by the range method. Raises InputError where not every appraiser measured every motor once."""
    with _chosen(engine, wanted) as (connection, selection):
        studies = {}
        for name in _measured(connection, wanted, selection):
            study = crossed(connection, name, selection, appraiser, once=True)
            limits = latest_limits(connection, name, selection)
            whole = limits.tolerance / 6.0 if math.isfinite(limits.tolerance) else math.nan
            studies[name] = (
                range_study(study.values[:, :, 0], whole=whole, confidence=wanted.confidence),
                study.unit,
            )
        return studies


def type_one_studies(
    engine: Engine, wanted: StatisticsRequest, references: Mapping[str, float]
) -> dict[str, tuple[TypeOneStudy, str]]:
    """Return the type-1 study of one parameter of the one part that `references` gives the true value of.

    Raises InputError where it has too few figures, or no limits on both sides.
    """
    with _chosen(engine, wanted) as (connection, selection):
        (name,) = known_names(connection, wanted.parameters)
        figures, unit = figures_of(connection, name, selection, list(references))
        ((serial, reference),) = references.items()
        tolerance = latest_limits(connection, name, selection).tolerance
        try:
            study = type_one(figures[serial], reference, tolerance, wanted.confidence)
        except ValueError as error:
            raise _no_study(name, error) from error
        return {name: (study, unit)}


def linearity_studies(
    engine: Engine, wanted: StatisticsRequest, references: Mapping[str, float]
) -> dict[str, tuple[Linearity, str]]:
    """Return the linearity of one parameter from the parts that `references` gives the true values of. Raises InputError."""
    with _chosen(engine, wanted) as (connection, selection):
        (name,) = known_names(connection, wanted.parameters)
        figures, unit = figures_of(connection, name, selection, list(references))
        known = [references[serial] for serial, values in figures.items() for _ in values]
        try:
            study = linearity(known, [value for values in figures.values() for value in values], wanted.confidence)
        except ValueError as error:
            raise _no_study(name, error) from error
        return {name: (study, unit)}


def _no_study(parameter: str, error: ValueError) -> InputError:
    return InputError(text("{parameter}: {error}", parameter=parameter, error=error))


@contextmanager
def _chosen(engine: Engine, wanted: StatisticsRequest) -> Iterator[tuple[Connection, Selection]]:
    with settled(engine) as connection:
        yield connection, wanted.choose(connection, wanted.golden)


def _measured(connection: Connection, wanted: StatisticsRequest, selection: Selection) -> list[str]:
    """Return the parameters that are asked for; without that, those that the selection has figures of."""
    names = known_names(connection, wanted.parameters)
    return names if wanted.parameters else [name for name in names if latest(connection, name, selection, 1)]
