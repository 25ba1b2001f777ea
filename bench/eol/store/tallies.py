"""Sums that a database makes of very many records: it counts and adds, and returns no single motor."""

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, Connection, Row, func, select, true, union_all

from bench.eol.limits import limits_of
from bench.eol.store.schema import CHECK, FIGURE, MOTOR, NOT_PASSED
from bench.eol.store.selection import Selection
from bench.eol.verdict import Verdict

#: Motors at the end of a selection among which the latest figures are looked for first.
_NEAR = 20_000
#: Motors in a row, and how many such rows, that tell how neighbours differ.
_ROW, _ROWS = 250, 40


@dataclass(frozen=True)
class Failures:
    """The number of motors that failed at a parameter or a procedure, and of those that it gave a station error."""

    name: str
    failed: int
    errors: int


def without_compiling(connection: Connection) -> None:
    """Disable PostgreSQL's compilation of this transaction's queries: for dozens of short sums it takes longer than summing."""
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


def latest(connection: Connection, parameter: str, selection: Selection, count: int) -> list[tuple[str, float]]:
    """Return serial number and value of the last `count` motors that have one, in the order in which they were kept."""
    rows = ends_of(connection, parameter, FIGURE.c.value.is_not(None), selection, count)[::-1]
    if not rows:
        return []
    serials = select(MOTOR.c.id, MOTOR.c.serial_number).where(MOTOR.c.id.in_([row.motor for row in rows]))
    named = {row.id: row.serial_number for row in connection.execute(serials)}
    return [(named[row.motor], row.value) for row in rows]


def held_against_limits(connection: Connection, parameter: str, selection: Selection) -> bool:
    """Tell whether the latest figure of a parameter was held against a limit."""
    rows = ends_of(connection, parameter, true(), selection, 1)
    return any(limits_of(row.low, row.high) != limits_of(None, None) for row in rows)


def rows_of_neighbours(
    connection: Connection, names: Sequence[str], selection: Selection
) -> dict[str, list[list[float]]]:
    """Return by parameter values of motors that followed each other, in up to 40 rows of up to 250, spread evenly over the selection.

    One query for all of them: a server on a busy machine takes longer to be asked than to answer.
    """
    first, last = selection.stretches[0][0], selection.stretches[-1][1]
    length = last - first + 1
    starts = (
        [first + n * _ROW for n in range(math.ceil(length / _ROW))]
        if length <= _ROW * _ROWS
        else [first + n * (length - _ROW) // (_ROWS - 1) for n in range(_ROWS)]
    )
    columns = (FIGURE.c.motor, FIGURE.c.parameter, FIGURE.c.value)
    parts = [
        select(*columns).where(
            func.coalesce(FIGURE.c.parameter, "").in_(names),
            FIGURE.c.motor.between(start, start + _ROW - 1),
            selection.holds(FIGURE.c.motor),
            FIGURE.c.value.is_not(None),
        )
        for start in starts
    ]
    rows: dict[str, list[list[float]]] = {name: [[] for _ in starts] for name in names}
    for motor, parameter, value in connection.execute(union_all(*parts).order_by("motor")):
        rows[parameter][bisect_right(starts, motor) - 1].append(value)
    return rows


def of_parameter(parameter: str) -> ColumnElement[bool]:
    """Return the condition that a figure is of a parameter, in words that no index serves: the database is to go by motor."""
    return func.coalesce(FIGURE.c.parameter, "") == parameter


def ends_of(
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
        of_parameter(parameter), which, FIGURE.c.motor.between(*near), selection.holds(FIGURE.c.motor, walk=True)
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
