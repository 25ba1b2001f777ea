"""Judged tests of motors that have several: kept beside each other as stretches are summed up, and read together with the rest."""

import json
from collections.abc import Collection, Mapping, Sequence
from itertools import groupby
from operator import itemgetter
from typing import Any

from sqlalchemy import (
    ColumnElement,
    Connection,
    Select,
    Subquery,
    and_,
    bindparam,
    false,
    func,
    insert,
    null,
    or_,
    select,
    true,
    update,
)
from sqlalchemy.dialects import postgresql, sqlite

from bench.eol.store.occasions import JUDGED, PLACE, step_of_start
from bench.eol.store.schema import CHECK, MOTOR
from bench.eol.store.selection import Selection
from bench.eol.store.stretches import among, unsummed
from bench.eol.store.summed_tables import REPEATED_SERIAL, REPEATED_TEST
from bench.eol.verdict import Verdict

#: Serial numbers, or tests, that one query names.
_AT_ONCE = 500
_PASSED = MOTOR.c.verdict == Verdict.PASS.value
_COMMON: Mapping[str, Any] = {
    "serial_number": MOTOR.c.serial_number,
    "started": MOTOR.c.started,
    "passed": _PASSED,
    "at_once": MOTOR.c.first_pass & _PASSED,
}
_ORDER = ("place", "tests", "last_passed")
#: Which test of its motor a kept one is, as its row says.
_KEPT_NUMBER = (
    select(MOTOR.c.test_number).where(MOTOR.c.id == REPEATED_TEST.c.motor).scalar_subquery().label("test_number")
)
#: A motor's tests one after the other: as many as each knew of before it. The clock, which may have been put back, comes second.
ORDERED_BY = ("test_number", "started", "motor")


def keep_repeated(connection: Connection, first: int, last: int) -> None:
    """Keep the judged tests of the serial numbers that a test with a key `first` … `last` shares with another."""
    others = MOTOR.alias("others")
    again = select(MOTOR.c.serial_number).where(
        MOTOR.c.id.between(first, last),
        select(others.c.id).where(others.c.serial_number == MOTOR.c.serial_number, others.c.id != MOTOR.c.id).exists(),
    )
    keep_tests_of(connection, list(connection.execute(again.distinct()).scalars()))


def keep_tests_of(connection: Connection, serial_numbers: Sequence[str]) -> None:
    """Keep the judged tests of some serial numbers."""
    # By name: of a query within a query a server that plans it once for all stretches reads every attempt there is.
    for start in range(0, len(serial_numbers), _AT_ONCE):
        some = serial_numbers[start : start + _AT_ONCE]
        insertion = (postgresql if connection.dialect.name == "postgresql" else sqlite).insert(REPEATED_SERIAL)
        connection.execute(insertion.on_conflict_do_nothing(), [{"serial_number": each} for each in some])
        _keep_in_order(connection, some, _unkept_tests(connection, some))


def _unkept_tests(connection: Connection, serial_numbers: Sequence[str]) -> list[dict[str, Any]]:
    columns = {**_COMMON, **PLACE, "step": step_of_start(connection), "batch": MOTOR.c.batch, "model": MOTOR.c.model}
    new = select(
        MOTOR.c.id.label("motor"), MOTOR.c.test_number, *(column.label(name) for name, column in columns.items())
    ).where(MOTOR.c.serial_number.in_(serial_numbers), JUDGED)
    kept = select(REPEATED_TEST.c.motor).where(REPEATED_TEST.c.serial_number.in_(serial_numbers))
    # Taken out here: a server that planned it while nothing was kept would go through all that is.
    known = set(connection.execute(kept).scalars())
    tests = [dict(row) for row in connection.execute(new).mappings() if row["motor"] not in known]
    attempts: dict[int, list[tuple[str, int]]] = {test["motor"]: [] for test in tests}
    keys = list(attempts)
    for start in range(0, len(keys), _AT_ONCE):
        query = select(CHECK.c.motor, CHECK.c.procedure, CHECK.c.verdict).where(
            CHECK.c.motor.in_(keys[start : start + _AT_ONCE]), CHECK.c.attempt == 1
        )
        for motor, procedure, verdict in connection.execute(query):
            attempts[motor].append((procedure, int(verdict != Verdict.PASS.value)))
    return [test | {"attempts": json.dumps(sorted(attempts[test["motor"]]), ensure_ascii=False)} for test in tests]


def _keep_in_order(connection: Connection, serial_numbers: Sequence[str], new: Sequence[Mapping[str, Any]]) -> None:
    """Keep new tests of some serial numbers, and say of each of their tests which it is."""
    table = REPEATED_TEST.c
    columns = (table.serial_number, table.started, table.motor, table.passed, *(table[name] for name in _ORDER))
    query = select(_KEPT_NUMBER, *columns).where(table.serial_number.in_(serial_numbers))
    rows = sorted([*connection.execute(query).mappings(), *new], key=itemgetter("serial_number", *ORDERED_BY))
    inserted, changed = [], []
    for _, group in groupby(rows, key=itemgetter("serial_number")):
        tests = list(group)
        for place, test in enumerate(tests, 1):
            order = dict(zip(_ORDER, (place, len(tests), tests[-1]["passed"]), strict=True))
            if "place" not in test:
                inserted.append({name: value for name, value in {**test, **order}.items() if name in table})
            elif any(test[name] != order[name] for name in _ORDER):
                changed.append({"key": test["motor"], **order})
    if inserted:
        connection.execute(insert(REPEATED_TEST), inserted)
    if changed:
        connection.execute(update(REPEATED_TEST).where(table.motor == bindparam("key")), changed)


def in_order(selection: Selection) -> ColumnElement[bool]:
    """Return the condition that a kept test is chosen, and that all tests of its serial number are kept in their order.

    So it is only where everything is chosen: otherwise the order depends on what is.
    """
    if not selection.everything:
        return false()
    kept = (REPEATED_TEST.c.place > 0) & REPEATED_TEST.c.serial_number.not_in(_shared_beside(selection))
    return kept & REPEATED_TEST.c.serial_number.not_in(selection.golden) if selection.golden else kept


def not_in_order(connection: Connection, selection: Selection, told_apart: Collection[str]) -> Subquery:
    """Return the judged tests of serial numbers with several tests that are not `in_order`, `chosen` telling which are selected.

    Besides the motor's key, serial number, start and these fields, each has `test_number`, `passed`, `at_once` and `attempts`, which
    is null for those that are not kept here.
    """
    table, fields = REPEATED_TEST.c, {**PLACE, "step": step_of_start(connection)}
    chosen = true() if selection.everything else _is_chosen(selection, table, table.motor)
    kept = select(
        table.motor,
        _KEPT_NUMBER,
        *(table[name] for name in _COMMON),
        chosen.label("chosen"),
        table.attempts,
        *(table[name] for name in told_apart),
    )
    columns = (
        *(column.label(name) for name, column in _COMMON.items()),
        (true() if selection.everything else _is_chosen(selection, MOTOR.c, MOTOR.c.id)).label("chosen"),
        null().label("attempts"),
        *(fields[name].label(name) for name in told_apart),
    )
    beside = _shared_beside(selection)
    read = select(MOTOR.c.id, MOTOR.c.test_number, *columns).where(
        MOTOR.c.serial_number.in_(beside), JUDGED, _unkept(MOTOR.c.id)
    )
    if selection.everything:
        kept = kept.where(or_(table.place == 0, table.serial_number.in_(beside)))
    else:
        # Whoever has no test here counts for nothing.
        here = select(table.serial_number).where(chosen)
        kept = kept.where(or_(table.serial_number.in_(here), table.serial_number.in_(beside)))
    if selection.golden:
        kept = kept.where(table.serial_number.not_in(selection.golden))
        read = read.where(MOTOR.c.serial_number.not_in(selection.golden))
    return kept.union_all(read).subquery("tests")


def _is_chosen(selection: Selection, columns: Any, motor: Any) -> Any:
    if selection.narrowed is not None:
        return motor.in_(selection.keys())
    return and_(columns.batch.in_(selection.batches), columns.model == selection.model)


def _unkept(motor: Any) -> Any:
    return ~select(REPEATED_TEST.c.motor).where(REPEATED_TEST.c.motor == motor).exists()


def _shared_beside(selection: Selection) -> Select[str]:
    """Return the query for serial numbers that a test beyond the summed-up stretches shares with another."""
    if not selection.summed:
        return select(MOTOR.c.serial_number).group_by(MOTOR.c.serial_number).having(func.count() > 1)
    other = MOTOR.alias("other")
    shared = select(other.c.id).where(other.c.serial_number == MOTOR.c.serial_number, other.c.id != MOTOR.c.id)
    beyond = among(MOTOR.c.id, unsummed(selection.summed))
    return select(MOTOR.c.serial_number).where(beyond, shared.exists()).distinct()
