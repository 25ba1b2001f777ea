"""Golden motors' tests in a station's records: when one passed last at a socket, and what was measured of it there."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime, time

from sqlalchemy import ColumnElement, Engine, and_, select

from bench.eol.record import MotorRecord
from bench.eol.serial_number import spellings
from bench.eol.store.records import Records, utc
from bench.eol.store.schema import GOLDEN, MOTOR
from bench.eol.verdict import Verdict


@dataclass(frozen=True)
class GoldenTests:
    """The golden tests of one plan at one station, in `engine`'s database.

    `ask_server` has a question answered by the database that holds what the station has forwarded, None where there is none now.
    """

    engine: Engine
    plan: str
    station: str
    ask_server: Callable[[Callable[[Engine], list[MotorRecord]]], list[MotorRecord] | None] = lambda _question: None

    def last_passed(self, socket: str, now: datetime) -> datetime | None:
        """Return when (UTC) the last golden test at a socket passed, None where there is none, or it did not.

        The last is the one that was kept last: a clock that was ahead must not hide a failure. One that ends after `now` was made
        while it was, and nobody knows when. Nor does a pass count that an archive put back after a later failure, nor one after which
        the station kept a motor of a time still to come: the clock was put back since, and nobody knows how long ago it was.
        """
        tests = select(MOTOR.c.id, MOTOR.c.ended, MOTOR.c.verdict).where(self._tested(socket))
        counted = tests.where(MOTOR.c.verdict != Verdict.ABORTED.value)
        with self.engine.connect() as connection:
            last = connection.execute(counted.order_by(MOTOR.c.id.desc()).limit(1)).one_or_none()
            if last is None or last.verdict != Verdict.PASS.value or utc(last.ended) > now:
                return None
            after = MOTOR.c.ended > utc(last.ended), MOTOR.c.ended <= now, MOTOR.c.verdict != Verdict.PASS.value
            ahead = MOTOR.c.id > last.id, MOTOR.c.station == self.station, MOTOR.c.ended > now
            contradicted = counted.where(*after).limit(1), select(MOTOR.c.id).where(*ahead).limit(1)
            return None if any(connection.execute(query).first() for query in contradicted) else utc(last.ended)

    def history(self, socket: str, serial_number: str, tests: int, since: date | None) -> dict[str, Sequence[float]]:
        """Return the figures by parameter of the first `tests` passed tests of a golden motor at a socket `since` a day.

        Nothing where there are fewer; parameters that one of them lacks are left out. Where the station's own database has too few,
        for it was put away or began anew, those that it forwarded count.
        """
        begin = datetime.combine(since, time()).astimezone(UTC) if since else datetime.min.replace(tzinfo=UTC)
        query = (
            select(MOTOR.c.identifier)
            .where(
                self._tested(socket),
                MOTOR.c.verdict == Verdict.PASS.value,
                MOTOR.c.serial_number.in_(spellings(serial_number)),
                MOTOR.c.started >= begin,
            )
            .order_by(MOTOR.c.started)
            .limit(tests)
        )

        def found(engine: Engine) -> list[MotorRecord]:
            with engine.connect() as connection:
                identifiers = connection.execute(query).scalars().all()
            return [record for record in map(Records(engine).find, identifiers) if record is not None]

        records = found(self.engine)
        if len(records) < tests and (forwarded := self.ask_server(found)):
            each = {record.identifier: record for record in (*forwarded, *records)}
            records = sorted(each.values(), key=lambda record: record.started)[:tests]
        if len(records) < tests:
            return {}
        figures = [{figure.parameter: figure.value for figure in record.measured} for record in records]
        everywhere = set.intersection(*(set(each) for each in figures))
        return {name: [each[name] for each in figures] for name in sorted(everywhere)}

    def _tested(self, socket: str) -> ColumnElement[bool]:
        return and_(GOLDEN, MOTOR.c.plan == self.plan, MOTOR.c.station == self.station, MOTOR.c.socket == socket)


def last_test_ended(engine: Engine, station: str) -> datetime | None:
    """Return when (UTC) a station's test that was kept last ended, None where it has none."""
    query = select(MOTOR.c.ended).where(MOTOR.c.station == station).order_by(MOTOR.c.id.desc()).limit(1)
    with engine.connect() as connection:
        found = connection.execute(query).scalar()
    return None if found is None else utc(found)
