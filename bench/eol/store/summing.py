"""Summing up: what statistics count is added up as motors end, so that they need not read every motor again."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from sqlalchemy import Connection, Engine, case, delete, func, insert, literal, select, update

from bench.eol.limits import limits_of
from bench.eol.store.binned_sums import BinnedSums, bin_edges, sums_of
from bench.eol.store.insertion import settle_within
from bench.eol.store.occasions import JUDGED, PLACE, step_of_start
from bench.eol.store.repeated_tests import keep_repeated
from bench.eol.store.schema import CHECK, FIGURE, MOTOR
from bench.eol.store.stretches import LAST_KEY
from bench.eol.store.summed_tables import (
    SUMMED_ATTEMPTS,
    SUMMED_FIGURES,
    SUMMED_MOTORS,
    SUMMED_PLACES,
    SUMMED_STRETCH,
    SUMMED_TIMES,
)
from bench.eol.verdict import Verdict

#: Keys of a full stretch: the first begins at 1, the next one after its last.
STRETCH = 10_000
#: A stretch that is not full is summed up anew when so many keys have been added.
GROWTH = 500
#: A count that says that the figures have to be read: their limits changed within the stretch.
MIXED = -1
#: Values that tell where bins should lie where the limits do not.
_LOOK = 500
#: How long one waits for those who are writing just now.
_PATIENCE = "2s"
#: As in the triggers of the tables: who removes motors waits, and is waited for.
_LOCK = 7265194
_CHILDREN = (SUMMED_MOTORS, SUMMED_PLACES, SUMMED_TIMES, SUMMED_ATTEMPTS, SUMMED_FIGURES)


def sum_up(engine: Engine, most: int = LAST_KEY) -> int:
    """Sum up what is not yet, each stretch in a transaction of its own, so many at `most`; return how many. Raises DBAPIError.

    No motor's record can come into a stretch that was summed up: see `_last_key`. Where it cannot be done now, statistics count for
    themselves.
    """
    done = 0
    with engine.connect() as connection:
        last = _last_key(connection)
        rows = connection.execute(select(SUMMED_STRETCH.c.first, SUMMED_STRETCH.c.last).where(SUMMED_STRETCH.c.by_test))
        summed = {row.first: row.last for row in rows}
        connection.rollback()
        for first in range(1, last + 1, STRETCH):
            if done < most and _worth(first, last, summed.get(first, 0)):
                done += _sum_stretch(connection, first, last)
                connection.commit()
    return done


def _worth(first: int, last: int, summed: int) -> bool:
    """Tell whether a stretch, summed up to the key `summed`, is to be summed up (anew) to `last`."""
    end, before = min(last, first + STRETCH - 1), max(summed, first - 1)
    return before < end and (end - before >= GROWTH or end == first + STRETCH - 1)


def _last_key(connection: Connection) -> int:
    """Return a key that no motor will get or be below of any more.

    A server gives keys in order, and transactions end in another. Nobody who has a key is still writing when the table is had for
    oneself; who writes later gets a greater one.
    """
    if connection.dialect.name == "postgresql":
        connection.exec_driver_sql(f"SET LOCAL lock_timeout = '{_PATIENCE}'")
        connection.exec_driver_sql("LOCK TABLE motor IN SHARE MODE")
    return connection.execute(select(func.max(MOTOR.c.id))).scalar() or 0


def lock_sums(connection: Connection) -> None:
    """Have nobody else change what is summed up until this transaction ends, which begins here."""
    if connection.dialect.name == "postgresql":
        connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({_LOCK})")
    else:
        connection.exec_driver_sql("BEGIN IMMEDIATE")


def _sum_stretch(connection: Connection, first: int, last: int) -> bool:
    """Sum up a stretch; false where another station has done so meanwhile."""
    lock_sums(connection)
    if connection.dialect.name == "postgresql":
        # A stretch is a small part of each table. A server that knows nothing yet of a new one would read all of it, and compile that.
        connection.exec_driver_sql("SET LOCAL enable_seqscan = off; SET LOCAL jit = off")
    else:
        settle_within(connection)
        # A file gives the key of the last motor again when that was removed.
        last = min(last, _last_key(connection))
    this = SUMMED_STRETCH.c.first == first
    before = connection.execute(select(SUMMED_STRETCH).where(this)).one_or_none()
    if not _worth(first, last, before.last if before is not None and before.by_test else 0):
        return False
    last = min(last, first + STRETCH - 1)
    keep_repeated(connection, first, last)
    # Of one that a program of 0009 summed up only the repeated tests are missing.
    if before is not None and before.by_occasion and before.last == last:
        connection.execute(update(SUMMED_STRETCH).where(this).values(by_test=True))
        return True
    for table in _CHILDREN:
        connection.execute(delete(table).where(table.c.first == first))
    connection.execute(delete(SUMMED_STRETCH).where(this))
    connection.execute(insert(SUMMED_STRETCH).values(first=first, last=last, by_occasion=True, by_test=True))
    models = _sum_motors(connection, first, last)
    _sum_occasions(connection, first, last)
    _sum_attempts(connection, first, last)
    _sum_figures(connection, first, last, models)
    return True


def _sum_motors(connection: Connection, first: int, last: int) -> list[str]:
    """Count motors; return their types."""
    columns = (MOTOR.c.batch, MOTOR.c.model, MOTOR.c.verdict, MOTOR.c.first_pass)
    query = select(*columns, func.count(), func.min(MOTOR.c.id), func.max(MOTOR.c.id))
    rows = connection.execute(query.where(MOTOR.c.id.between(first, last)).group_by(*columns)).all()
    names = [column.name for column in SUMMED_MOTORS.columns]
    _insert(connection, SUMMED_MOTORS, [dict(zip(names, (first, *row), strict=True)) for row in rows])
    return sorted({row.model for row in rows})


def _sum_occasions(connection: Connection, first: int, last: int) -> None:
    common = {"batch": MOTOR.c.batch, "model": MOTOR.c.model}
    judged = MOTOR.c.id.between(first, last) & JUDGED
    for table, told_apart in ((SUMMED_PLACES, PLACE), (SUMMED_TIMES, {"step": step_of_start(connection)})):
        columns = {**common, **told_apart, "verdict": MOTOR.c.verdict, "first_pass": MOTOR.c.first_pass}
        query = select(literal(first), *columns.values(), func.count()).where(judged).group_by(*columns.values())
        connection.execute(insert(table).from_select(["first", *columns, "count"], query))


def _sum_attempts(connection: Connection, first: int, last: int) -> None:
    columns = (MOTOR.c.batch, MOTOR.c.model, CHECK.c.procedure)
    bad = func.sum(case((CHECK.c.verdict == Verdict.PASS.value, 0), else_=1))
    query = (
        select(*columns, func.count(), bad)
        .join(MOTOR, MOTOR.c.id == CHECK.c.motor)
        .where(
            CHECK.c.motor.between(first, last),
            # Said of both: PostgreSQL would read all motors.
            MOTOR.c.id.between(first, last),
            CHECK.c.attempt == 1,
            JUDGED,
        )
        .group_by(*columns)
    )
    names = [column.name for column in SUMMED_ATTEMPTS.columns]
    rows = connection.execute(query).all()
    _insert(connection, SUMMED_ATTEMPTS, [dict(zip(names, (first, *row), strict=True)) for row in rows])


@dataclass
class _Figures:
    """Figures of one type and parameter: their values, and the limits that they were held against."""

    values: list[float] = field(default_factory=list)
    limits: set[tuple[float | None, float | None]] = field(default_factory=set)


def _sum_figures(connection: Connection, first: int, last: int, models: Sequence[str]) -> None:
    figures: dict[tuple[str, str], _Figures] = {}
    for model, parameter, value, low, high in _read_figures(connection, first, last, models):
        found = figures.setdefault((model, parameter), _Figures())
        found.limits.add((low, high))
        if value is not None:
            found.values.append(value)
    rows = []
    for (model, parameter), found in sorted(figures.items()):
        key = {"first": first, "model": model, "parameter": parameter}
        if len(found.limits) > 1:
            rows.append(key | {"low": None, "high": None, "count": MIXED} | _row(BinnedSums((), 0.0, 0.0, 0.0), ()))
            continue
        ((low, high),) = found.limits
        edges, middle = _bins(connection, key, low, high, found.values)
        sums = sums_of(np.asarray(found.values, dtype=np.float64), edges, middle)
        rows.append(key | {"low": low, "high": high, "count": sums.count} | _row(sums, edges))
    _insert(connection, SUMMED_FIGURES, rows)


def _read_figures(
    connection: Connection, first: int, last: int, models: Sequence[str]
) -> Iterator[tuple[str, str, float | None, float | None, float | None]]:
    columns = (FIGURE.c.motor, FIGURE.c.parameter, FIGURE.c.value, FIGURE.c.low, FIGURE.c.high)
    of_motor: dict[int, str] = {}
    if len(models) > 1:
        motors = select(MOTOR.c.id, MOTOR.c.model).where(MOTOR.c.id.between(first, last))
        of_motor = {row.id: row.model for row in connection.execute(motors)}
    query = select(*columns).where(FIGURE.c.motor.between(first, last))
    for motor, *figure in connection.execute(query.execution_options(yield_per=5000)):
        yield of_motor.get(motor, models[0]), *figure


def _bins(
    connection: Connection, key: Mapping[str, Any], low: float | None, high: float | None, values: Sequence[float]
) -> tuple[list[float], float]:
    """Return edges and middle: those of the stretch before where its limits were the same, so that they can be added up."""
    limits = limits_of(low, high)
    before = connection.execute(
        select(SUMMED_FIGURES)
        .where(
            SUMMED_FIGURES.c.model == key["model"],
            SUMMED_FIGURES.c.parameter == key["parameter"],
            SUMMED_FIGURES.c.first < key["first"],
            SUMMED_FIGURES.c.count != MIXED,
        )
        .order_by(SUMMED_FIGURES.c.first.desc())
        .limit(1)
    ).one_or_none()
    if before is not None and limits_of(before.low, before.high) == limits:
        return [float(edge) for edge in json.loads(before.edges)], before.middle
    middle = float(np.mean(values)) if values else 0.0
    return bin_edges(limits, middle, values[:_LOOK]), middle


def _row(sums: BinnedSums, edges: Sequence[float]) -> dict[str, object]:
    return {
        "middle": sums.middle,
        "total": sums.total,
        "squares": sums.squares,
        "edges": json.dumps(list(edges)),
        "counts": json.dumps(list(sums.counts)),
    }


def _insert(connection: Connection, table: Any, rows: Sequence[Mapping[str, object]]) -> None:
    if rows:
        connection.execute(insert(table), rows)
