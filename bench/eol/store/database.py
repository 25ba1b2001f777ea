"""Opening a database: SQLite's durability, the tables' version, and errors that say what to do."""

from importlib import resources
from pathlib import Path
from typing import Any

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import URL, Engine, create_engine, event, make_url
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError

from bench.errors import InputError, at, said_by
from procedures.text import text

_KINDS = ("sqlite", "postgresql")
#: How long (s) a writer waits for another one, and a client for a server that does not answer.
_PATIENCE = 5


class NoDatabaseError(InputError):
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
            text("{reference}: this is no address of a database: {error}", reference=reference, error=said_by(error))
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
        raise InputError(at(_named(url), said_by(error))) from None
    if url.get_backend_name() == "sqlite":
        event.listen(engine, "connect", _durable)
    try:
        _bring_up(engine)
    except DBAPIError as error:
        engine.dispose()
        raise InputError(at(_named(url), reason(error))) from None
    except InputError:
        engine.dispose()
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
    return {"connect_timeout": _PATIENCE}


def _durable(connection: Any, _record: Any) -> None:
    """Have commits on the disk, readers beside the writer, and references held.

    The log begins anew after 1 MB: a sync of what is written over waits for the disk alone, one of a file that grows for the file
    system's own journal too.
    """
    cursor = connection.cursor()
    for pragma in ("journal_mode = WAL", "synchronous = FULL", "foreign_keys = ON", "wal_autocheckpoint = 250"):
        cursor.execute(f"PRAGMA {pragma}")
    cursor.close()


def _bring_up(engine: Engine) -> None:
    config = Config()
    config.set_main_option("script_location", str(resources.files("bench.eol.store") / "migrations"))
    known = {script.revision for script in ScriptDirectory.from_config(config).walk_revisions()}
    with engine.begin() as connection:
        found = MigrationContext.configure(connection).get_current_revision()
        if found is not None and found not in known:
            raise InputError(
                text(
                    "{named}: its tables are of version {found}, which this program does not know "
                    "(it knows up to {max}); use the newer motorbench that made them. Nothing was changed",
                    named=_named(engine.url),
                    found=found,
                    max=max(known),
                )
            )
        if found == max(known):
            return
        if engine.dialect.name == "postgresql":
            # Stations that start together: one brings the tables up, the others wait and find it done.
            connection.exec_driver_sql("SELECT pg_advisory_xact_lock(7265193)")
        config.attributes["connection"] = connection
        command.upgrade(config, "head")
