"""Opening a database: SQLite's durability, the tables' version, and errors that say what to do."""

import sqlite3
from importlib import resources
from pathlib import Path
from threading import Event
from time import monotonic
from typing import Any

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import URL, Connection, Engine, create_engine, event, make_url
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError

from bench.i18n.errors import FileError, InputError, at
from drivers.interfaces.text import text, text_of

_KINDS = ("sqlite", "postgresql")
#: How long (s) a writer waits for another one, and a client for a server that does not answer.
_PATIENCE = 5
#: How long (s) one waits for another that makes the tables or brings them up, and how often (s) it looks.
_UPGRADE, _LOOK = 60, 0.02
#: The server's lock on bringing up its tables: any number that nobody else takes.
_LOCK = 7265193


class NoDatabaseError(FileError):
    """The file that should hold the records is not there."""


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
    """Return the database with its tables at this version's; an older one is brought up to it.

    A SQLite file that is not there is made, unless it has to be `existing`.
    Raises NoDatabaseError where it has to be there and is not; InputError where it cannot be reached or written, is no
    database, or has tables of a newer version.
    """
    url = database_url(reference)
    if existing and url.get_backend_name() == "sqlite" and not Path(url.database or "").is_file():
        raise NoDatabaseError(
            text(
                "{reference}: there are no records here; give the file or the address that eol run wrote to",
                reference=reference,
            )
        )
    try:
        engine = create_engine(url, pool_pre_ping=url.get_backend_name() != "sqlite", connect_args=_arguments(url))
    except NoSuchModuleError as error:
        raise InputError(at(_named(url), text_of(error))) from None
    if url.get_backend_name() == "sqlite":
        event.listen(engine, "connect", _durable)
    try:
        _bring_up(engine)
    except BaseException as error:
        engine.dispose()
        if isinstance(error, DBAPIError):
            said = at(_named(url), reason(error))
            # A database that is busy may be read the next time; a file that is none will not.
            busy = isinstance(error.orig, sqlite3.OperationalError) or not isinstance(error.orig, sqlite3.Error)
            raise (InputError if busy else FileError)(said) from None
        raise
    return engine


def reason(error: DBAPIError) -> str:
    """Return the database's own words, in one line."""
    return " ".join(str(error.orig).split()) or type(error.orig).__name__


def _named(url: URL) -> str:
    """Return the address without its password."""
    return url.render_as_string(hide_password=True)


def _arguments(url: URL) -> dict[str, Any]:
    if url.get_backend_name() == "sqlite":
        return {"timeout": _PATIENCE, "check_same_thread": False}
    # A network that falls silent, or somebody who holds a table, is told of and not waited for without end.
    return {
        "connect_timeout": _PATIENCE,
        "keepalives_idle": 10,
        "keepalives_interval": 5,
        "keepalives_count": 2,
        "tcp_user_timeout": 20_000,
        "options": "-c lock_timeout=15s",
    }


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
            if error.sqlite_errorcode & 0xFF not in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED) or monotonic() > until:
                raise
            Event().wait(_LOOK)
        else:
            return


def _bring_up(engine: Engine) -> None:
    config = Config()
    config.set_main_option("script_location", str(resources.files("bench.eol.store") / "migrations"))
    known = {script.revision for script in ScriptDirectory.from_config(config).walk_revisions()}
    with engine.connect() as connection:
        if _version(connection, known) == max(known):
            return
    with engine.begin() as connection:
        _lock_tables(connection)
        # Another may have brought them up while this one waited.
        if _version(connection, known) != max(known):
            config.attributes["connection"] = connection
            command.upgrade(config, "head")


def _version(connection: Connection, known: set[str]) -> str | None:
    """Return the tables' version, None where there are none. Raises InputError for one that is not known."""
    found = MigrationContext.configure(connection).get_current_revision()
    if found is not None and found not in known:
        raise InputError(
            text(
                "{named}: its tables are of version {found}, which this program does not know "
                "(it knows up to {max}); use the newer motorbench that made them. Nothing was changed",
                named=_named(connection.engine.url),
                found=found,
                max=max(known),
            )
        )
    return found


def _lock_tables(connection: Connection) -> None:
    """Have nobody else change the tables before this transaction ends: of stations that start together, one brings them up."""
    if connection.dialect.name == "postgresql":
        connection.exec_driver_sql(f"SET LOCAL lock_timeout = '{_UPGRADE}s'")
        connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({_LOCK})")
        return
    connection.exec_driver_sql(f"PRAGMA busy_timeout = {1000 * _UPGRADE}")
    # Without it each table would be made in a transaction of its own, and a process that is killed would leave half of them.
    connection.exec_driver_sql("BEGIN IMMEDIATE")
    connection.exec_driver_sql(f"PRAGMA busy_timeout = {1000 * _PATIENCE}")
