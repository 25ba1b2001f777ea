"""A PostgreSQL database to try records on, empty for each test."""

import os
import subprocess
import sys
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psycopg
from psycopg.sql import SQL, Identifier

from bench.eol.store.database import open_database
from bench.eol.store.schema import COMPATIBILITY, METADATA

#: The environment's variable that names a server, and the one that is looked for without it.
VARIABLE, USUAL = "MOTORBENCH_POSTGRESQL", "postgresql://postgres@127.0.0.1:5432/postgres"
_ROOT = Path(__file__).parents[3]


@contextmanager
def server() -> Iterator[str]:
    """The address of a server: the named one, the one on this machine, or one of our own for the length of the block.

    Raises RuntimeError where none can be had.
    """
    named = os.environ.get(VARIABLE)
    if named is not None or _lets_in(USUAL):
        yield named or USUAL
        return
    with packaged_server() as address:
        yield address


@contextmanager
def packaged_server() -> Iterator[str]:
    """Run the packaged server, in a folder of its own; it ends with the block or with this process, whatever ends that."""
    command = [sys.executable, "-m", "tests.bench.eol.packaged_postgresql"]
    with subprocess.Popen(
        command,
        cwd=_ROOT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # Ctrl-C is meant for this process, which ends the server afterwards.
        start_new_session=True,
    ) as process:
        assert process.stdout is not None
        address = process.stdout.readline().strip()
        if not address:
            _, errors = process.communicate()
            raise RuntimeError(
                f"no PostgreSQL server answers at {USUAL}, and the packaged one does not start:\n{errors.strip()}\n"
                f"Name one in {VARIABLE}"
            )
        try:
            yield address
        finally:
            process.communicate("end\n")


@contextmanager
def own_database(server: str) -> Iterator[str]:
    """Make a database on a server for the length of the block; its address."""
    name = f"motorbench_{uuid.uuid4().hex}"
    with psycopg.connect(server, autocommit=True) as connection:
        connection.execute(f'CREATE DATABASE "{name}"')
        # No test pulls the server's plug: commits need not wait for its disk.
        connection.execute(f'ALTER DATABASE "{name}" SET synchronous_commit = off')
    yield server.rpartition("/")[0] + f"/{name}"
    with psycopg.connect(server, autocommit=True) as connection:
        connection.execute(f'DROP DATABASE "{name}" WITH (FORCE)')


class ClearedDatabase:
    """A database that has nothing in it for each test, or the program's tables without records."""

    def __init__(self, address: str) -> None:
        self.address = address
        self._tables: list[tuple[object, ...]] | None = None

    def leave(self) -> None:
        """Leave nobody at it."""
        with psycopg.connect(self.address, autocommit=True) as connection:
            connection.execute(
                "SELECT pg_terminate_backend(pid) FROM pg_stat_activity"
                " WHERE datname = current_database() AND pid <> pg_backend_pid()"
            )

    def clear(self, *, with_tables: bool) -> None:
        """Leave nothing in it but the tables that are asked for."""
        with psycopg.connect(self.address, autocommit=True) as connection:
            if with_tables and self._tables is not None and self._tables == _definitions(connection):
                # Making them takes the server and the program a quarter of a second.
                for table in reversed(METADATA.sorted_tables):
                    if table is not COMPATIBILITY:
                        connection.execute(SQL("DELETE FROM {}").format(Identifier(table.name)))
                connection.execute("SELECT setval(oid::regclass, 1, false) FROM pg_class WHERE relkind = 'S'")
                return
            connection.execute("DROP SCHEMA public CASCADE")
            connection.execute("CREATE SCHEMA public")
            connection.execute("GRANT USAGE ON SCHEMA public TO PUBLIC")
            self._tables = None
            if with_tables:
                open_database(self.address).dispose()
                self._tables = _definitions(connection)


def _definitions(connection: psycopg.Connection) -> list[tuple[object, ...]]:
    """Return what differs once a test has changed more than the rows of records."""
    places = ("pg_namespace", "pg_class", "pg_attribute", "pg_constraint", "pg_trigger", "pg_proc")
    result = _written(connection, *places)
    present = connection.execute("SELECT to_regclass('alembic_version') IS NOT NULL").fetchone()
    # Of these two tables the rows are no records.
    return result + _written(connection, "alembic_version", COMPATIBILITY.name) if present == (True,) else result


def _written(connection: psycopg.Connection, *tables: str) -> list[tuple[object, ...]]:
    counted = SQL("SELECT {}, count(*), max(xmin::text::bigint) FROM {}")
    return connection.execute(SQL(" UNION ALL ").join(counted.format(t, Identifier(t)) for t in tables)).fetchall()


def _lets_in(address: str) -> bool:
    try:
        psycopg.connect(address, connect_timeout=5).close()
    except psycopg.OperationalError:
        return False
    return True
