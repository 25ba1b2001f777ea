"""What a database sums up of very many records: it counts and adds, and gives no motor away one by one."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from sqlalchemy import ColumnElement, Connection, Row, and_, func, select, true, union_all
from sqlalchemy import literal as bound

from bench.eol.limits import ParameterLimits
from bench.eol.store.schema import CHECK, FIGURE, MOTOR, NOT_PASSED
from bench.eol.store.selection import Selection
from bench.eol.verdict import Verdict

#: Looked at to find out where values lie before they are sorted into bins.
_LOOK = 500
#: Motors at the end of a selection among which the latest figures are looked for first.
_NEAR = 20_000
#: Bins between the limits, and beyond each of them.
_INSIDE, _OUTSIDE = 24, 6
#: Where only the spread tells where bins should lie: this many standard deviations to either side.
_REACH = 5.0
#: Motors in a row, and how many such rows, that tell how neighbours differ.
_ROW, _ROWS = 250, 40


@dataclass(frozen=True)
class Histogram:
    """Counts between edges, in the figure's unit; the first and the last bin also hold all that lies beyond."""

    edges: tuple[float, ...]
    counts: tuple[int, ...]


@dataclass(frozen=True)
class Distribution:
    """A parameter's figures as the database sums them up, in `unit`: NaN where there are too few.

    `limits` are those of the latest figure; `changed` tells that the earliest was held against others.
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
    histogram: Histogram


@dataclass(frozen=True)
class Failures:
    """How many motors failed at a parameter or a procedure, and how many it gave the station an error."""

    name: str
    failed: int
    errors: int


def without_compiling(connection: Connection) -> None:
    """Have PostgreSQL not compile this transaction's queries: for dozens of short sums that takes longer than summing."""
    if connection.dialect.name == "postgresql":
        connection.exec_driver_sql("SET LOCAL jit = off")


def parameters(connection: Connection) -> list[str]:
    """Return the names of all parameters, from one to the next without reading what lies between."""
    names: list[str] = []
    while True:
        query = select(func.min(FIGURE.c.parameter))
        if names:
            query = query.where(FIGURE.c.parameter > names[-1])
        name = connection.execute(query).scalar()
        if name is None:
            return names
        names.append(name)


def failures_by_parameter(connection: Connection, selection: Selection) -> list[Failures]:
    """Return the parameters that did not pass everywhere, the worst first."""
    query = select(FIGURE.c.parameter, FIGURE.c.verdict, func.count()).where(
        NOT_PASSED, selection.holds(FIGURE.c.motor)
    )
    return _failures(connection.execute(query.group_by(FIGURE.c.parameter, FIGURE.c.verdict)).all())


def failures_by_procedure(connection: Connection, selection: Selection) -> list[Failures]:
    """Return the procedures whose attempts did not all pass, the worst first; a motor counts once however often it was tried."""
    query = select(CHECK.c.procedure, CHECK.c.verdict, func.count(CHECK.c.motor.distinct())).where(
        NOT_PASSED, selection.holds(CHECK.c.motor)
    )
    return _failures(connection.execute(query.group_by(CHECK.c.procedure, CHECK.c.verdict)).all())


def distribution(connection: Connection, parameter: str, selection: Selection) -> Distribution | None:
    """Return a parameter's moments and histogram; None where the selection has no figure of it.

    Each bin is a stretch of the index by value, which the database counts and adds up without sorting. Sums are taken about
    a value in the middle, or the variance would drown in the mean's square (Chan, Golub, LeVeque, 1983).
    """
    in_bins = and_(FIGURE.c.parameter == parameter, selection.holds(FIGURE.c.motor))
    looked = _ends(connection, parameter, true(), selection, _LOOK)
    if not looked:
        return None
    first = _ends(connection, parameter, true(), selection, 1, earliest=True)[0]
    limits = _limits(looked[0].low, looked[0].high)
    seen = [row.value for row in looked if row.value is not None]
    middle = math.fsum(seen) / len(seen) if seen else 0.0
    edges = _edges(limits, middle, seen)
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
    ends = select(FIGURE.c.value).where(in_bins, FIGURE.c.value.is_not(None)).limit(1)
    least = connection.execute(ends.order_by(FIGURE.c.value)).scalar()
    most = connection.execute(ends.order_by(FIGURE.c.value.desc())).scalar()
    count = sum(row[1] for row in rows)
    full = [row for row in rows if row[1]]
    total, squares = math.fsum(row[2] for row in full), math.fsum(row[3] for row in full)
    spread = math.sqrt(max(0.0, squares - total * total / count) / (count - 1)) if count > 1 else math.nan
    return Distribution(
        parameter=parameter,
        unit=looked[0].unit,
        limits=limits,
        changed=_limits(first.low, first.high) != limits,
        count=count,
        mean=middle + total / count if count else math.nan,
        standard_deviation=spread,
        least=math.nan if least is None else least,
        most=math.nan if most is None else most,
        histogram=_histogram(edges, [row[1] for row in rows]),
    )


def latest(connection: Connection, parameter: str, selection: Selection, count: int) -> list[tuple[str, float]]:
    """Return serial number and value of the last `count` motors that have one, in the order in which they were kept."""
    rows = _ends(connection, parameter, FIGURE.c.value.is_not(None), selection, count)[::-1]
    if not rows:
        return []
    serials = select(MOTOR.c.id, MOTOR.c.serial_number).where(MOTOR.c.id.in_([row.motor for row in rows]))
    named = {row.id: row.serial_number for row in connection.execute(serials)}
    return [(named[row.motor], row.value) for row in rows]


def held_against_limits(connection: Connection, parameter: str, selection: Selection) -> bool:
    """Tell whether the latest figure of a parameter was held against a limit."""
    rows = _ends(connection, parameter, true(), selection, 1)
    return any(_limits(row.low, row.high) != _limits(None, None) for row in rows)


def rows_of_neighbours(connection: Connection, parameter: str, selection: Selection) -> list[list[float]]:
    """Return values of motors that followed each other, in up to 40 rows of up to 250, spread evenly over the selection."""
    first, last = selection.stretches[0][0], selection.stretches[-1][1]
    length = last - first + 1
    starts = (
        [first + n * _ROW for n in range(math.ceil(length / _ROW))]
        if length <= _ROW * _ROWS
        else [first + n * (length - _ROW) // (_ROWS - 1) for n in range(_ROWS)]
    )
    rows = [
        connection.execute(
            select(FIGURE.c.value)
            .where(
                _of(parameter),
                FIGURE.c.motor.between(start, start + _ROW - 1),
                selection.holds(FIGURE.c.motor),
                FIGURE.c.value.is_not(None),
            )
            .order_by(FIGURE.c.motor)
        ).scalars()
        for start in starts
    ]
    return [list(row) for row in rows]


def _of(parameter: str) -> ColumnElement[bool]:
    """Return the condition that a figure is of a parameter, in words that no index serves: the database is to go by motor."""
    return func.coalesce(FIGURE.c.parameter, "") == parameter


def _ends(
    connection: Connection,
    parameter: str,
    which: ColumnElement[bool],
    selection: Selection,
    count: int,
    *,
    earliest: bool = False,
) -> Sequence[Row[int, Any, str, Any, Any]]:
    """Return the last `count` figures of the selection, the latest first; or the first, the earliest first.

    Most parameters are measured of every motor, and a look at the end's motors finds them. Those of every n-th motor only are
    looked for by parameter.
    """
    columns = select(FIGURE.c.motor, FIGURE.c.value, FIGURE.c.unit, FIGURE.c.low, FIGURE.c.high)
    first, last = selection.stretches[0][0], selection.stretches[-1][1]
    near = (first, first + _NEAR) if earliest else (last - _NEAR, last)
    order = FIGURE.c.motor if earliest else FIGURE.c.motor.desc()
    close = columns.where(
        _of(parameter), which, FIGURE.c.motor.between(*near), selection.holds(FIGURE.c.motor, walk=True)
    )
    rows = connection.execute(close.order_by(order).limit(count)).all()
    if len(rows) == count or last - first <= _NEAR:
        return rows
    anywhere = FIGURE.c.motor + 0
    far = columns.where(FIGURE.c.parameter == parameter, which, selection.holds(FIGURE.c.motor))
    far = far.order_by(anywhere if earliest else anywhere.desc())
    return connection.execute(far.limit(count)).all()


def _failures(rows: Sequence[Sequence[object]]) -> list[Failures]:
    counts: dict[str, dict[str, int]] = {}
    for name, verdict, count in rows:
        counts.setdefault(str(name), {})[str(verdict)] = int(str(count))
    failures = [
        Failures(
            name,
            verdicts.get(Verdict.FAIL.value, 0),
            verdicts.get(Verdict.ERROR.value, 0) + verdicts.get(Verdict.NOT_JUDGED.value, 0),
        )
        for name, verdicts in counts.items()
    ]
    return sorted(failures, key=lambda each: (-each.failed, -each.errors, each.name))


def _edges(limits: ParameterLimits, middle: float, seen: Sequence[float]) -> list[float]:
    """Return the bins' edges, open at both ends: the limits are edges themselves where there are two."""
    if math.isfinite(limits.tolerance) and limits.tolerance > 0.0:
        low, width = limits.low, limits.tolerance / _INSIDE
        # A value on the upper limit is within it.
        inner = [low + n * width for n in range(_INSIDE)] + [math.nextafter(limits.high, math.inf)]
    else:
        spread = math.sqrt(math.fsum((x - middle) ** 2 for x in seen) / max(1, len(seen) - 1)) if seen else 0.0
        reach = _REACH * spread or 1e-3 * abs(middle) or 1.0
        width = 2.0 * reach / _INSIDE
        inner = [middle - reach + n * width for n in range(_INSIDE + 1)]
    below = [inner[0] - n * width for n in range(_OUTSIDE, 0, -1)]
    above = [inner[-1] + n * width for n in range(1, _OUTSIDE + 1)]
    return [-math.inf, *below, *inner, *above, math.inf]


def _histogram(edges: Sequence[float], counts: Sequence[int]) -> Histogram:
    """Put what lies beyond the outermost bins into them."""
    inner = list(counts[1:-1])
    inner[0] += counts[0]
    inner[-1] += counts[-1]
    return Histogram(tuple(edges[1:-1]), tuple(inner))


def _limits(low: float | None, high: float | None) -> ParameterLimits:
    return ParameterLimits(-math.inf if low is None else low, math.inf if high is None else high)
