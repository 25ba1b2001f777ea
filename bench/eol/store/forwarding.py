"""Records of a station: in its own database, in files where that takes none, and forwarded to a server; none lost, none twice."""

import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from sqlalchemy import Engine, delete, func, insert, select, update
from sqlalchemy import text as sql

from bench.eol.record import MotorRecord
from bench.eol.store.batch_plans import carry_plans
from bench.eol.store.database import place_of
from bench.eol.store.faults import FAULTS, DoubtfulError, RefusedError, StoreError, fault_of
from bench.eol.store.insertion import insert_record
from bench.eol.store.records import Records
from bench.eol.store.schema import OUTBOX
from bench.eol.store.spool import Spool, SpooledFileError
from bench.eol.store.summing import sum_up
from bench.i18n.errors import at
from drivers.interfaces.text import Text, text, text_of

#: Forwarded at one go, so that a long outage does not hold up the line when it ends.
_AT_ONCE = 50
#: After so many new records statistics' sums are brought up; and how many stretches at one go, so that records do not wait long.
_SUM_AFTER, _SUMS = 2000, 20


@dataclass(frozen=True)
class Refusal:
    """A record that a database refuses for what is in it: which one, which database, and why. It holds up no other."""

    identifier: str
    named: Text
    why: Text

    @property
    def words(self) -> Text:
        """The whole in a sentence."""
        return text("{record} is refused: {why}", record=self.named, why=self.why)


class ForwardingRecords:
    """Saves into the station's own database, into the spool where that cannot be written, and forwards to a server's.

    A record leaves the outbox after the server has committed it; where the answer was lost it is sent again, and the
    server knows its identifier. `connect` opens the server's database, or raises InputError; without it nothing is forwarded.
    """

    def __init__(self, own: Engine, connect: Callable[[], Engine] | None, spool: Spool) -> None:
        self._own = own
        self._connect = connect
        self._spool = spool
        self._server: Engine | None = None
        self._lock = threading.Lock()
        self._refused: dict[str, Refusal] = {}
        self._last_count = 0
        #: New records since the sums were brought up, here and on the server.
        self._new_here = self._new_there = 0
        #: Batches whose plan the server has.
        self._carried: set[str] = set()
        #: Why the own database, and why the server, takes nothing now; empty where it does.
        self.own_fault: Text | str = ""
        self.fault: Text | str = ""
        self.records = Records(own)

    @property
    def refused(self) -> tuple[Refusal, ...]:
        """The records that were refused for what is in them."""
        with self._lock:
            return tuple(self._refused.values())

    def save(self, record: MotorRecord) -> bool:
        """Keep a record here, durably; tell whether it was new. Raises StoreError where neither database nor disk takes it."""
        if self.own_fault:
            # It was tried a moment ago, and a line must not wait for it with every motor.
            self._spool.keep(record)
            return True
        try:
            return self._store(record)
        except StoreError as error:
            self._spool.keep(record)
            if isinstance(error, RefusedError):
                self._refuse(record.identifier, _named(record), text_of(error))
            else:
                self.own_fault = text_of(error)
            return True

    def store_spooled(self) -> int:
        """Take records out of the spool into the own database; return how many. See `own_fault` where it takes none."""
        stored = 0
        try:
            names = [name for name in self._spool.names() if name not in self._refused]
            for name in names:
                if self._store_one(name):
                    self._spool.drop(name)
                    stored += 1
            if not names and self.own_fault:
                self._probe()
        except FAULTS_AND_OWN as error:
            self.own_fault = text_of(fault_of(error))
        else:
            self.own_fault = ""
        return stored

    def spooled(self) -> int | None:
        """Return how many records no database has, None where that cannot be seen."""
        try:
            return len(self._spool.names())
        except StoreError:
            return None

    def waiting(self) -> int:
        """Return how many records of the own database the server has not confirmed, as of the last time that could be seen."""
        if self._connect is None:
            return 0
        try:
            with self._own.connect() as connection:
                self._last_count = int(connection.execute(select(func.count()).select_from(OUTBOX)).scalar_one())
        except FAULTS as error:
            self.own_fault = self.own_fault or text_of(fault_of(error))
        return self._last_count

    def forward(self) -> int:
        """Send what waits, some at a time; return how many the server took now. What keeps it from that: see `fault` and `own_fault`."""
        if self._connect is None:
            return 0
        try:
            return self._forward()
        except FAULTS_AND_OWN as error:
            self.own_fault = text_of(fault_of(error))
            return 0

    @property
    def sums_due(self) -> bool:
        """True if enough records are new that the sums must be updated."""
        return self._new_here >= _SUM_AFTER or self._new_there >= _SUM_AFTER

    def sum_up(self, *, at_the_end: bool = False) -> None:
        """Bring up what statistics have summed up, here and on the server, where that is due or at a batch's end."""
        # A database that cannot do it now loses nothing: statistics count what is not summed up.
        if self._new_here >= _SUM_AFTER or (at_the_end and self._new_here):
            self._new_here = 0
            with suppress(*FAULTS):
                sum_up(self._own, _SUMS)
        if self._server is not None and (self._new_there >= _SUM_AFTER or (at_the_end and self._new_there)):
            self._new_there = 0
            with suppress(*FAULTS):
                sum_up(self._server, _SUMS)

    def close(self) -> None:
        """Close the connections to both databases."""
        self._hang_up()
        self._own.dispose()

    def _store(self, record: MotorRecord) -> bool:
        try:
            with self._own.begin() as connection:
                new = insert_record(connection, record)
                self._new_here += new
                if new and self._connect is not None:
                    connection.execute(insert(OUTBOX).values(identifier=record.identifier))
                return new
        except FAULTS as error:
            raise fault_of(error) from error

    def _store_one(self, name: str) -> bool:
        """Store one record of the spool; false where it is refused."""
        try:
            record = self._spool.read(name)
        except SpooledFileError as error:
            where = Text("{folder}/{name}.json", {"folder": str(self._spool.folder), "name": name})
            self._refuse(name, where, text("the record is not as it was written: {error}", error=error))
            return False
        if record is None:
            return False
        try:
            self._store(record)
        except RefusedError as error:
            self._refuse(name, _named(record), text_of(error))
            return False
        return True

    def _probe(self) -> None:
        """See whether the own database can be written, where nothing else tells."""
        with self._own.connect() as connection:
            connection.exec_driver_sql("BEGIN IMMEDIATE")
            connection.rollback()

    def _forward(self) -> int:
        query = select(OUTBOX.c.identifier).where(OUTBOX.c.identifier.not_in(list(self._refused)))
        with self._own.connect() as connection:
            waiting = list(connection.execute(query.order_by(sql("rowid")).limit(_AT_ONCE)).scalars())
        done = 0
        doubtful: tuple[MotorRecord, StoreError] | None = None
        for identifier in waiting:
            record = self.records.find(identifier)
            if record is None:
                why = text("the record waits to be forwarded but is missing; the file was changed by hand")
                self._refuse(identifier, text("record {identifier}", identifier=identifier), why)
                continue
            try:
                self._send(record)
            except RefusedError as error:
                self._refuse_by_server(record, error)
            except DoubtfulError as error:
                if doubtful is not None:
                    return self._stopped(error, done)
                doubtful = (record, error)
            except StoreError as error:
                return self._stopped(error, done)
            else:
                self._confirm(identifier)
                self._new_there += 1
                done += 1
                if doubtful is not None:
                    # The server takes others.
                    self._refuse_by_server(*doubtful)
                    doubtful = None
        if doubtful is not None:
            return self._stopped(doubtful[1], done)
        self.fault = ""
        return done

    def _send(self, record: MotorRecord) -> None:
        try:
            if self._server is None and self._connect is not None:
                self._server = self._connect()
            if self._server is not None:
                if record.batch not in self._carried:
                    carry_plans(self._own, self._server, record.batch)
                    self._carried.add(record.batch)
                Records(self._server).save(record)
        except StoreError:
            raise
        except FAULTS as error:
            raise fault_of(error) from error

    def _stopped(self, error: StoreError, done: int) -> int:
        # A connection that breaks and one that cannot be made are one trouble, in the same words.
        self.fault = at(place_of(self._server), text_of(error)) if self._server is not None else text_of(error)
        # When it answers again it may have been replaced: its version is looked at anew.
        self._hang_up()
        return done

    def _hang_up(self) -> None:
        server, self._server = self._server, None
        self._carried.clear()
        if server is not None:
            server.dispose()

    def _confirm(self, identifier: str) -> None:
        with self._own.begin() as connection:
            connection.execute(delete(OUTBOX).where(OUTBOX.c.identifier == identifier))

    def _refuse_by_server(self, record: MotorRecord, error: StoreError) -> None:
        self._refuse(record.identifier, _named(record), text("the server: {why}", why=error))
        with self._own.begin() as connection:
            connection.execute(
                update(OUTBOX)
                .where(OUTBOX.c.identifier == record.identifier)
                .values(tries=OUTBOX.c.tries + 1, fault=str(error))
            )

    def _refuse(self, identifier: str, named: Text, why: Text) -> None:
        with self._lock:
            self._refused[identifier] = Refusal(identifier, named, why)


#: What reading and writing the own database and the spool may raise.
FAULTS_AND_OWN = (*FAULTS, StoreError)


def _named(record: MotorRecord) -> Text:
    return text(
        "the record of motor {number} ({serial_number}) of batch {batch}",
        number=record.number,
        serial_number=record.serial_number,
        batch=record.batch,
    )
