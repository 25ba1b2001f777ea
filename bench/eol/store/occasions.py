"""Judged tests counted by where, when and by which plan they were made: added up from sums, and counted where there are none."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any

from sqlalchemy import ColumnElement, Connection, Select, Table, cast, func, select
from sqlalchemy import Integer as Whole

from bench.eol.store.schema import MOTOR
from bench.eol.store.selection import Selection
from bench.eol.store.stretches import among, joined, without
from bench.eol.store.summed_tables import SUMMED_PLACES, SUMMED_TIMES
from bench.eol.verdict import Verdict

#: Times are told apart to so much: no zone and no shift begins between.
STEP = timedelta(minutes=5)
EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
JUDGED = MOTOR.c.verdict.in_((Verdict.PASS.value, Verdict.FAIL.value))
#: What tells places apart.
PLACE: Mapping[str, ColumnElement[Any]] = {"plan": MOTOR.c.plan, "station": MOTOR.c.station, "socket": MOTOR.c.socket}


@dataclass(frozen=True)
class Occasion:
    """The place and plan of tests, and their start (UTC, to five minutes)."""

    station: str = ""
    socket: str = ""
    plan: str = ""
    started: datetime = EPOCH


#: Where nothing of it is told apart.
ANY_OCCASION = Occasion()


@dataclass(frozen=True)
class CountedTests:
    """The number of judged tests with an occasion in common, whether they passed, and whether they did at once.

    `first_ever` tells that no earlier test of their motor was judged, in the selection or out of it.
    """

    occasion: Occasion
    at_once: bool
    passed: bool
    count: int
    first_ever: bool = True


def step_of_start(connection: Connection) -> ColumnElement[int]:
    """Return how many whole steps lie between the beginning of 1970 (UTC) and a test's."""
    # On a server date_part gives binary numbers; with the decimal ones of EXTRACT it takes twice as long.
    seconds = (
        func.floor(func.date_part("epoch", MOTOR.c.started) / STEP.total_seconds())
        if connection.dialect.name == "postgresql"
        else cast(func.strftime("%s", MOTOR.c.started), Whole) / round(STEP.total_seconds())
    )
    return cast(seconds, Whole)


def occasion_of(known: Mapping[str, Any]) -> Occasion:
    """Return the occasion of which these fields are known, `step` for the time."""
    fields = dict(known)
    if "step" in fields:
        fields["started"] = EPOCH + fields.pop("step") * STEP
    return Occasion(**fields)


def counted_by_place(
    connection: Connection, selection: Selection, told_apart: Collection[str]
) -> Iterator[CountedTests]:
    """Count the judged tests of a selection by these of station, socket and plan; a count below 0 is to be added, too."""
    return _counted(connection, selection, SUMMED_PLACES, {name: PLACE[name] for name in told_apart})


def counted_by_time(connection: Connection, selection: Selection) -> Iterator[CountedTests]:
    """Count the judged tests of a selection by when they began; a count below 0 is to be added, too."""
    return _counted(connection, selection, SUMMED_TIMES, {"step": step_of_start(connection)})


def _counted(
    connection: Connection, selection: Selection, sums: Table, told_apart: Mapping[str, ColumnElement[Any]]
) -> Iterator[CountedTests]:
    columns = (*told_apart.values(), MOTOR.c.verdict, MOTOR.c.first_pass)
    direct = select(*columns, func.count()).where(JUDGED).group_by(*columns)
    rest = without(selection.stretches, selection.summed)
    queries: list[tuple[Select[Any], int]] = []
    if selection.summed:
        summed = joined(selection.summed)
        queries.append((_sums(selection, sums, [*told_apart, "verdict", "first_pass"]), 1))
        if selection.golden:
            golden = MOTOR.c.serial_number.in_(selection.golden) & (MOTOR.c.model == selection.model)
            if not selection.everything:
                golden &= MOTOR.c.batch.in_(selection.batches)
            queries.append((direct.where(golden, among(MOTOR.c.id + 0, summed)), -1))
    if rest:
        beyond = selection.holds(MOTOR.c.id)
        queries.append((direct.where(beyond, among(MOTOR.c.id, rest)) if selection.summed else direct.where(beyond), 1))
    for query, sign in queries:
        for *known, verdict, first_pass, count in connection.execute(query):
            passed = verdict == Verdict.PASS.value
            occasion = occasion_of(dict(zip(told_apart, known, strict=True)))
            yield CountedTests(occasion, passed and bool(first_pass), passed, sign * int(count))


def _sums(selection: Selection, sums: Table, names: Collection[str]) -> Select[Any]:
    columns = [sums.c[name] for name in names]
    query = select(*columns, func.sum(sums.c.count)).where(
        sums.c.model == selection.model, among(sums.c.first, joined(selection.summed))
    )
    if not selection.everything:
        query = query.where(sums.c.batch.in_(selection.batches))
    return query.group_by(*columns)
