"""Where a batch's records go: a file beside the runs, forwarded to a server where one is named."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from sqlalchemy import Engine

from bench.eol.record import MotorRecord
from bench.eol.store.database import database_url, open_database
from bench.eol.store.forwarding import ForwardingRecords
from bench.eol.store.insertion import settle
from bench.eol.store.records import Passage, Records, StoreError
from bench.errors import InputError
from procedures.text import text

#: The file among the runs that keeps records until their server has them.
FILE = "records.sqlite"
#: How often (s) what waits for a server is tried again, and how long (s) the batch's end waits for it.
_AGAIN, _AT_THE_END = 5.0, 20.0


class Keeper:
    """Keeps records in one database; with a server, that is the station's own, and a thread forwards what it holds."""

    def __init__(self, own: Engine, server: str = "") -> None:
        self._own = own
        self.records = Records(own)
        self._outbox = ForwardingRecords(own, lambda: open_database(server)) if server else None
        self._left = (0, "")
        self._news, self._over = threading.Event(), threading.Event()
        self._thread: threading.Thread | None = None
        if self._outbox is not None:
            self._thread = threading.Thread(target=self._forward, name="forward records", daemon=True)
            self._thread.start()

    def save(self, record: MotorRecord) -> None:
        """Keep a record; it is durable when this returns. Raises StoreError."""
        if self._outbox is None:
            self.records.save(record)
            return
        self._outbox.save(record)
        self._news.set()

    def earlier(self, serial_number: str) -> Passage | None:
        """Return the last passage of a serial number, in any batch, or None."""
        return self.records.last_passage(serial_number)

    def waiting(self) -> int:
        """Return how many records the server has not confirmed."""
        return self._outbox.waiting() if self._outbox else 0

    def fault(self) -> str:
        """Return why the server does not take them, where it does not."""
        return self._outbox.fault if self._outbox else ""

    @property
    def left(self) -> tuple[int, str]:
        """How many records a server had not confirmed at the end, and why it did not take them."""
        return self._left

    def close(self) -> None:
        """Forward what can be forwarded now, and let go of the databases."""
        self._over.set()
        self._news.set()
        if self._thread is not None:
            self._thread.join(_AT_THE_END)
        self._left = (self.waiting(), self.fault())
        # For who reads the file by other means; a disk that is full loses nothing by it.
        with suppress(InputError):
            settle(self._own)
        if self._outbox is not None:
            self._outbox.close()
        self._own.dispose()

    def _forward(self) -> None:
        outbox = self._outbox
        while outbox is not None:
            self._news.clear()
            with suppress(StoreError):
                while outbox.forward():
                    pass
            if self._over.is_set():
                return
            # New records alone are no reason to try a server that was away a moment ago.
            (self._over if outbox.fault else self._news).wait(_AGAIN)


def open_keeper(reference: str, runs: Path) -> Keeper:
    """Return where records are kept: a file's path or an address as `database_url` takes it.

    Raises InputError where it cannot be used; a server that is away can.
    """
    if database_url(reference).get_backend_name() != "postgresql":
        return Keeper(open_database(reference))
    try:
        runs.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            text(
                "{runs}: the folder of the runs cannot be made: {strerror}; see --runs",
                runs=runs,
                strerror=error.strerror,
            )
        ) from None
    return Keeper(open_database(str(runs / FILE)), reference)


@contextmanager
def own_records(reference: str) -> Iterator[Records]:
    """Give the records of a database as `open_keeper` takes it. Raises InputError where there are none."""
    if "://" not in reference and not Path(reference).is_file():
        raise InputError(
            text("{reference}: there are no records here; name their file or server by --records", reference=reference)
        )
    engine = open_database(reference)
    try:
        yield Records(engine)
    finally:
        engine.dispose()
