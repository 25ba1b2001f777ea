"""The selection of motors' records: those of some batches, of one type, without the golden motors."""

from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import ColumnElement, Connection, Integer, Row, Select, and_, cast, func, not_, or_, select, true

from bench.eol.serial_number import spellings
from bench.eol.store.schema import GOLDEN, MOTOR
from bench.eol.store.stretches import Stretch, among, joined, summed_stretches, unsummed
from bench.eol.store.summed_tables import SUMMED_MOTORS
from bench.eol.verdict import Verdict
from bench.i18n.errors import UsageError
from drivers.interfaces.text import Text, text


@dataclass(frozen=True)
class Selection:
    """Chosen records: batches by name (the latest first), the type, how many motors got each verdict, how many passed at once.

    `stretches` are the ranges of keys that hold them, `exact` tells that these hold nothing else. `golden` are serial numbers
    of motors that are measured to watch the station; they count in nothing here. Of all keys, `summed` are the stretches that were
    summed up; `whole` those of them whose motors of the type are all chosen. Where not all records of these batches are wanted,
    `narrowed` is the condition on their rows, and no sums can serve.
    """

    batches: tuple[str, ...]
    model: str
    verdicts: dict[Verdict, int]
    first_pass: int
    stretches: tuple[Stretch, ...]
    exact: bool
    everything: bool
    golden: tuple[str, ...]
    summed: tuple[Stretch, ...]
    whole: tuple[Stretch, ...]
    narrowed: ColumnElement[bool] | None = None

    @property
    def count(self) -> int:
        """Return how many tests of motors were chosen."""
        return sum(self.verdicts.values())

    def holds(self, motor: ColumnElement[int], *, walk: bool = False) -> ColumnElement[bool]:
        """Return the condition that a motor's key is of the selection; `walk` has the database go there by the key.

        Without it the condition names a sum, which no index serves: the database then goes by what else is asked for.
        """
        conditions: list[ColumnElement[bool]] = []
        key = motor + 0
        if walk:
            conditions.append(motor.between(self.stretches[0][0], self.stretches[-1][1]))
        if not self.everything:
            conditions.append(or_(*(key.between(first, last) for first, last in self.stretches)))
            if not self.exact:
                conditions.append(key.in_(self.keys()))
        if self.golden:
            conditions.append(not_(key.in_(golden_keys(self.golden))))
        return and_(true(), *conditions)

    def keys(self) -> Select[int]:
        """Return the query for the keys of what was chosen, golden motors' among them."""
        chosen = select(MOTOR.c.id).where(MOTOR.c.batch.in_(self.batches), MOTOR.c.model == self.model)
        return chosen if self.narrowed is None else chosen.where(self.narrowed)


def golden_keys(serial_numbers: Sequence[str]) -> Select[int]:
    """Return the query for the keys of golden motors' tests."""
    return select(MOTOR.c.id).where(MOTOR.c.serial_number.in_(serial_numbers))


def golden_motors(connection: Connection, named: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the serial numbers of golden motors: those named, and those that the records know as such."""
    there = [spelling for name in named for spelling in spellings(name)]
    known = connection.execute(select(MOTOR.c.serial_number).where(GOLDEN).distinct()).scalars()
    return tuple(dict.fromkeys([*there, *sorted(known)]))


def check_tested(connection: Connection, serial_numbers: Sequence[str]) -> None:
    """Raise UsageError for a motor that no records have: of a slip in a golden one nobody would know that it counts in each yield."""
    for serial_number in serial_numbers:
        query = select(MOTOR.c.id).where(MOTOR.c.serial_number.in_(spellings(serial_number))).limit(1)
        if connection.execute(query).first() is None:
            raise UsageError(text("the records contain no test of a motor {serial!r}", serial=serial_number))


def kept_batches(connection: Connection) -> list[tuple[str, str]]:
    """Return the name and the type of every batch that has records, the latest first."""
    columns = (MOTOR.c.batch, MOTOR.c.model)
    query = select(*columns).group_by(*columns).order_by(func.max(MOTOR.c.id).desc())
    return [(row.batch, row.model) for row in connection.execute(query)]


def choose(
    connection: Connection,
    batches: Sequence[str],
    model: str = "",
    golden: Sequence[str] = (),
    narrowed: ColumnElement[bool] | None = None,
) -> Selection:
    """Return the records of batches, of all where none is named; `narrowed` is a condition on their rows.

    Raises InputError for a batch that has none, and where they are of several types and no `model` is named.
    """
    summed = summed_stretches(connection) if narrowed is None else ()
    rows = _counted(connection, summed, batches, narrowed)
    missing = [name for name in batches if name not in {row.batch for row in rows}]
    if missing or not rows:
        raise UsageError(_nothing(connection, missing))
    models = sorted({row.model for row in rows})
    if model and model not in models:
        raise UsageError(
            text(
                "the records contain no motor of the type {model!r}; the types are: {names}", model=model, names=models
            )
        )
    if len(models) > 1 and not model:
        raise UsageError(
            text(
                "the records are of several types: {names}; select batches of one type, or give --model TYPE",
                names=models,
            )
        )
    chosen = [row for row in rows if row.model == (model or models[0])]
    ranges = sorted(
        (min(row[5] for row in chosen if row.batch == name), max(row[6] for row in chosen if row.batch == name), name)
        for name in {row.batch for row in chosen}
    )
    stretches = joined([(first, last) for first, last, _ in ranges])
    total = sum(row[4] for row in chosen)
    everything = not batches and len(models) == 1 and narrowed is None
    verdicts = {
        verdict: sum(row[4] for row in chosen if row.verdict == verdict.value) for verdict in Verdict.of_motors()
    }
    first_pass = sum(row[4] for row in chosen if row.first_pass and row.verdict == Verdict.PASS.value)
    if golden:
        names = [name for *_, name in ranges]
        away = connection.execute(
            select(MOTOR.c.verdict, MOTOR.c.first_pass, func.count())
            .where(MOTOR.c.serial_number.in_(golden), MOTOR.c.batch.in_(names), MOTOR.c.model == chosen[0].model)
            .where(true() if narrowed is None else narrowed)
            .group_by(MOTOR.c.verdict, MOTOR.c.first_pass)
        ).all()
        for row in away:
            verdicts[Verdict(row[0])] -= row[2]
            first_pass -= row[2] if row[1] and row[0] == Verdict.PASS.value else 0
    return Selection(
        batches=tuple(name for *_, name in sorted(ranges, key=lambda item: item[1], reverse=True)),
        model=chosen[0].model,
        verdicts=verdicts,
        first_pass=first_pass,
        stretches=tuple(stretches),
        exact=sum(last - first + 1 for first, last in stretches) == total,
        everything=everything,
        golden=tuple(golden),
        summed=summed,
        whole=_whole(connection, summed, batches, chosen[0].model),
        narrowed=narrowed,
    )


def _counted(
    connection: Connection,
    summed: Sequence[Stretch],
    batches: Sequence[str],
    narrowed: ColumnElement[bool] | None,
) -> Sequence[Row[str, str, str, bool, int, int, int]]:
    """Count motors by batch, type, verdict and whether they passed at once, with the least and the greatest key of each."""
    columns = (MOTOR.c.batch, MOTOR.c.model, MOTOR.c.verdict, MOTOR.c.first_pass)
    keys = (func.count().label("count"), func.min(MOTOR.c.id).label("least"), func.max(MOTOR.c.id).label("greatest"))
    query = select(*columns, *keys).group_by(*columns)
    if batches:
        query = query.where(MOTOR.c.batch.in_(batches))
    if narrowed is not None:
        query = query.where(narrowed)
    if not summed:
        return connection.execute(query).all()
    sums = select(*(column for column in SUMMED_MOTORS.columns if column.name != "first"))
    sums = sums.where(among(SUMMED_MOTORS.c.first, joined(summed)))
    if batches:
        sums = sums.where(SUMMED_MOTORS.c.batch.in_(batches))
    parts = sums.union_all(query.where(among(MOTOR.c.id, unsummed(summed)))).subquery()
    named = (parts.c.batch, parts.c.model, parts.c.verdict, parts.c.first_pass)
    totals = (cast(func.sum(parts.c.count), Integer), func.min(parts.c.least), func.max(parts.c.greatest))
    return connection.execute(select(*named, *totals).group_by(*named)).all()


def _whole(
    connection: Connection, summed: tuple[Stretch, ...], batches: Sequence[str], model: str
) -> tuple[Stretch, ...]:
    if not batches or not summed:
        return summed
    others = select(SUMMED_MOTORS.c.first).where(SUMMED_MOTORS.c.model == model, SUMMED_MOTORS.c.batch.not_in(batches))
    partly = set(connection.execute(others).scalars())
    return tuple(each for each in summed if each[0] not in partly)


def _nothing(connection: Connection, missing: Sequence[str]) -> Text:
    named = list(connection.execute(select(MOTOR.c.batch).distinct().limit(20)).scalars())
    if not named:
        return text("there are no records yet")
    return text(
        "no batch is named {batches}; the batches are: {names}",
        batches=[repr(name) for name in missing],
        names=sorted(named),
    )
