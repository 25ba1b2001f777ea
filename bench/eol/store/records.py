"""Records in a database: each saved whole or not at all, and never twice."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import (
    ColumnElement,
    CompoundSelect,
    Connection,
    Engine,
    Select,
    case,
    delete,
    exists,
    func,
    or_,
    select,
    union_all,
)

from bench.eol.record import CheckRecord, MeasuredFigure, MotorRecord
from bench.eol.serial_number import spellings
from bench.eol.store.batch_plans import forget_plans
from bench.eol.store.faults import FAULTS, fault_of
from bench.eol.store.insertion import insert_record, settle
from bench.eol.store.schema import CHECK, FIGURE, FRESH_FIGURE, MOTOR, PARAMETER_LABEL, WAVEFORM
from bench.eol.verdict import Verdict

#: Records read in one go.
_AT_ONCE = 500
_PLAIN = tuple(column.name for column in MOTOR.columns if column.name not in ("id", "verdict", "started", "ended"))


@dataclass(frozen=True)
class BatchResult:
    """The verdict of a batch's motor. Several batches may have one name: the identifier tells whose it is."""

    identifier: str
    number: int
    serial_number: str
    verdict: Verdict


class Records:
    """The records of one database."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine

    def save(self, record: MotorRecord) -> bool:
        """Keep a record; it is durable when this returns. Tells whether it was new.

        Raises StoreError where the database does not take it, of which then nothing is kept; RefusedError where it never will.
        """
        try:
            with self._engine.begin() as connection:
                return insert_record(connection, record)
        except FAULTS as error:
            raise fault_of(error) from error

    def count(self, batch: str | None = None) -> int:
        """Return how many records there are, of one batch or of all."""
        query = select(func.count()).select_from(MOTOR)
        if batch is not None:
            query = query.where(MOTOR.c.batch == batch)
        with self._engine.connect() as connection:
            return int(connection.execute(query).scalar_one())

    def serial_numbers(self, batch: str) -> set[str]:
        """Return the serial numbers of a batch."""
        with self._engine.connect() as connection:
            return set(connection.execute(select(MOTOR.c.serial_number).where(MOTOR.c.batch == batch)).scalars())

    def results(self, batch: str) -> Iterator[BatchResult]:
        """Give the result of each test in the batches of a name, in the order in which they were kept."""
        columns = (MOTOR.c.identifier, MOTOR.c.number, MOTOR.c.serial_number, MOTOR.c.verdict)
        query = select(*columns).where(MOTOR.c.batch == batch).order_by(MOTOR.c.id)
        with self._engine.connect() as connection:
            for row in connection.execution_options(yield_per=5000).execute(query):
                yield BatchResult(row.identifier, row.number, row.serial_number, Verdict(row.verdict))

    def experience(self, plan: str) -> dict[str, tuple[int, int, float]]:
        """Return of each procedure of a plan how many attempts were made, how many did not pass, and their mean time (s)."""
        failed = func.sum(case((CHECK.c.verdict == Verdict.PASS.value, 0), else_=1))
        query = (
            select(CHECK.c.procedure, func.count(), failed, func.avg(CHECK.c.duration))
            .join(MOTOR, MOTOR.c.id == CHECK.c.motor)
            .where(MOTOR.c.plan == plan)
            .group_by(CHECK.c.procedure)
        )
        with self._engine.connect() as connection:
            return {row[0]: (int(row[1]), int(row[2]), float(row[3])) for row in connection.execute(query)}

    def uncertainties(self, plan: str, station: str) -> dict[str, float]:
        """Return the expanded uncertainties (95 %), by parameter, of the latest test by a plan at a station that gave any."""
        known = or_(
            *(
                exists().where(table.c.motor == MOTOR.c.id, table.c.expanded.is_not(None))
                for table in (FIGURE, FRESH_FIGURE)
            )
        )
        latest = select(MOTOR.c.id).where(MOTOR.c.plan == plan, MOTOR.c.station == station, known)
        latest = latest.order_by(MOTOR.c.id.desc()).limit(1)
        with self._engine.connect() as connection:
            key = connection.execute(latest).scalar()
            result: dict[str, float] = {}
            for table in (FIGURE, FRESH_FIGURE):
                query = select(table.c.parameter, table.c.expanded).where(table.c.motor == key)
                rows = connection.execute(query.where(table.c.expanded.is_not(None)))
                result |= {row.parameter: float(row.expanded) for row in rows}
            return result

    def batches(self) -> list[str]:
        """Return the batches' names, the latest first."""
        query = select(MOTOR.c.batch).group_by(MOTOR.c.batch).order_by(func.max(MOTOR.c.started).desc())
        with self._engine.connect() as connection:
            return list(connection.execute(query).scalars())

    def ends(self) -> Iterator[datetime]:
        """Give when (UTC) each test ended, in the order in which they were kept."""
        query = select(MOTOR.c.ended).order_by(MOTOR.c.id)
        with self._engine.connect() as connection:
            yield from map(utc, connection.execution_options(yield_per=5000).execute(query).scalars())

    def read(self, batch: str | None = None, narrowed: ColumnElement[bool] | None = None) -> Iterator[MotorRecord]:
        """Give the records in the order in which they were kept, a few at a time; what is added meanwhile may be among them.

        `narrowed` is a condition on their rows.
        """
        last = 0
        while True:
            query = select(MOTOR).where(MOTOR.c.id > last).order_by(MOTOR.c.id).limit(_AT_ONCE)
            if batch is not None:
                query = query.where(MOTOR.c.batch == batch)
            if narrowed is not None:
                query = query.where(narrowed)
            with self._engine.connect() as connection:
                rows = connection.execute(query).mappings().all()
                records = _restored(connection, rows)
            yield from records
            if len(rows) < _AT_ONCE:
                return
            last = rows[-1]["id"]

    def remove(self, batch: str, is_own: Callable[[int, str], bool] = lambda *_: True) -> int:
        """Remove the records of the batches of a name, those that `is_own` tells by number and identifier; return how many.

        The plan goes with the last batch of the name. Raises StoreError.
        """
        try:
            settle(self._engine)
            with self._engine.begin() as connection:
                named = select(MOTOR.c.id, MOTOR.c.number, MOTOR.c.identifier).where(MOTOR.c.batch == batch)
                rows = connection.execute(named).all()
                keys = [row.id for row in rows if is_own(row.number, row.identifier)]
                for first in range(0, len(keys), _AT_ONCE):
                    # A trigger of the tables forgets what was summed up.
                    connection.execute(delete(MOTOR).where(MOTOR.c.id.in_(keys[first : first + _AT_ONCE])))
                if len(keys) == len(rows):
                    forget_plans(connection, batch)
                return len(keys)
        except FAULTS as error:
            raise fault_of(error) from error

    def of_motor(self, serial_number: str) -> list[MotorRecord]:
        """Return all tests of a serial number, the first one first."""
        order = (MOTOR.c.test_number, MOTOR.c.started, MOTOR.c.id)
        query = select(MOTOR).where(MOTOR.c.serial_number.in_(spellings(serial_number))).order_by(*order)
        with self._engine.connect() as connection:
            return _restored(connection, connection.execute(query).mappings().all())

    def find(self, identifier: str) -> MotorRecord | None:
        """Return one record."""
        with self._engine.connect() as connection:
            rows = connection.execute(select(MOTOR).where(MOTOR.c.identifier == identifier)).mappings().all()
            records = _restored(connection, rows)
        return records[0] if records else None


def _restored(connection: Connection, rows: Sequence[Mapping[Any, Any]]) -> list[MotorRecord]:
    """Return the records of some rows, with their figures, checks and waveforms."""
    keys = [row["id"] for row in rows]
    parts: list[dict[int, list[Mapping[Any, Any]]]] = []
    # In one query, or figures would be missed that another process puts into their table between two.
    kept = select(FIGURE).where(FIGURE.c.motor.in_(keys))
    fresh = select(*(FRESH_FIGURE.c[column.name] for column in FIGURE.columns)).where(FRESH_FIGURE.c.motor.in_(keys))
    queries: tuple[Select[Any] | CompoundSelect[Any], ...] = (
        union_all(kept, fresh).order_by("parameter"),
        select(CHECK).where(CHECK.c.motor.in_(keys)).order_by(CHECK.c.procedure, CHECK.c.attempt),
        select(WAVEFORM).where(WAVEFORM.c.motor.in_(keys)).order_by(WAVEFORM.c.path),
    )
    for query in queries:
        by_motor: dict[int, list[Mapping[Any, Any]]] = {key: [] for key in keys}
        for part in connection.execute(query).mappings():
            by_motor[part["motor"]].append(part)
        parts.append(by_motor)
    figures, checks, waves = parts
    labels = own_labels(connection)
    return [
        MotorRecord(
            **{name: row[name] for name in _PLAIN},
            started=utc(row["started"]),
            ended=utc(row["ended"]),
            verdict=Verdict(row["verdict"]),
            measured=tuple(_measured(figure, labels) for figure in figures[row["id"]]),
            checks=tuple(
                CheckRecord(c["procedure"], c["attempt"], Verdict(c["verdict"]), c["duration"], c["cause"])
                for c in checks[row["id"]]
            ),
            waveforms={wave["path"]: wave["sha256"] for wave in waves[row["id"]]},
        )
        for row in rows
    ]


def own_labels(connection: Connection) -> dict[str, str]:
    """Return what readers call the parameters that are not in the table of all."""
    return {row.parameter: row.label for row in connection.execute(select(PARAMETER_LABEL))}


def _measured(row: Mapping[Any, Any], labels: Mapping[str, str]) -> MeasuredFigure:
    return MeasuredFigure(
        row["parameter"],
        _or(row["value"], math.nan),
        row["unit"],
        _or(row["standard_uncertainty"], math.nan),
        _or(row["expanded"], math.nan),
        _or(row["low"], -math.inf),
        _or(row["high"], math.inf),
        Verdict(row["verdict"]),
        labels.get(row["parameter"], ""),
    )


def _or(value: float | None, otherwise: float) -> float:
    return otherwise if value is None else float(value)


def utc(value: datetime) -> datetime:
    """Return a time as it was stored: SQLite keeps it without its zone, which is UTC."""
    return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)
