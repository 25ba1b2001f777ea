"""Opening a database: SQLite's durability, and errors that say what to do."""

import os
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from socket import gethostname
from threading import Event
from time import monotonic
from typing import Any
from urllib.parse import quote

from sqlalchemy import URL, Engine, column, create_engine, event, false, make_url, select, table, union_all
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError

from bench.eol.store.schema import FRESH_FIGURE
from bench.eol.store.table_versions import check_version, has_tables, make_tables, upgrade_tables
from bench.i18n.errors import FileError, InputError, at
from drivers.interfaces.text import Text, text, text_of

_KINDS = ("sqlite", "postgresql")
#: How long (s) a writer waits for another one, and a client for a server that does not answer.
_PATIENCE = 5
#: How long (s) one waits for another that changes a new file to a write-ahead log, and how often (s) it looks.
_UPGRADE, _LOOK = 60, 0.02
_HELD = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)


class NoDatabaseError(FileError):
    """The file that should hold the records is not there."""


class NotWritableError(FileError):
    """A file cannot be written, or nothing in its folder."""


def database_url(reference: str) -> URL:
    """Return the URL of a database: a file's path is SQLite, `postgresql://USER@HOST/NAME` PostgreSQL.

    Raises InputError for anything else.
    """
    if "://" not in reference:
        return URL.create("sqlite", database=str(Path(reference).absolute()))
    try:
        url = make_url(reference)
    except (ArgumentError, ValueError) as error:
        raise InputError(
            text("{reference}: this is no address of a database: {error}", reference=reference, error=error)
        ) from None
    if url.get_backend_name() not in _KINDS:
        raise InputError(
            text(
                "{named}: databases are kept in SQLite (a file's path) or PostgreSQL (postgresql://USER@HOST/NAME)",
                named=_named(url),
            )
        )
    return url.set(drivername="postgresql+psycopg") if url.get_backend_name() == "postgresql" else url


def open_database(reference: str, *, existing: bool = False) -> Engine:
    """Return the database with its tables, made where there are none unless they have to be `existing`.

    Tables of another version stay as they are: only `migrate_database` changes them.
    Raises NoDatabaseError where there have to be records and are none; InputError where it cannot be reached or written, is
    no database, or has tables of a version that this program cannot work with.
    """
    url = database_url(reference)
    if existing and not _may_have_records(url):
        raise _no_records(reference)
    engine = _engine(url)
    with _explained(engine, url):
        if not has_tables(engine):
            if existing:
                raise _no_records(reference)
            make_tables(engine)
        check_version(engine, _named(url))
    return engine


def open_for_reading(reference: str) -> Engine:
    """Return the database of records that are only read: their file and its folder may be write-protected.

    Raises as `open_database`.
    """
    try:
        return open_database(reference, existing=True)
    except NotWritableError:
        url = database_url(reference)
        write_ahead = Path(f"{url.database}-wal")
        # SQLite reads beside a writer where that has its files there; without them nobody writes, or the medium cannot be written.
        for mode in ("mode=ro", "mode=ro&immutable=1"):
            engine = _engine(url, mode)
            try:
                if has_tables(engine):
                    check_version(engine, _named(url))
                    return engine
            except DBAPIError:
                if write_ahead.is_file() and write_ahead.stat().st_size:
                    break
            engine.dispose()
        raise


@contextmanager
def using(engine: Engine) -> Iterator[Engine]:
    """Use a database within the block; its connections are given up at the end."""
    try:
        yield engine
    finally:
        engine.dispose()


def migrate_database(reference: str, tell: Callable[[Text], None] = lambda _: None) -> tuple[str, str]:
    """Bring a database's tables up to this program's version, all or nothing; return the versions before and after.

    `tell` hears, from a thread, for whom it waits.
    Raises NoDatabaseError where there are no records; InputError as `open_database` does, and for tables of a newer version.
    """
    url = database_url(reference)
    if not _may_have_records(url):
        raise _no_records(reference)
    engine = _engine(url)
    with _explained(engine, url):
        if not has_tables(engine):
            raise _no_records(reference)
        versions = upgrade_tables(engine, _named(url), tell)
    engine.dispose()
    return versions


def _may_have_records(url: URL) -> bool:
    """Tell whether a server, or a file that is there, may hold records; an empty one, or another program's, is left as it is."""
    if url.get_backend_name() != "sqlite":
        return True
    file = Path(url.database or "")
    if not file.is_file() or not file.stat().st_size:
        return False
    try:
        # Opening it as one of ours would change its journal.
        with closing(sqlite3.connect(f"file:{quote(str(file))}?mode=ro", uri=True, timeout=_PATIENCE)) as connection:
            found = connection.execute("SELECT 1 FROM sqlite_master WHERE name = 'alembic_version'").fetchone()
            return found is not None
    except sqlite3.Error:
        # Why it cannot be read is said where it is opened.
        return True


def _no_records(reference: str) -> NoDatabaseError:
    return NoDatabaseError(
        text(
            "{reference}: there are no records here; give the file or the address that eol run wrote to",
            reference=reference,
        )
    )


def _engine(url: URL, read_only: str = "") -> Engine:
    """Return an engine; `read_only` says how SQLite opens a file that cannot be written."""
    arguments = _arguments(url)
    if read_only:
        file = f"file:{quote(str(url.database))}?{read_only}"
        engine = create_engine(url, creator=lambda: sqlite3.connect(file, uri=True, **arguments))
        event.listen(engine, "connect", _readable)
        return engine
    try:
        engine = create_engine(url, pool_pre_ping=url.get_backend_name() != "sqlite", connect_args=arguments)
    except NoSuchModuleError as error:
        raise InputError(at(_named(url), text_of(error))) from None
    if url.get_backend_name() == "sqlite":
        event.listen(engine, "connect", _durable)
    return engine


@contextmanager
def _explained(engine: Engine, url: URL) -> Iterator[None]:
    """Let go of the database where the block fails, and say why in the database's own words."""
    try:
        yield
    except BaseException as error:
        engine.dispose()
        if isinstance(error, DBAPIError):
            if getattr(error.orig, "sqlite_errorcode", 0) & 0xFF in (sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_READONLY):
                raise _not_writable(url, error) from None
            message = at(_named(url), _in_use(error) if _is_held(error) else reason(error))
            # A database that is busy may be read the next time; a file that is none will not.
            busy = isinstance(error.orig, sqlite3.OperationalError) or not isinstance(error.orig, sqlite3.Error)
            raise (InputError if busy else FileError)(message) from None
        raise


def _not_writable(url: URL, error: DBAPIError) -> NotWritableError:
    return NotWritableError(
        text(
            "{named}: {reason}. SQLite writes beside the file: give a file in a folder that exists and that you may write to, or copy the "
            "file to one, and with it the files -wal and -shm if they are there",
            named=_named(url),
            reason=reason(error),
        )
    )


def _is_held(error: DBAPIError) -> bool:
    """Tell whether others held the tables for longer than one waits."""
    code = getattr(error.orig, "sqlite_errorcode", 0) & 0xFF
    return code in _HELD or getattr(error.orig, "sqlstate", None) == "55P03"


def _in_use(error: DBAPIError) -> Text:
    return text(
        "other programs use its tables, a batch, a backup or an open query: {reason}. Nothing was changed; give the command again when "
        "they have ended",
        reason=reason(error),
    )


def reason(error: DBAPIError) -> str:
    """Return the database's own words, in one line."""
    return " ".join(str(error.orig).split()) or type(error.orig).__name__


def place_of(engine: Engine) -> str:
    """Return a database's file, or its address without the password, as one types it."""
    return _named(engine.url)


def _named(url: URL) -> str:
    if url.get_backend_name() == "sqlite":
        return str(url.database)
    return url.set(drivername=url.get_backend_name()).render_as_string(hide_password=True)


def _arguments(url: URL) -> dict[str, Any]:
    if url.get_backend_name() == "sqlite":
        return {"timeout": _PATIENCE, "check_same_thread": False}
    # A network that falls silent, or somebody who holds a table, is told of and not waited for without end.
    return {
        # What a server's list of connections, and who waits for this one, name it by.
        "application_name": f"motorbench ({gethostname()[:30]}, process {os.getpid()})",
        "connect_timeout": _PATIENCE,
        "keepalives_idle": 10,
        "keepalives_interval": 5,
        "keepalives_count": 2,
        "tcp_user_timeout": 20_000,
        "options": "-c lock_timeout=15s",
    }


def _readable(connection: sqlite3.Connection, _record: Any) -> None:
    """Have the figures of the latest motors, which cannot be put into their table, seen there."""
    try:
        connection.execute("PRAGMA temp_store = MEMORY")
        if connection.execute("SELECT 1 FROM main.sqlite_master WHERE name = 'fresh_figure'").fetchone():
            # Names of the connection's own come before the file's.
            columns = [column(each.name, each.type) for each in FRESH_FIGURE.columns]
            both = (select(*columns).select_from(table(name, schema="main")) for name in ("figure", "fresh_figure"))
            connection.execute(f"CREATE TEMP VIEW figure AS {union_all(*both)}")
            nothing = select(*columns).select_from(table("fresh_figure", schema="main")).where(false())
            connection.execute(f"CREATE TEMP TABLE fresh_figure AS {nothing}")
            connection.commit()
    except BaseException:
        connection.close()
        raise


def _durable(connection: sqlite3.Connection, _record: Any) -> None:
    """Have commits on the disk, readers beside the writer, and references held.

    The log begins anew after 1 MB: a sync of what is written over waits for the disk alone, one of a file that grows for the file
    system's own journal too.
    """
    try:
        cursor = connection.cursor()
        _write_ahead(cursor)
        for pragma in ("synchronous = FULL", "foreign_keys = ON", "wal_autocheckpoint = 250"):
            cursor.execute(f"PRAGMA {pragma}")
        cursor.close()
    except BaseException:
        # The pool does not know of it yet, so nobody else would close it.
        connection.close()
        raise


def _write_ahead(cursor: sqlite3.Cursor) -> None:
    """Change a new file to a write-ahead log. SQLite does not wait for others that do the same, so this does."""
    until = monotonic() + _UPGRADE
    while True:
        try:
            cursor.execute("PRAGMA journal_mode = WAL")
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode & 0xFF not in _HELD or monotonic() > until:
                raise
            Event().wait(_LOOK)
        else:
            return
