"""Tests counted by what they have in common, and those of motors that were tested more than once, one by one."""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from typing import Any, TypeVar

from sqlalchemy import ColumnElement, Connection, Select, String, case, cast, func, select
from sqlalchemy import Integer as Whole

from bench.eol.store.records import utc
from bench.eol.store.schema import CHECK, MOTOR, REPEATED_SERIAL, SUMMED_ATTEMPTS
from bench.eol.store.selection import Selection
from bench.eol.store.stretches import StretchesByKey, among, joined, unsummed
from bench.eol.store.stretches import without as without_stretches
from bench.eol.verdict import Verdict

#: Times are told apart to so much: no zone and no shift begins between.
STEP = timedelta(minutes=5)
_AT_ONCE = 500
_UNJUDGED = (Verdict.ERROR.value, Verdict.ABORTED.value)
_BAD = func.sum(case((CHECK.c.verdict == Verdict.PASS.value, 0), else_=1))
_Value = TypeVar("_Value")


@dataclass(frozen=True)
class Occasion:
    """Where and by which plan tests were made, and when they began (UTC; of tests that were counted, to five minutes)."""

    station: str
    socket: str
    plan: str
    started: datetime


#: Where nothing of it is told apart.
ANY_OCCASION = Occasion("", "", "", datetime.min.replace(tzinfo=UTC))


@dataclass(frozen=True)
class MotorTest:
    """One test of a motor that was tested more than once; `chosen` tells whether it is of the selection."""

    identifier: int
    serial_number: str
    occasion: Occasion
    verdict: Verdict
    first_pass: bool
    chosen: bool


def counted_tests(
    connection: Connection, selection: Selection, told_apart: Collection[str]
) -> Iterator[tuple[Occasion, Verdict, bool, int]]:
    """Give how many tests of a selection have an occasion, a verdict, and whether they passed at once, in common.

    Occasions are `told_apart` by these of their fields only, for each further one costs the database a sort; the others say nothing.
    """
    # The times first: records are kept in their order, and are all but sorted.
    fields = {"started": _step(connection), "socket": MOTOR.c.socket, "station": MOTOR.c.station, "plan": MOTOR.c.plan}
    occasion = {name: column for name, column in fields.items() if name in told_apart}
    columns = (*occasion.values(), MOTOR.c.verdict, MOTOR.c.first_pass)
    query = select(*columns, func.count()).where(selection.holds(MOTOR.c.id)).group_by(*columns)
    for *known, verdict, first_pass, count in connection.execute(query):
        found = dict(zip(occasion, known, strict=True))
        if "started" in found:
            found["started"] = _time(found["started"])
        yield replace(ANY_OCCASION, **found), Verdict(verdict), bool(first_pass), count


def repeated_tests(connection: Connection, selection: Selection) -> list[MotorTest]:
    """Return all tests of the serial numbers that have more than one, in the order in which they began."""
    columns = (MOTOR.c[name] for name in ("id", "serial_number", "station", "socket", "plan", "started", "verdict"))
    query = select(*columns, MOTOR.c.first_pass, selection.holds(MOTOR.c.id).label("chosen"))
    noted = select(REPEATED_SERIAL.c.serial_number)
    tests = {row["id"]: row for row in connection.execute(query.where(MOTOR.c.serial_number.in_(noted))).mappings()}
    for some in _some(list(connection.execute(_repeated_beside(selection)).scalars())):
        rows = connection.execute(query.where(MOTOR.c.serial_number.in_(some))).mappings()
        tests.update((row["id"], row) for row in rows)
    golden = set(selection.golden)
    result = [_test(row) for row in tests.values() if row["serial_number"] not in golden]
    return sorted(result, key=lambda test: (test.occasion.started, test.identifier))


def _repeated_beside(selection: Selection) -> Select[str]:
    """Return the query for serial numbers that a test beyond the summed-up stretches shares with another."""
    if not selection.summed:
        return select(MOTOR.c.serial_number).group_by(MOTOR.c.serial_number).having(func.count() > 1)
    other = MOTOR.alias("other")
    shared = select(other.c.id).where(other.c.serial_number == MOTOR.c.serial_number, other.c.id != MOTOR.c.id)
    beyond = among(MOTOR.c.id, unsummed(selection.summed))
    return select(MOTOR.c.serial_number).where(beyond, shared.exists()).distinct()


def first_attempts(connection: Connection, selection: Selection, without: Sequence[int]) -> dict[str, tuple[int, int]]:
    """Return of each procedure of how many judged tests it was part, and how many did not pass its first attempt.

    Tests that were not judged are left out, and the judged ones `without` which it is to be counted.
    """
    counts: dict[str, list[int]] = {}

    def add(rows: Iterable[Any], sign: int) -> None:
        for procedure, tests, bad in rows:
            count = counts.setdefault(procedure, [0, 0])
            # A server sums up to decimal numbers.
            count[0] += sign * int(tests)
            count[1] += sign * int(bad)

    def read(condition: ColumnElement[bool], sign: int) -> None:
        query = select(CHECK.c.procedure, func.count(), _BAD).where(CHECK.c.attempt == 1, condition)
        add(connection.execute(query.group_by(CHECK.c.procedure)), sign)

    rest = without_stretches(selection.stretches, selection.summed)
    if selection.summed:
        add(_summed_attempts(connection, selection), 1)
        add(_golden_attempts(connection, selection), -1)
    if rest:
        beyond = selection.holds(CHECK.c.motor)
        if selection.summed:
            beyond &= among(CHECK.c.motor, rest)
        read(beyond, 1)
        unjudged = select(MOTOR.c.id).where(MOTOR.c.verdict.in_(_UNJUDGED), among(MOTOR.c.id, rest))
        read(beyond & CHECK.c.motor.in_(unjudged), -1)
    for some in _some(without):
        read(CHECK.c.motor.in_(some), -1)
    return {procedure: (tests, bad) for procedure, (tests, bad) in sorted(counts.items()) if tests}


def _summed_attempts(connection: Connection, selection: Selection) -> Sequence[Any]:
    query = select(
        SUMMED_ATTEMPTS.c.procedure, func.sum(SUMMED_ATTEMPTS.c.tests), func.sum(SUMMED_ATTEMPTS.c.bad)
    ).where(SUMMED_ATTEMPTS.c.model == selection.model, among(SUMMED_ATTEMPTS.c.first, joined(selection.summed)))
    if not selection.everything:
        query = query.where(SUMMED_ATTEMPTS.c.batch.in_(selection.batches))
    return connection.execute(query.group_by(SUMMED_ATTEMPTS.c.procedure)).all()


def _golden_attempts(connection: Connection, selection: Selection) -> Iterator[tuple[str, int, int]]:
    """Give the golden motors' attempts that are among those summed up."""
    if not selection.golden:
        return
    query = (
        select(MOTOR.c.id, CHECK.c.procedure, CHECK.c.verdict)
        .join(CHECK, CHECK.c.motor == MOTOR.c.id)
        .where(
            MOTOR.c.serial_number.in_(selection.golden),
            MOTOR.c.model == selection.model,
            MOTOR.c.verdict.not_in(_UNJUDGED),
            CHECK.c.attempt == 1,
        )
    )
    if not selection.everything:
        query = query.where(MOTOR.c.batch.in_(selection.batches))
    summed = StretchesByKey(selection.summed)
    for row in connection.execute(query):
        if row.id in summed:
            yield row.procedure, 1, int(row.verdict != Verdict.PASS.value)


def _some(values: Sequence[_Value]) -> Iterator[Sequence[_Value]]:
    """Give values some at a time: a query has room for so many."""
    yield from (values[first : first + _AT_ONCE] for first in range(0, len(values), _AT_ONCE))


def _test(row: Any) -> MotorTest:
    occasion = Occasion(row["station"], row["socket"], row["plan"], utc(row["started"]))
    return MotorTest(
        row["id"], row["serial_number"], occasion, Verdict(row["verdict"]), bool(row["first_pass"]), bool(row["chosen"])
    )


def _step(connection: Connection) -> ColumnElement[Any]:
    seconds = round(STEP.total_seconds())
    if connection.dialect.name == "postgresql":
        # date_part gives binary numbers; with the decimal ones of EXTRACT it takes twice as long.
        return cast(func.floor(func.date_part("epoch", MOTOR.c.started) / float(seconds)) * seconds, Whole)
    # SQLite keeps times as text: parsing a million takes longer than all the rest.
    ten, one = (func.substr(MOTOR.c.started, *place, type_=String) for place in ((1, 15), (16, 1)))
    return ten.concat(case((one >= "5", "5"), else_="0"))


def _time(at: Any) -> datetime:
    return datetime.fromisoformat(at).replace(tzinfo=UTC) if isinstance(at, str) else datetime.fromtimestamp(at, UTC)
