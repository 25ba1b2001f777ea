"""Serial numbers under test: of several stations that scan one at once exactly one gets it."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime, timedelta
from functools import cache
from typing import Any

from sqlalchemy import Connection, Engine, bindparam, delete, or_, select
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.sql.dml import ReturningInsert

from bench.eol.store.records import utc
from bench.eol.store.schema import SERIAL_CLAIM

#: No test takes so long: whoever claimed a serial number longer ago has left it. A person who says so is believed sooner.
STALE, STALE_BY_PERSON = timedelta(hours=12), timedelta(minutes=10)


@dataclass(frozen=True)
class SerialClaim:
    """A serial number that is under test since some time (UTC), and where; `identifier` will be the record's."""

    serial_number: str
    identifier: str
    batch: str
    number: int
    station: str
    socket: str
    since: datetime


_NAMES = tuple(SerialClaim.__dataclass_fields__)


def claim_serial(engine: Engine, wanted: SerialClaim, stale: timedelta = STALE) -> SerialClaim | None:
    """Claim a serial number; return who has it instead, None where the claim was made.

    A claim of the same record is made again, and one that is older than `stale` is taken over.
    """
    values = {name: getattr(wanted, name) for name in _NAMES} | {
        "stale_before": wanted.since - stale,
        # Its clock was ahead: it would be held until then.
        "impossible_after": wanted.since + STALE,
    }
    while True:
        with _claiming(engine) as connection:
            if connection.execute(_claim(engine.dialect.name), values).first() is not None:
                return None
        holder = claim_of_serial(engine, wanted.serial_number)
        # Its holder may have let go of it meanwhile.
        if holder is not None:
            return holder


@cache
def _claim(dialect: str) -> ReturningInsert[tuple[str]]:
    """Return the statement, built once: it is made for every motor."""
    insert = (postgresql if dialect == "postgresql" else sqlite).insert(SERIAL_CLAIM)
    excluded = insert.excluded
    since, kind = SERIAL_CLAIM.c.since, SERIAL_CLAIM.c.since.type
    left = or_(since < bindparam("stale_before", type_=kind), since > bindparam("impossible_after", type_=kind))
    statement: ReturningInsert[tuple[str]] = (
        insert.values({name: bindparam(name) for name in _NAMES})
        .on_conflict_do_update(
            index_elements=[SERIAL_CLAIM.c.serial_number],
            set_={name: excluded[name] for name in _NAMES[1:]},
            where=or_(SERIAL_CLAIM.c.identifier == excluded.identifier, left),
        )
        .returning(SERIAL_CLAIM.c.identifier)
    )
    return statement


@contextmanager
def _claiming(engine: Engine) -> Iterator[Connection]:
    """Give a transaction; in a station's own file it is not waited for on the disk.

    A power cut that takes back a claim has ended the test, and whoever else could claim it in that file.
    """
    if engine.dialect.name != "sqlite":
        with engine.begin() as connection:
            yield connection
        return
    with engine.connect() as connection:
        file: Any = connection.connection.driver_connection
        file.execute("PRAGMA synchronous = NORMAL")
        try:
            with connection.begin():
                yield connection
        finally:
            file.execute("PRAGMA synchronous = FULL")


def claim_of_serial(engine: Engine, serial_number: str) -> SerialClaim | None:
    """Return who tests a serial number now, None where nobody does."""
    columns = (SERIAL_CLAIM.c[name] for name in _NAMES)
    query = select(*columns).where(SERIAL_CLAIM.c.serial_number == serial_number)
    with engine.connect() as connection:
        row = connection.execute(query).mappings().first()
    return None if row is None else SerialClaim(**{**row, "since": utc(row["since"])})


def release_serial(engine: Engine, claim: SerialClaim) -> None:
    """Release a serial number that was claimed."""
    with engine.begin() as connection:
        connection.execute(
            delete(SERIAL_CLAIM).where(
                SERIAL_CLAIM.c.serial_number == claim.serial_number, SERIAL_CLAIM.c.identifier == claim.identifier
            )
        )
