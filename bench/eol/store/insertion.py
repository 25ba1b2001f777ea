"""Putting a record into the tables, in the driver's own words: of a record's cost, SQLAlchemy's would be the larger part."""

from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache
from math import isfinite
from typing import Any

from sqlalchemy import Column, Connection, Dialect, Engine, Insert, Table, delete, insert, select, update
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.exc import DBAPIError

from bench.eol.record import MotorRecord
from bench.eol.serial_number import spelled, spellings
from bench.eol.store.database import place_of, reason
from bench.eol.store.faults import RefusedError
from bench.eol.store.schema import CHECK, FIGURE, FRESH_FIGURE, MOTOR, PARAMETER_LABEL, SERIAL_CLAIM, WAVEFORM
from bench.eol.store.summed_tables import REPEATED_TEST
from bench.i18n.errors import InputError
from drivers.interfaces.text import text

#: Of so many motors the figures go into their table together: their index by value then costs a page for each parameter once, and
#: not with every motor. The motor that has it done waits some milliseconds.
_TOGETHER = 32

_FIGURE_COLUMNS = tuple(column.name for column in FIGURE.columns)
_MOTOR_COLUMNS = tuple(column for column in MOTOR.columns if column.name != "id")


def insert_record(connection: Connection, record: MotorRecord) -> bool:
    """Insert a record within the connection's transaction, by the one spelling of its serial number; tells whether it was new.

    Earlier tests that have another spelling get this one: who counts motors counts serial numbers. Raises RefusedError where another
    motor's test has its identifier.
    """
    record = replace(record, serial_number=spelled(record.serial_number))
    row = [getattr(record, column.name) for column in _MOTOR_COLUMNS]
    sql, values = _motor(connection.dialect)
    motor = connection.exec_driver_sql(sql, values(row)).scalar_one_or_none()
    # From here on the record says what became of the serial number.
    connection.exec_driver_sql(_claim_end(connection.dialect), (record.serial_number, record.identifier))
    if motor is None:
        _check_same(connection, record)
        return False
    if record.test_number > 1:
        others = [spelling for spelling in spellings(record.serial_number) if spelling != record.serial_number]
        spell_alike(connection, record.serial_number, others)
    figures = [
        (
            motor,
            m.parameter,
            # Databases order numbers that are none in ways of their own: they are kept as nothing.
            m.value if isfinite(m.value) else None,
            m.unit,
            m.standard_uncertainty if isfinite(m.standard_uncertainty) else None,
            m.expanded if isfinite(m.expanded) else None,
            m.low if isfinite(m.low) else None,
            m.high if isfinite(m.high) else None,
            m.verdict.value,
        )
        for m in record.measured
    ]
    checks = [(motor, c.procedure, c.attempt, c.verdict.value, c.duration, c.cause) for c in record.checks]
    waves = [(motor, path, sha256) for path, sha256 in record.waveforms.items()]
    own_file = connection.dialect.name == "sqlite"
    for table, rows in ((FRESH_FIGURE if own_file else FIGURE, figures), (CHECK, checks), (WAVEFORM, waves)):
        if rows:
            sql, parameters_of = _part(table, connection.dialect)
            connection.exec_driver_sql(sql, parameters_of(rows))
    if labels := sorted({m.parameter: m.label for m in record.measured if m.label}.items()):
        sql, parameters_of = _labels(connection.dialect)
        connection.exec_driver_sql(sql, parameters_of(labels))
    if own_file and _motors_with_fresh_figures(connection) >= _TOGETHER:
        settle_within(connection)
    return True


def spell_alike(connection: Connection, serial_number: str, others: Collection[str]) -> None:
    """Give a motor's tests that have one of the `others` spellings of its serial number this one."""
    for table in (MOTOR, REPEATED_TEST):
        of_it = table.c.serial_number.in_(others)
        connection.execute(update(table).where(of_it).values(serial_number=serial_number))


def _check_same(connection: Connection, record: MotorRecord) -> None:
    """Raise RefusedError where the identifier is another record's: one of the two would be lost without a word."""
    columns = (MOTOR.c.serial_number, MOTOR.c.verdict, MOTOR.c.journal_sha256)
    there = connection.execute(select(*columns).where(MOTOR.c.identifier == record.identifier)).one()
    same = spelled(there.serial_number), there.verdict, there.journal_sha256
    if same != (record.serial_number, record.verdict.value, record.journal_sha256):
        raise RefusedError(
            text(
                "another test has its identifier: {serial}, {verdict}. The batch's folder was copied and measured in two places; "
                "give one of them another --batch",
                serial=there.serial_number,
                verdict=there.verdict,
            )
        )


def settle(engine: Engine) -> None:
    """Put all figures that were kept into their table. Raises InputError where the file cannot be written now."""
    try:
        with engine.connect() as connection:
            if connection.dialect.name == "sqlite" and _motors_with_fresh_figures(connection):
                # The lock at once: a transaction that has read before is refused where another writer was quicker, and does not wait.
                connection.exec_driver_sql("BEGIN IMMEDIATE")
                settle_within(connection)
                connection.commit()
    except DBAPIError as error:
        raise InputError(
            text(
                "{place}: the latest motors' figures cannot be written to their table: {reason}. They are kept; "
                "make sure that the file can be written, that its disk is not full, and that no other process "
                "holds it",
                place=place_of(engine),
                reason=reason(error),
            )
        ) from None


@contextmanager
def settled(engine: Engine) -> Iterator[Connection]:
    """Give a connection for queries of figures: all that were kept till now are in their table. Raises as `settle` does.

    What is kept, summed up or removed meanwhile is not seen.
    """
    settle(engine)
    with engine.connect() as connection:
        if connection.dialect.name == "sqlite":
            connection.exec_driver_sql("BEGIN")
        else:
            connection.execution_options(isolation_level="REPEATABLE READ")
        yield connection


def _motors_with_fresh_figures(connection: Connection) -> int:
    """Return of how many motors figures are not in their table yet; of those that follow each other, both ends tell."""
    ends = "SELECT (SELECT max(motor) FROM fresh_figure) - (SELECT min(motor) FROM fresh_figure) + 1"
    return connection.exec_driver_sql(ends).scalar_one() or 0


def settle_within(connection: Connection) -> None:
    """Put all figures that were kept into their table, within the connection's transaction."""
    columns = [FRESH_FIGURE.c[name] for name in _FIGURE_COLUMNS]
    connection.execute(insert(FIGURE).from_select(_FIGURE_COLUMNS, select(*columns)))
    connection.execute(delete(FRESH_FIGURE))


@lru_cache(maxsize=4)
def _motor(dialect: Dialect) -> tuple[str, Callable[[Sequence[Any]], Any]]:
    """Return the insertion of a motor that gives its key, or nothing where its identifier is known; and what makes its values."""
    insertion = (postgresql if dialect.name == "postgresql" else sqlite).insert(MOTOR)
    statement = insertion.on_conflict_do_nothing(index_elements=[MOTOR.c.identifier]).returning(MOTOR.c.id)
    names = [column.name for column in _MOTOR_COLUMNS]
    compiled = statement.compile(dialect=dialect, column_keys=names)
    converts = [_conversion(column, dialect) for column in _MOTOR_COLUMNS]

    def values(row: Sequence[Any]) -> Any:
        plain = tuple(convert(value) for convert, value in zip(converts, row, strict=True))
        return plain if compiled.positional else dict(zip(names, plain, strict=True))

    return str(compiled), values


@lru_cache(maxsize=4)
def _claim_end(dialect: Dialect) -> str:
    """Return what lets go of a serial number that was claimed for a record."""
    mark = "?" if dialect.name == "sqlite" else "%s"
    return f"DELETE FROM {SERIAL_CLAIM.name} WHERE serial_number = {mark} AND identifier = {mark}"  # noqa: S608


def _conversion(column: Column[Any], dialect: Dialect) -> Callable[[Any], Any]:
    if column is MOTOR.c.verdict:
        return lambda verdict: verdict.value
    convert = column.type.dialect_impl(dialect).bind_processor(dialect)
    return convert if convert is not None else lambda value: value


@lru_cache(maxsize=4)
def _labels(dialect: Dialect) -> tuple[str, Callable[[list[tuple[Any, ...]]], Any]]:
    """Return what keeps parameters' labels, the latest of each, and what makes its values of pairs."""
    own = (postgresql if dialect.name == "postgresql" else sqlite).insert(PARAMETER_LABEL)
    changed = own.excluded.label
    return _compiled(
        own.on_conflict_do_update(
            index_elements=[PARAMETER_LABEL.c.parameter],
            set_={"label": changed},
            where=PARAMETER_LABEL.c.label != changed,
        ),
        PARAMETER_LABEL,
        dialect,
    )


@lru_cache(maxsize=16)
def _part(table: Table, dialect: Dialect) -> tuple[str, Callable[[list[tuple[Any, ...]]], Any]]:
    """Return the insertion into a table whose columns need no conversion, and what makes its values of rows."""
    return _compiled(insert(table), table, dialect)


def _compiled(statement: Insert, table: Table, dialect: Dialect) -> tuple[str, Callable[[list[tuple[Any, ...]]], Any]]:
    names = [column.name for column in table.columns]
    compiled = statement.compile(dialect=dialect, column_keys=names)

    def values(rows: list[tuple[Any, ...]]) -> Any:
        return rows if compiled.positional else [dict(zip(names, row, strict=True)) for row in rows]

    return str(compiled), values
