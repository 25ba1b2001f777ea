"""Distribution of a parameter's figures, as a database of very many motors sums them up."""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from sqlalchemy import ColumnElement, Connection, and_, func, select, true, union_all
from sqlalchemy import literal as bound

from bench.eol.limits import ParameterLimits, limits_of
from bench.eol.store.binned_sums import BinnedSums, bin_edges, summed_by_bin, together
from bench.eol.store.schema import FIGURE, MOTOR
from bench.eol.store.selection import Selection, golden_keys
from bench.eol.store.stretches import Stretch, StretchesByKey, among, without
from bench.eol.store.summed_tables import SUMMED_FIGURES
from bench.eol.store.summing import MIXED
from bench.eol.store.tallies import ends_of, of_parameter

#: Looked at to find out where values lie before they are sorted into bins.
_LOOK = 500


@dataclass(frozen=True)
class Histogram:
    """Counts between edges, in the figure's unit; the first and the last bin also hold all that lies beyond."""

    edges: tuple[float, ...]
    counts: tuple[int, ...]


@dataclass(frozen=True)
class Distribution:
    """A parameter's figures as the database sums them up, in `unit`: NaN where there are too few.

    `limits` are those of the latest figure; `changed` tells that the earliest was held against others. `outside` counts the values
    beyond them. `bins` are all of them, the outermost open; `histogram` is what of them is shown.
    """

    parameter: str
    unit: str
    limits: ParameterLimits
    changed: bool
    count: int
    mean: float
    standard_deviation: float
    least: float
    most: float
    outside: int
    bins: Histogram
    histogram: Histogram


def distribution(connection: Connection, parameter: str, selection: Selection) -> Distribution | None:
    """Return a parameter's moments and histogram; None where the selection has no figure of it.

    Stretches of motors were summed up before. Of the others each bin is a stretch of the index by value, which the
    database counts and adds up without sorting.
    """
    looked = ends_of(connection, parameter, true(), selection, _LOOK)
    if not looked:
        return None
    first = ends_of(connection, parameter, true(), selection, 1, earliest=True)[0]
    limits = limits_of(looked[0].low, looked[0].high)
    seen = [row.value for row in looked if row.value is not None]
    middle = math.fsum(seen) / len(seen) if seen else 0.0
    summed = [each for each in _summed_figures(connection, parameter, selection) if each.limits == limits]
    edges = list(summed[-1].edges) if summed else bin_edges(limits, middle, seen)
    summed = [each for each in summed if list(each.edges) == edges]
    parts = [each.sums for each in summed]
    if summed and selection.golden:
        parts = [
            together(parts, middle, len(edges) - 1).without(_golden(connection, parameter, selection, summed), edges)
        ]
    rest = without(selection.stretches, [each.stretch for each in summed])
    if not summed:
        parts.append(_binned(connection, parameter, selection, edges, middle))
    elif rest:
        condition = and_(of_parameter(parameter), among(FIGURE.c.motor, rest), selection.holds(FIGURE.c.motor))
        parts.append(summed_by_bin(connection, condition, edges, middle))
    sums = together(parts, middle, len(edges) - 1)
    of_it = and_(FIGURE.c.parameter == parameter, selection.holds(FIGURE.c.motor))
    ends = select(FIGURE.c.value).where(of_it, FIGURE.c.value.is_not(None)).limit(1)
    least = connection.execute(ends.order_by(FIGURE.c.value)).scalar()
    most = connection.execute(ends.order_by(FIGURE.c.value.desc())).scalar()
    count, total = sums.count, sums.total
    spread = math.sqrt(max(0.0, sums.squares - total * total / count) / (count - 1)) if count > 1 else math.nan
    return Distribution(
        parameter=parameter,
        unit=looked[0].unit,
        limits=limits,
        changed=limits_of(first.low, first.high) != limits,
        count=count,
        mean=middle + total / count if count else math.nan,
        standard_deviation=spread,
        least=math.nan if least is None else least,
        most=math.nan if most is None else most,
        outside=_outside(connection, of_it, limits),
        bins=Histogram(tuple(edges), sums.counts),
        histogram=_histogram(edges, sums.counts),
    )


@dataclass(frozen=True)
class _SummedFigures:
    """The sums of one parameter of one type over the motors of a stretch of keys."""

    stretch: Stretch
    limits: ParameterLimits
    edges: tuple[float, ...]
    sums: BinnedSums


def _summed_figures(connection: Connection, parameter: str, selection: Selection) -> list[_SummedFigures]:
    """Return the sums of the stretches that are chosen whole, the earliest first; those with changed limits are left out."""
    last_of = dict(selection.whole)
    query = select(SUMMED_FIGURES).where(
        SUMMED_FIGURES.c.model == selection.model,
        SUMMED_FIGURES.c.parameter == parameter,
        SUMMED_FIGURES.c.count != MIXED,
    )
    edges: dict[str, tuple[float, ...]] = {}
    result = []
    for row in connection.execute(query.order_by(SUMMED_FIGURES.c.first)):
        if row.first in last_of:
            if row.edges not in edges:
                edges[row.edges] = tuple(json.loads(row.edges))
            sums = BinnedSums(tuple(json.loads(row.counts)), row.middle, row.total, row.squares)
            stretch = (row.first, last_of[row.first])
            result.append(_SummedFigures(stretch, limits_of(row.low, row.high), edges[row.edges], sums))
    return result


def _binned(
    connection: Connection, parameter: str, selection: Selection, edges: Sequence[float], middle: float
) -> BinnedSums:
    in_bins = and_(FIGURE.c.parameter == parameter, selection.holds(FIGURE.c.motor))
    off = FIGURE.c.value - bound(middle)
    sums = (func.count(), func.sum(off), func.sum(off * off))
    bins = [
        select(bound(n), *sums).where(
            in_bins,
            FIGURE.c.value >= low if math.isfinite(low) else true(),
            FIGURE.c.value < high if math.isfinite(high) else FIGURE.c.value.is_not(None),
        )
        for n, (low, high) in enumerate(pairwise(edges))
    ]
    rows = sorted(connection.execute(union_all(*bins)).all())
    full = [row for row in rows if row[1]]
    return BinnedSums(
        tuple(row[1] for row in rows),
        middle,
        math.fsum(row[2] for row in full),
        math.fsum(row[3] for row in full),
    )


def _outside(connection: Connection, of_it: ColumnElement[bool], limits: ParameterLimits) -> int:
    sides = []
    if math.isfinite(limits.low):
        sides.append(FIGURE.c.value < limits.low)
    if math.isfinite(limits.high):
        sides.append(FIGURE.c.value > limits.high)
    queries = [select(func.count()).select_from(FIGURE).where(of_it, side) for side in sides]
    return sum(connection.execute(query).scalar_one() for query in queries)


def _golden(
    connection: Connection, parameter: str, selection: Selection, summed: Sequence[_SummedFigures]
) -> list[float]:
    """Return the golden motors' figures that are among those summed up."""
    keys = golden_keys(selection.golden).where(MOTOR.c.model == selection.model)
    figures = select(FIGURE.c.motor, FIGURE.c.value).where(
        of_parameter(parameter), FIGURE.c.motor.in_(keys), FIGURE.c.value.is_not(None)
    )
    within = StretchesByKey([each.stretch for each in summed])
    return [row.value for row in connection.execute(figures) if row.motor in within]


def _histogram(edges: Sequence[float], counts: Sequence[int]) -> Histogram:
    """Put what lies beyond the outermost bins into them."""
    inner = list(counts[1:-1])
    inner[0] += counts[0]
    inner[-1] += counts[-1]
    return Histogram(tuple(edges[1:-1]), tuple(inner))
