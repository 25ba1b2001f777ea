"""Motors that were tested more than once, and first attempts at procedures."""

import json
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, Connection, Select, Subquery, case, func, select

from bench.eol.store.occasions import JUDGED, CountedTests, occasion_of
from bench.eol.store.repeated_tests import ORDERED_BY, in_order, not_in_order
from bench.eol.store.schema import CHECK, MOTOR
from bench.eol.store.selection import Selection
from bench.eol.store.stretches import StretchesByKey, among, joined
from bench.eol.store.stretches import without as without_stretches
from bench.eol.store.summed_tables import REPEATED_TEST, SUMMED_ATTEMPTS
from bench.eol.verdict import Verdict

_BAD = func.sum(case((CHECK.c.verdict == Verdict.PASS.value, 0), else_=1))


@dataclass(frozen=True)
class RepeatedTests:
    """The correction from counted tests to motors: each motor counts once, at its first judged test of the selection.

    A motor passed in the end where its last judged test there did. `retested` motors have several judged tests there.
    """

    counted: tuple[CountedTests, ...]
    retested: int


def repeated_tests(connection: Connection, selection: Selection, told_apart: Collection[str]) -> RepeatedTests:
    """Return what motors with several tests change in counts by these of `station`, `socket`, `plan` and `step`."""
    counted, again = [], 0
    for query in (_of_kept_order(selection, told_apart), _of_order_to_be_found(connection, selection, told_apart)):
        for *known, retested, is_first, is_first_ever, at_once, passed, motor_passed, count in connection.execute(
            query
        ):
            occasion = occasion_of(dict(zip(told_apart, known, strict=True)))
            counted.append(CountedTests(occasion, bool(at_once), bool(passed), -count))
            again += count if retested else 0
            if is_first:
                counted.append(
                    CountedTests(occasion, bool(at_once), bool(motor_passed), count, first_ever=bool(is_first_ever))
                )
    return RepeatedTests(tuple(counted), again)


def _of_kept_order(selection: Selection, told_apart: Collection[str]) -> Select[Any]:
    """Return the query for counts of tests by these fields and by what they say of their motor."""
    tests = REPEATED_TEST.c
    first = tests.place == 1
    columns = (
        *(tests[name] for name in told_apart),
        (first & (tests.tests > 1)).label("retested"),
        first.label("first"),
        first.label("first_ever"),
        tests.at_once,
        tests.passed,
        tests.last_passed,
    )
    return select(*columns, func.count()).where(in_order(selection)).group_by(*columns)


def _of_order_to_be_found(connection: Connection, selection: Selection, told_apart: Collection[str]) -> Select[Any]:
    """Return the same query for tests whose order depends on the selection, or is not kept."""
    found = not_in_order(connection, selection, told_apart)
    motor, there, order = _windows(found, selection)
    tests = select(
        found,
        func.row_number().over(partition_by=motor, order_by=order).label("place_ever"),
        func.row_number().over(partition_by=there, order_by=order).label("place"),
        # Over the window that is in order already: each further order costs the database a sort.
        func.last_value(found.c.passed).over(partition_by=there, order_by=order, rows=(None, None)).label("last"),
        func.count().over(partition_by=there, order_by=order, rows=(None, None)).label("tests"),
    ).subquery("ordered")
    first = tests.c.place == 1
    columns = (
        *(tests.c[name] for name in told_apart),
        (first & (tests.c.tests > 1)).label("retested"),
        first.label("first"),
        (tests.c.place_ever == 1).label("first_ever"),
        tests.c.at_once,
        tests.c.passed,
        tests.c.last.label("motor_passed"),
    )
    return select(*columns, func.count()).where(tests.c.chosen).group_by(*columns)


def _windows(tests: Subquery, selection: Selection) -> tuple[Any, Any, Any]:
    """Return what puts tests of a motor together, those of it in and those out of the selection, and their order."""
    motor = (tests.c.serial_number,)
    return (
        motor,
        motor if selection.everything else (*motor, tests.c.chosen),
        tuple(tests.c[name] for name in ORDERED_BY),
    )


def first_attempts(connection: Connection, selection: Selection) -> dict[str, tuple[int, int]]:
    """Return of each procedure of how many judged tests it was part, and how many did not pass its first attempt.

    Tests that were not judged are left out, and of a motor that was judged more than once all but the first ever.
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
        unjudged = select(MOTOR.c.id).where(~JUDGED, among(MOTOR.c.id, rest))
        read(beyond & CHECK.c.motor.in_(unjudged), -1)
    kept = REPEATED_TEST.c
    later = select(kept.attempts, func.count()).where(in_order(selection), kept.place > 1)
    add(_of_texts(connection.execute(later.group_by(kept.attempts))), -1)
    found = not_in_order(connection, selection, ())
    motor, _, order = _windows(found, selection)
    place = func.row_number().over(partition_by=motor, order_by=order).label("place")
    tests = select(found.c.motor, found.c.attempts, found.c.chosen, place).subquery("ordered")
    again = tests.c.chosen & (tests.c.place > 1)
    counts_of = connection.execute(select(tests.c.attempts, func.count()).where(again).group_by(tests.c.attempts)).all()
    add(_of_texts(row for row in counts_of if row[0] is not None), -1)
    if any(row[0] is None for row in counts_of):
        read(CHECK.c.motor.in_(select(tests.c.motor).where(again, tests.c.attempts.is_(None))), -1)
    return {procedure: (tests, bad) for procedure, (tests, bad) in sorted(counts.items()) if tests}


def _of_texts(rows: Iterable[Any]) -> Iterator[tuple[str, int, int]]:
    """Give procedures, tests and first attempts that did not pass from kept texts and how often each is there."""
    for attempts, count in rows:
        for procedure, bad in json.loads(attempts):
            yield procedure, count, count * bad


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
            JUDGED,
            CHECK.c.attempt == 1,
        )
    )
    if not selection.everything:
        query = query.where(MOTOR.c.batch.in_(selection.batches))
    summed = StretchesByKey(selection.summed)
    for row in connection.execute(query):
        if row.id in summed:
            yield row.procedure, 1, int(row.verdict != Verdict.PASS.value)
