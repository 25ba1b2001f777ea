"""The destinations of a batch's records: a file beside the runs, forwarded to a server if one is named."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from multiprocessing.connection import wait
from pathlib import Path
from time import monotonic
from typing import Protocol

from sqlalchemy import Engine

from bench.eol.line.admission.serial_register import SerialRegister
from bench.eol.line.stop_request import StopRequest
from bench.eol.record import MotorRecord
from bench.eol.store.batch_plans import BatchPlan, keep_plan
from bench.eol.store.database import NoDatabaseError, database_url, open_database, open_for_reading, using
from bench.eol.store.faults import FAULTS, StoreError, fault_of
from bench.eol.store.forwarder import Forwarder
from bench.eol.store.forwarding import ForwardingRecords
from bench.eol.store.golden_tests import GoldenTests, last_test_ended
from bench.eol.store.insertion import settle
from bench.eol.store.namesakes import Namesake, namesake
from bench.eol.store.records import BatchResult, Records
from bench.eol.store.spool import FOLDER, Spool
from bench.eol.store.waiting import Waiting
from bench.i18n.errors import InputError
from drivers.interfaces.text import Text, reason_of, text, text_of

#: The file among the runs that keeps records until their server has them.
FILE = "records.sqlite"
#: How long (s) the batch's end waits for what is being stored or forwarded.
_AT_THE_END = 20.0
#: How often and for how long (s) a record that is not taken is tried again.
_RETRY_INTERVAL, _RETRY_TIME = 1.0, 30.0


class RecordDestination(Protocol):
    """A destination that saves records."""

    def save(self, record: MotorRecord) -> None:
        """Keep a record, durably. Raises StoreError."""


class RecordWriter:
    """Keeps records in one database; with a server, that is the station's own, and what it holds is forwarded.

    What the database does not take now is kept in files of `spool` and stored later.
    """

    def __init__(self, own: Engine, spool: Spool, server: str = "") -> None:
        self._own = own
        self._spool = spool
        self.records = Records(own)
        self._forwarding = ForwardingRecords(own, (lambda: open_database(server)) if server else None, spool)
        self._has_server = bool(server)
        #: How many records waited for the server at the beginning.
        self.waited = self._forwarding.waiting()
        self._left = Waiting()
        try:
            # What an earlier batch left there counts as measured.
            self._forwarding.store_spooled()
            spool.reserve()
        except BaseException:
            self._forwarding.close()
            spool.close()
            raise
        self._forwarder = Forwarder(self._forwarding)
        self.register = SerialRegister(own, server, self._spooled)

    def save(self, record: MotorRecord) -> None:
        """Keep a record; it is durable when this returns. Raises StoreError where neither the database nor the disk takes it."""
        self._forwarding.save(record)
        waits = self._forwarding.own_fault or self._forwarding.refused or self._forwarding.sums_due
        if self._has_server or waits:
            self._forwarder.news()

    def keep_plan(self, plan: BatchPlan) -> None:
        """Keep what a batch is measured by. Raises StoreError where the database does not take it."""
        try:
            with self._own.begin() as connection:
                keep_plan(connection, plan)
        except FAULTS as error:
            raise fault_of(error) from error

    def results(self, batch: str) -> Iterator[BatchResult]:
        """Give the result of each test in the batches of a name. Raises StoreError where that cannot be looked up."""
        with _reading():
            yield from self.records.results(batch)
            for each in self._spooled():
                if each.batch == batch:
                    yield BatchResult(each.identifier, each.number, each.serial_number, each.verdict)

    def experience(self, plan: str) -> dict[str, tuple[int, int, float]]:
        """Return what `Records.experience` does. Raises StoreError where that cannot be looked up."""
        with _reading():
            return self.records.experience(plan)

    def uncertainties(self, plan: str, station: str) -> dict[str, float]:
        """Return what `Records.uncertainties` does. Raises StoreError where that cannot be looked up."""
        with _reading():
            return self.records.uncertainties(plan, station)

    def golden_tests(self, plan: str, station: str) -> GoldenTests:
        """Return the golden motors' tests of a plan at a station."""
        return GoldenTests(self._own, plan, station, self.register.ask_server)

    def namesake(self, station: str) -> Namesake | None:
        """Return a test that the server has under a station's name and the station has not. Raises StoreError."""
        with _reading():
            return namesake(self._own, station, self.register.ask_server)

    def last_test_ended(self, station: str) -> datetime | None:
        """Return when (UTC) a station's latest test ended, None where it has none. Raises StoreError."""
        with _reading():
            return last_test_ended(self._own, station)

    def listen(self, listener: Callable[[Waiting], None]) -> None:
        """Call `listener` with what waits to be stored or forwarded, at each change, from any thread."""
        troubled = False

        def heard(waiting: Waiting) -> None:
            nonlocal troubled
            if troubled and not waiting.troubles:
                # The server has taken records again: it can be asked for earlier tests, too.
                self.register.ask_again()
            troubled = bool(waiting.troubles)
            listener(waiting)

        self._forwarder.listen(heard)

    @property
    def left(self) -> Waiting:
        """The records that still waited at the end."""
        return self._left

    def close(self) -> None:
        """Store and forward all records that can be now, and close the databases."""
        self.register.close()
        self._left = self._forwarder.close(_AT_THE_END)
        # For who reads the file by other means; a disk that is full loses nothing by it.
        with suppress(InputError):
            settle(self._own)
        self._forwarding.close()
        self._spool.close()

    def _spooled(self) -> Iterator[MotorRecord]:
        # Healthy stations have no files there, and must not list a folder for each motor.
        if self._forwarding.own_fault or self._forwarding.refused or self._forwarder.state.unstored:
            yield from self._spool.records()


@contextmanager
def _reading() -> Iterator[None]:
    try:
        yield
    except FAULTS as error:
        raise StoreError(
            text("the station's records cannot be read: {error}", error=text_of(fault_of(error)))
        ) from error


def open_record_writer(reference: str, runs: Path) -> RecordWriter:
    """Return where records are kept: a file's path or an address as `database_url` takes it.

    Raises InputError where it cannot be used; a server that is away can.
    """
    if database_url(reference).get_backend_name() != "postgresql":
        own = str(database_url(reference).database)
        return RecordWriter(open_database(reference), Spool(runs / FOLDER, own))
    try:
        runs.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            text(
                "{runs}: the folder of the runs cannot be made: {strerror}; see --runs",
                runs=runs,
                strerror=reason_of(error),
            )
        ) from None
    own = str((runs / FILE).absolute())
    return RecordWriter(open_database(own), Spool(runs / FOLDER, own), reference)


def forward_records(server: str, runs: Path) -> tuple[int, Waiting]:
    """Forward the records of a folder of runs that wait for a server; return how many waited before, and what waits now.

    Raises NoDatabaseError where the folder has no records, or the server no tables of them: it may be another one than they wait for.
    """
    own = str(runs / FILE)
    with own_records(own):
        _check_has_records(server)
        writer = open_record_writer(server, runs)
    waited = writer.waited
    writer.close()
    return waited, writer.left


def _check_has_records(server: str) -> None:
    try:
        open_database(server, existing=True).dispose()
    except NoDatabaseError as error:
        raise NoDatabaseError(
            text(
                "{server}: this server has no tables of records; give the one that eol run was given. A new one gets them with a batch",
                server=database_url(server).set(drivername="postgresql").render_as_string(hide_password=True),
            )
        ) from error
    except FAULTS:
        # One that is away is tried, and what waits is told with its reason.
        return


@contextmanager
def own_records(reference: str) -> Iterator[Records]:
    """Give the records of a database as `open_record_writer` takes it. Raises NoDatabaseError where there are none."""
    with using(open_for_reading(reference)) as engine:
        yield Records(engine)


def save_with_retries(
    destination: RecordDestination, record: MotorRecord, stop: StopRequest, trouble: Callable[[Text], None]
) -> None:
    """Keep a record, durably; where the disk is full for a while, that is reported to `trouble` once and tried again.

    Raises StoreError where it takes too long, or the batch is to stop meanwhile.
    """
    names: dict[str, object] = {"number": record.number, "serial_number": record.serial_number}
    until = monotonic() + _RETRY_TIME
    reported = False
    while True:
        try:
            destination.save(record)
        except StoreError as error:
            if not reported:
                trouble(
                    text(
                        "the record of motor {number} ({serial_number}) is not stored yet. It is tried again for {time:g} s: {error}",
                        error=error,
                        time=_RETRY_TIME,
                        **names,
                    )
                )
            reported = True
            if monotonic() > until or stop.by:
                raise StoreError(
                    text(
                        "the record of motor {number} ({serial_number}) could not be stored: {error}. Its run is in "
                        "{run}. Remove the cause, then give the same command again: the batch continues where it ended",
                        error=error,
                        run=record.run,
                        **names,
                    )
                ) from error
            wait([stop.descriptor], timeout=_RETRY_INTERVAL)
        else:
            return
