"""Tests of another station that goes by the same name: golden motors' limits, yields and charts would mix."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import Engine, func, select

from bench.eol.store.records import utc
from bench.eol.store.schema import MOTOR

#: So many of a station's latest tests on the server are looked at.
_LATEST = 200


@dataclass(frozen=True)
class Namesake:
    """A test that the server has of a station and the station itself does not: the serial number, when it began (UTC), the run's folder."""

    serial_number: str
    started: datetime
    run: str


def namesake(
    own: Engine,
    station: str,
    ask_server: Callable[[Callable[[Engine], list[tuple[str, Namesake]]]], list[tuple[str, Namesake]] | None],
) -> Namesake | None:
    """Return the latest test of a station on its server that is not in its own database, though it has older ones; None where all are.

    What is older than all of its own it may have put away itself.
    """
    of_station = MOTOR.c.station == station
    with own.connect() as connection:
        first = connection.execute(select(func.min(MOTOR.c.started)).where(of_station)).scalar()
    if first is None:
        return None
    began = utc(first)

    def latest(server: Engine) -> list[tuple[str, Namesake]]:
        query = (
            select(MOTOR.c.identifier, MOTOR.c.serial_number, MOTOR.c.started, MOTOR.c.run)
            .where(of_station, MOTOR.c.started > began)
            .order_by(MOTOR.c.started.desc())
            .limit(_LATEST)
        )
        with server.connect() as connection:
            rows = connection.execute(query).all()
        return [(row.identifier, Namesake(row.serial_number, utc(row.started), row.run)) for row in rows]

    there = ask_server(latest) or []
    if not there:
        return None
    with own.connect() as connection:
        mine = set(
            connection.execute(
                select(MOTOR.c.identifier).where(MOTOR.c.identifier.in_([name for name, _ in there]))
            ).scalars()
        )
    return next((found for name, found in there if name not in mine), None)
