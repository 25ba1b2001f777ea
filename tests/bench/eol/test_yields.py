"""Yields by motor, held against counting one motor after the other."""

import math
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sqlalchemy import Engine, delete

from bench.eol.record import CheckRecord
from bench.eol.statistics.proportion import Proportion, proportion
from bench.eol.store.records import Records
from bench.eol.store.schema import CHECK, MOTOR
from bench.eol.store.selection import choose, golden_motors
from bench.eol.verdict import Verdict
from bench.eol.yields import GROUPINGS, MotorYields, motor_yields, shift_starts
from bench.i18n.errors import UsageError
from tests.bench.eol.motor_records import NOON, motor_record

#: A motor, its batch, its socket, the verdict, and whether it passed at once.
Tested = tuple[int, str, str, str, bool]
JUDGED = ("pass", "fail")


def keep(records: Records, tests: Sequence[Tested], minutes: int = 7) -> None:
    """Keep tests; the clock goes on by so many minutes with each, or is put back."""
    for number, (motor, batch, socket, verdict, at_once) in enumerate(tests, 1):
        began = NOON + timedelta(minutes=minutes * number)
        first = Verdict.PASS if at_once and verdict == "pass" else Verdict.FAIL
        records.save(
            motor_record(
                number,
                batch=batch,
                socket=socket,
                serial_number=f"A{motor}",
                test_number=sum(each[0] == motor for each in tests[:number]),
                verdict=Verdict(verdict),
                first_pass=at_once and verdict == "pass",
                started=began,
                ended=began,
                checks=(CheckRecord("r", 1, first, 1.0),),
            )
        )


def yields_of(engine: Engine, batches: Sequence[str] = ()) -> MotorYields:
    with engine.connect() as connection:
        selection = choose(connection, batches, golden=golden_motors(connection))
        plain = motor_yields(connection, selection)
        grouped = motor_yields(connection, selection, GROUPINGS)
    # In words: a share of nothing is NaN, which is equal to nothing.
    assert repr((plain.first_pass, plain.final, plain.rolled)) == repr(
        (grouped.first_pass, grouped.final, grouped.rolled)
    )
    for groups in grouped.groups.values():
        assert sum(group.final.count for group in groups) == grouped.final.count
        assert sum(group.final.hits for group in groups) == grouped.final.hits
        assert sum(group.first_pass.hits for group in groups) == grouped.first_pass.hits
        assert sum(group.first_pass.count for group in groups) == grouped.first_pass.count
    return grouped


def counted_by_socket(tests: Sequence[Tested], batches: Sequence[str]) -> dict[str, tuple[int, ...]]:
    """The same of the motors that were judged first at each socket."""
    first = {test[0]: test[2] for test in reversed(tests) if test[3] in JUDGED and test[1] in batches}
    return {
        f"S · {socket}": counted([test for test in tests if first.get(test[0]) == socket], batches)
        for socket in sorted(set(first.values()))
    }


def counted(tests: Sequence[Tested], batches: Sequence[str]) -> tuple[int, ...]:
    """Motors, those that passed in the end, those never judged before, and of these those that passed at once, one after the other."""
    motors = final = new = first = 0
    for motor in {test[0] for test in tests}:
        judged = [test for test in tests if test[0] == motor and test[3] in JUDGED]
        chosen = [test for test in judged if test[1] in batches]
        if chosen:
            motors += 1
            final += chosen[-1][3] == "pass"
            if judged[0][1] in batches:
                new += 1
                first += judged[0][3] == "pass" and judged[0][4]
    return motors, final, new, first


def shown(final: Proportion, first_pass: Proportion) -> tuple[int, ...]:
    return final.count, final.hits, first_pass.count, first_pass.hits


TESTS = st.lists(
    st.tuples(
        st.integers(1, 4),
        st.sampled_from(["B1", "B2"]),
        st.sampled_from(["1", "2"]),
        st.sampled_from(["pass", "fail", "error", "aborted"]),
        st.booleans(),
    ),
    min_size=1,
    max_size=14,
)


@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(TESTS, st.sampled_from([7, 0, -7]))
def test_they_are_those_of_motors_counted_one_by_one(
    engine: Engine, records: Records, tests: list[Tested], minutes: int
) -> None:
    with engine.begin() as connection:
        connection.execute(delete(CHECK))
        connection.execute(delete(MOTOR))
    keep(records, tests, minutes)
    for batches in ({"B1", "B2"}, {test[1] for test in tests[:1]}):
        chosen = [batch for batch in batches if batch in {test[1] for test in tests}]
        found = yields_of(engine, chosen)
        assert shown(found.final, found.first_pass) == counted(tests, chosen)
        rolled = found.rolled.procedures["r"] if found.rolled.procedures else proportion(0, 0)
        assert (rolled.count, rolled.hits) == (found.first_pass.count, found.first_pass.hits)
        by_socket = {each.name: shown(each.final, each.first_pass) for each in found.groups["socket"]}
        assert by_socket == counted_by_socket(tests, chosen)


def test_eight_motors_of_sixteen_tests_are_eight(engine: Engine, records: Records) -> None:
    first = [(n, "B1", "1", "fail" if n == 3 else "error", False) for n in range(8)]
    keep(records, [*first, *((n, "B1", "2", "pass", n != 5) for n in range(8))])
    found = yields_of(engine)
    assert (found.final.count, found.final.hits, found.first_pass.hits, found.retested) == (8, 8, 6, 1)
    by_socket = {group.name: (group.final.count, group.first_pass.hits) for group in found.groups["socket"]}
    assert by_socket == {"S · 1": (1, 0), "S · 2": (7, 6)}
    assert found.rolled.procedures["r"].count == 8
    assert found.rolled.procedures["r"].hits == 6


def test_a_batch_of_motors_that_were_judged_before_has_no_first_pass(engine: Engine, records: Records) -> None:
    keep(records, [(1, "B1", "1", "fail", False), (1, "B2", "1", "pass", True), (2, "B2", "1", "pass", True)])
    found = yields_of(engine, ["B2"])
    assert shown(found.final, found.first_pass) == (2, 2, 1, 1)
    with engine.begin() as connection:
        connection.execute(delete(MOTOR).where(MOTOR.c.serial_number == "A2"))
    found = yields_of(engine, ["B2"])
    assert shown(found.final, found.first_pass) == (1, 1, 0, 0)
    assert math.isnan(found.first_pass.share)
    assert found.rolled.procedures == {}


def test_golden_motors_are_left_out(engine: Engine, records: Records) -> None:
    keep(records, [(1, "B1", "1", "pass", True)])
    records.save(motor_record(99, serial_number="G-1", golden=True))
    records.save(motor_record(98, serial_number="G-1", golden=True))
    found = yields_of(engine)
    assert (found.final.count, found.final.hits) == (1, 1)


def test_a_night_shift_is_of_the_day_on_which_it_began(engine: Engine, records: Records) -> None:
    at = datetime(2026, 11, 25, 2, 3).astimezone().astimezone(UTC)
    records.save(motor_record(1, verdict=Verdict.PASS, started=at, ended=at))
    found = yields_of(engine)
    assert [group.name for group in found.groups["shift"]] == ["2026-11-24 22:00"]
    assert [group.name for group in found.groups["date"]] == ["2026-11-25"]


@pytest.mark.parametrize("wrong", ["6", "06:03", "25:00", "06:00+08:00", "x"])
def test_shifts_begin_at_a_time_of_day(wrong: str) -> None:
    with pytest.raises(UsageError, match="--shifts"):
        shift_starts([wrong])
