"""Single motors of a selection: by figure, by verdict, by serial number; and the figures of those that failed somewhere."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import Connection, RowMapping, Select, select, union

from bench.eol.serial_number import spellings
from bench.eol.store.records import utc
from bench.eol.store.schema import CHECK, FIGURE, MOTOR, NOT_PASSED
from bench.eol.store.selection import Selection
from bench.eol.store.tallies import parameters
from bench.eol.told_causes import cause_told
from bench.eol.verdict import Verdict
from bench.files.toml_file import nearest
from bench.i18n.errors import UsageError
from bench.i18n.language import translator
from drivers.interfaces.text import text

#: Failed motors, the latest, that are compared with all.
_FAILED = 1000


@dataclass(frozen=True)
class FoundMotor:
    """A motor's test: where its record and its run are, and the value (`unit`) of the parameter that was asked for, if one was.

    `cause` is English, but of older records.
    """

    batch: str
    number: int
    serial_number: str
    station: str
    socket: str
    started: datetime
    verdict: Verdict
    cause: str
    run: str
    journal_sha256: str
    value: float | None
    unit: str


def motors_by_figure(
    connection: Connection, selection: Selection, parameter: str, low: float | None, high: float | None, most: int
) -> list[FoundMotor]:
    """Return the motors whose figure lies from `low` to `high`, in the figure's order."""
    conditions = [FIGURE.c.parameter == parameter, selection.holds(FIGURE.c.motor), FIGURE.c.value.is_not(None)]
    if low is not None:
        conditions.append(FIGURE.c.value >= low)
    if high is not None:
        conditions.append(FIGURE.c.value <= high)
    query = (
        select(FIGURE.c.motor, FIGURE.c.value, FIGURE.c.unit).where(*conditions).order_by(FIGURE.c.value).limit(most)
    )
    figures = connection.execute(query).all()
    motors = _motors(connection, [row.motor for row in figures])
    return [_found(motors[row.motor], row.value, row.unit) for row in figures]


def motors_not_passed(connection: Connection, selection: Selection, failed_at: str, most: int) -> list[FoundMotor]:
    """Return the motors that failed at a parameter or a procedure, at any where none is named, the latest first."""
    if failed_at:
        keys = list(connection.execute(_failed_at(failed_at, selection, most)).scalars())
    else:
        key = MOTOR.c.id
        query = select(key).where(NOT_PASSED, selection.holds(key)).order_by(key.desc()).limit(most)
        keys = list(connection.execute(query).scalars())
    motors = _motors(connection, keys)
    return [_found(motors[key], None, "") for key in sorted(motors, reverse=True)]


def motors_by_serial_number(connection: Connection, serial_numbers: Sequence[str], most: int) -> list[FoundMotor]:
    """Return all tests of some motors, in any batch and of any type, the latest first."""
    any_of = [spelling for serial_number in serial_numbers for spelling in spellings(serial_number)]
    query = select(MOTOR).where(MOTOR.c.serial_number.in_(any_of)).order_by(MOTOR.c.id.desc()).limit(most)
    return [_found(row, None, "") for row in connection.execute(query).mappings()]


def check_measured(connection: Connection, name: str) -> None:
    """Raise UsageError for what is no parameter and no procedure of any record: that nothing failed there says nothing."""
    known = {*parameters(connection), *connection.execute(select(CHECK.c.procedure).distinct()).scalars()}
    if name not in known:
        hint = nearest(name, sorted(known))
        raise UsageError(text("the records have no parameter or procedure {name!r}; {hint}", name=name, hint=hint))


def figures_of_failed(
    connection: Connection, selection: Selection, failed_at: str, *, of_procedure: bool
) -> dict[str, list[float]]:
    """Return by parameter the figures of the latest motors that failed at a parameter or a procedure, up to a thousand.

    Of a procedure those are left out that failed themselves: they may be its own, and why it failed.
    """
    keys = list(connection.execute(_failed_at(failed_at, selection, _FAILED)).scalars())
    columns = FIGURE.c.parameter, FIGURE.c.value, FIGURE.c.verdict
    query = select(*columns).where(FIGURE.c.motor.in_(keys), FIGURE.c.value.is_not(None))
    values: dict[str, list[float]] = {}
    left_out = set[str]()
    for row in connection.execute(query):
        values.setdefault(row.parameter, []).append(row.value)
        if of_procedure and row.verdict == Verdict.FAIL.value:
            left_out.add(row.parameter)
    return {name: each for name, each in values.items() if name not in left_out}


def _failed_at(name: str, selection: Selection, most: int) -> "Select[int]":
    fail = Verdict.FAIL.value
    # Both out of the indexes of what did not pass: the table of motors is not looked at.
    keys = union(
        *(
            select(table.c.motor.label("motor")).where(
                NOT_PASSED, column == name, table.c.verdict == fail, selection.holds(table.c.motor)
            )
            for table, column in ((FIGURE, FIGURE.c.parameter), (CHECK, CHECK.c.procedure))
        )
    ).subquery()
    return select(keys.c.motor).order_by(keys.c.motor.desc()).limit(most)


def _motors(connection: Connection, keys: Sequence[int]) -> dict[int, RowMapping]:
    return {row["id"]: row for row in connection.execute(select(MOTOR).where(MOTOR.c.id.in_(keys))).mappings()}


def _found(get: RowMapping, value: float | None, unit: str) -> FoundMotor:
    return FoundMotor(
        batch=get["batch"],
        number=get["number"],
        serial_number=get["serial_number"],
        station=get["station"],
        socket=get["socket"],
        started=utc(get["started"]),
        verdict=Verdict(get["verdict"]),
        cause=cause_told(get["told"], get["cause"]).render(translator("en")),
        run=get["run"],
        journal_sha256=get["journal_sha256"],
        value=value,
        unit=unit,
    )
