"""Records of one batch among several that have one name: by station, by day, by the folder of its runs; and telling them apart."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime, time, timedelta
from pathlib import Path

from sqlalchemy import ARRAY, ColumnElement, Connection, Engine, Integer, and_, bindparam, distinct, func, select, true

from bench.eol.line.batch_log import FILE, batch_uid, owns_record
from bench.eol.record import MotorRecord
from bench.eol.store.records import Records, utc
from bench.eol.store.schema import MOTOR
from bench.i18n.errors import UsageError
from drivers.interfaces.text import Text, lines, text

#: So many batches of one name are listed.
_LISTED = 10


@dataclass(frozen=True)
class Narrowing:
    """Which records are meant: of a `station`, begun from one day to another, of the batches whose folders are in `runs`.

    Days are this computer's; what is empty, or None, narrows nothing.
    """

    station: str = ""
    since: date | None = None
    until: date | None = None
    runs: Path | None = None

    @property
    def anything(self) -> bool:
        """Tell whether it leaves anything out."""
        return self != ALL_OF_A_NAME

    def condition(self, connection: Connection, batches: Sequence[str]) -> ColumnElement[bool]:
        """Return the condition on motors' rows, of these batches or of all where none is named.

        Raises UsageError where no record is left, and for a batch that has no folder there.
        """
        conditions: list[ColumnElement[bool]] = [true()]
        if self.station:
            conditions.append(MOTOR.c.station == self.station)
        if self.since is not None:
            conditions.append(MOTOR.c.started >= _midnight(self.since))
        if self.until is not None:
            conditions.append(MOTOR.c.started < _midnight(self.until + timedelta(days=1)))
        if self.runs is not None:
            conditions.append(self._own(connection, self.runs, batches))
        found = and_(*conditions)
        if not batches and _is_none(connection, found):
            raise UsageError(text("the records have nothing that --station, --since, --until and --runs leave"))
        for name in batches:
            there = parts(connection, [name])
            if there and _is_none(connection, and_(found, MOTOR.c.batch == name)):
                raise UsageError(
                    text(
                        "batch {name} has no record that --station, --since, --until and --runs leave; it has: {parts}",
                        name=name,
                        parts=lines([part.words for part in there[:_LISTED]], "; "),
                    )
                )
        return found

    def _own(self, connection: Connection, runs: Path, batches: Sequence[str]) -> ColumnElement[bool]:
        names = list(batches) or [log.parent.name for log in sorted(runs.glob(f"*/{FILE}"))]
        uids = {name: uid for name in names if (uid := batch_uid(runs / name)) is not None}
        missing = [name for name in names if name not in uids]
        if not names:
            raise UsageError(text("{runs}: contains no batches; give the folder of the batches with --runs", runs=runs))
        if missing:
            raise UsageError(text("--runs {runs}: it has no folder of a batch {names}", runs=runs, names=missing))
        rows = connection.execute(
            select(MOTOR.c.id, MOTOR.c.batch, MOTOR.c.number, MOTOR.c.identifier).where(MOTOR.c.batch.in_(uids))
        )
        keys = [row.id for row in rows if owns_record(uids[row.batch], row.number, row.identifier)]
        # One value, however many they are: a query has room for so many only.
        if connection.dialect.name == "postgresql":
            return MOTOR.c.id.in_(select(func.unnest(bindparam("own_keys", keys, type_=ARRAY(Integer), unique=True))))
        listed = func.json_each(bindparam("own_keys", str(keys), unique=True)).table_valued("value")
        return MOTOR.c.id.in_(select(listed.c.value))


#: Whatever has the name.
ALL_OF_A_NAME = Narrowing()


@dataclass(frozen=True)
class BatchPart:
    """The records of one name, station and plan: how many, the first and the last day; `several` batches where numbers repeat."""

    batch: str
    station: str
    plan_sha256: str
    tests: int
    first: date
    last: date
    several: bool

    @property
    def words(self) -> Text:
        """Return it as one reads it."""
        words = text(
            "station {station}, plan {plan}, {first} to {last}, tests: {tests}",
            station=self.station,
            plan=self.plan_sha256[:8],
            first=self.first.isoformat(),
            last=self.last.isoformat(),
            tests=self.tests,
        )
        return text("{words} (several batches: their motors' numbers repeat)", words=words) if self.several else words


def parts(
    connection: Connection, batches: Sequence[str], narrowed: ColumnElement[bool] | None = None
) -> list[BatchPart]:
    """Return what the records of batches of these names consist of, the earliest first."""
    started = MOTOR.c.started
    query = (
        select(
            MOTOR.c.batch,
            MOTOR.c.station,
            MOTOR.c.plan_sha256,
            func.count().label("tests"),
            func.count(distinct(MOTOR.c.number)).label("numbers"),
            func.min(started).label("first"),
            func.max(started).label("last"),
        )
        .where(MOTOR.c.batch.in_(batches), true() if narrowed is None else narrowed)
        .group_by(MOTOR.c.batch, MOTOR.c.station, MOTOR.c.plan, MOTOR.c.plan_sha256)
        .order_by(func.min(started))
    )
    return [
        BatchPart(
            row.batch,
            row.station,
            row.plan_sha256,
            row.tests,
            _day(row.first),
            _day(row.last),
            row.tests > row.numbers,
        )
        for row in connection.execute(query)
    ]


def joined_names(
    connection: Connection, batches: Sequence[str], narrowed: ColumnElement[bool] | None = None
) -> Text | None:
    """Return what says that several batches of one name are taken together, None where they are not."""
    found = parts(connection, batches, narrowed) if batches else []
    said = []
    for name in dict.fromkeys(batches):
        own = [part for part in found if part.batch == name]
        if len(own) > 1 or any(part.several for part in own):
            said.append(
                text(
                    "several batches have the name {name} and are taken together: {parts}",
                    name=name,
                    parts=lines([part.words for part in own[:_LISTED]], "; "),
                )
            )
    return lines(said, "; ") if said else None


def records_of(
    engine: Engine, batches: Sequence[str], narrowing: Narrowing
) -> tuple[Iterator[MotorRecord], Text | None]:
    """Return the records of batches, of all where none is named, and what says that several of one name are among them.

    Raises UsageError where none is left.
    """
    with engine.connect() as connection:
        narrowed = narrowing.condition(connection, batches) if narrowing.anything else None
        joined = joined_names(connection, batches, narrowed)
    names: Sequence[str | None] = list(dict.fromkeys(batches)) or [None]
    return (record for name in names for record in Records(engine).read(name, narrowed)), joined


def _is_none(connection: Connection, condition: ColumnElement[bool]) -> bool:
    return connection.execute(select(MOTOR.c.id).where(condition).limit(1)).first() is None


def _midnight(day: date) -> datetime:
    return datetime.combine(day, time()).astimezone().astimezone(UTC)


def _day(value: datetime) -> date:
    return utc(value).astimezone().date()
