"""Records of a station whose server may be away: kept here first, forwarded when it answers, none lost and none twice."""

from collections.abc import Callable

from sqlalchemy import Engine, delete, insert, select, update
from sqlalchemy.exc import DBAPIError

from bench.eol.record import MotorRecord
from bench.eol.store.database import reason
from bench.eol.store.insertion import insert_record
from bench.eol.store.records import Records, StoreError
from bench.eol.store.schema import OUTBOX
from bench.errors import InputError
from procedures.text import text

#: Forwarded at one go, so that a long outage does not hold up the line when it ends.
_AT_ONCE = 50


class ForwardingRecords:
    """Saves into the station's own database and forwards to a server's.

    A record leaves the outbox after the server has committed it; where the answer was lost it is sent again, and the
    server knows its identifier. `connect` opens the server's database and raises InputError where it is away.
    """

    def __init__(self, own: Engine, connect: Callable[[], Engine]) -> None:
        self._own = own
        self._connect = connect
        self._server: Engine | None = None
        self.records = Records(own)
        self.fault = ""

    def save(self, record: MotorRecord) -> bool:
        """Keep a record here, durably, to be forwarded. Raises StoreError where even that cannot be done."""
        try:
            with self._own.begin() as connection:
                new = insert_record(connection, record)
                if new:
                    connection.execute(insert(OUTBOX).values(identifier=record.identifier))
                return new
        except DBAPIError as error:
            raise StoreError(reason(error)) from error

    def waiting(self) -> int:
        """Return how many records the server has not confirmed."""
        with self._own.connect() as connection:
            return len(connection.execute(select(OUTBOX.c.identifier)).all())

    def forward(self) -> int:
        """Send what waits, some at a time; return how many the server took now. A server that is away is no error: see `fault`."""
        with self._own.connect() as connection:
            waiting = list(connection.execute(select(OUTBOX.c.identifier).limit(_AT_ONCE)).scalars())
        done = 0
        for identifier in waiting:
            record = self.records.find(identifier)
            if record is None:
                raise StoreError(
                    text(
                        "record {identifier} waits to be forwarded and is not there; the file was changed by hand",
                        identifier=identifier,
                    )
                )
            try:
                if self._server is None:
                    self._server = self._connect()
                Records(self._server).save(record)
            except (StoreError, InputError, DBAPIError) as error:
                self.fault = str(error)
                self._note(identifier)
                return done
            with self._own.begin() as connection:
                connection.execute(delete(OUTBOX).where(OUTBOX.c.identifier == identifier))
            done += 1
        self.fault = ""
        return done

    def close(self) -> None:
        """Let go of both databases."""
        if self._server is not None:
            self._server.dispose()
        self._own.dispose()

    def _note(self, identifier: str) -> None:
        with self._own.begin() as connection:
            connection.execute(
                update(OUTBOX)
                .where(OUTBOX.c.identifier == identifier)
                .values(tries=OUTBOX.c.tries + 1, fault=self.fault)
            )
