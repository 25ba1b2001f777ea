"""The tables' version: which this program works with, and what brings older ones up."""

from collections.abc import Callable
from importlib import resources

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, Engine, inspect, select

from bench.eol.store.lock_holders import told_who_holds
from bench.eol.store.schema import COMPATIBILITY, MOTOR
from bench.i18n.errors import InputError
from drivers.interfaces.text import Text, text

#: How long (s) one waits for another that makes the tables or brings them up.
_UPGRADE = 60
#: The server's lock on the tables: any number that nobody else takes.
_LOCK = 7265193


def has_tables(engine: Engine) -> bool:
    """Tell whether a database has tables of records, of whatever version."""
    with engine.connect() as connection:
        return _version(connection) is not None


def make_tables(engine: Engine) -> None:
    """Make the tables in a database that has none; of stations that start together one makes them, the others wait."""
    config, _ = _scripts()
    with engine.begin() as connection:
        _lock_tables(connection)
        if _version(connection) is None:
            config.attributes["connection"] = connection
            command.upgrade(config, "head")


def check_version(engine: Engine, named: str) -> None:
    """Raise InputError for tables that this program cannot work with; nothing is changed.

    Newer tables say themselves which is the oldest program that may read and write them.
    """
    _, known = _scripts()
    with engine.connect() as connection:
        found = _version(connection)
        if found == max(known) or (found is not None and found not in known and _least(connection) <= max(known)):
            return
    if found in known:
        raise InputError(
            text(
                "{named}: its tables have version {found}, but this program works with {max}; update them with "
                "motorbench eol migrate --records {named}. Nothing was changed",
                named=named,
                found=found,
                max=max(known),
            )
        )
    raise _newer(named, found, max(known))


def upgrade_tables(engine: Engine, named: str, tell: Callable[[Text], None]) -> tuple[str, str]:
    """Bring older tables up, in one transaction; return the versions before and after. Raises InputError for newer ones.

    `tell` hears, from a thread, for whom it waits.
    """
    config, known = _scripts()
    with engine.begin() as connection, told_who_holds(connection, _UPGRADE, tell):
        _lock_tables(connection)
        found = _version(connection)
        if found is not None and found not in known:
            raise _newer(named, found, max(known))
        config.attributes["connection"] = connection
        command.upgrade(config, "head")
        return found or "", max(known)


def _newer(named: str, found: str | None, newest: str) -> InputError:
    return InputError(
        text(
            "{named}: its tables have version {found}, which this program does not know (it knows up to {max}); "
            "use the newer motorbench that made them. Nothing was changed",
            named=named,
            found=found,
            max=newest,
        )
    )


def _scripts() -> tuple[Config, set[str]]:
    """Return Alembic's configuration, and the versions that this program knows."""
    config = Config()
    config.set_main_option("script_location", str(resources.files("bench.eol.store") / "migrations"))
    return config, {script.revision for script in ScriptDirectory.from_config(config).walk_revisions()}


def _version(connection: Connection) -> str | None:
    """Return the tables' version, None where there are none."""
    return MigrationContext.configure(connection).get_current_revision()


def _least(connection: Connection) -> str:
    """Return the oldest version of a program that may use tables of a version that this one does not know."""
    if not inspect(connection).has_table(COMPATIBILITY.name) or not inspect(connection).has_table(MOTOR.name):
        return "~"
    return connection.execute(select(COMPATIBILITY.c.least)).scalar() or "~"


def _lock_tables(connection: Connection) -> None:
    """Lock the tables against changes by others until this transaction ends."""
    if connection.dialect.name == "postgresql":
        connection.exec_driver_sql(f"SET LOCAL lock_timeout = '{_UPGRADE}s'")
        connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({_LOCK})")
        return
    usual = connection.exec_driver_sql("PRAGMA busy_timeout").scalar_one()
    connection.exec_driver_sql(f"PRAGMA busy_timeout = {1000 * _UPGRADE:.0f}")
    # Without it each table would be made in a transaction of its own, and a process that is killed would leave half of them.
    connection.exec_driver_sql("BEGIN IMMEDIATE")
    connection.exec_driver_sql(f"PRAGMA busy_timeout = {usual}")
