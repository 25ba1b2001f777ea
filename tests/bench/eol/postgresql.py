"""A PostgreSQL database to try records on, empty for each test."""

import os
import subprocess
import sys
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psycopg

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


def empty(database: str) -> None:
    """Leave nobody at a database and nothing in it."""
    with psycopg.connect(database, autocommit=True) as connection:
        connection.execute(
            "SELECT pg_terminate_backend(pid) FROM pg_stat_activity"
            " WHERE datname = current_database() AND pid <> pg_backend_pid()"
        )
        connection.execute("DROP SCHEMA public CASCADE")
        connection.execute("CREATE SCHEMA public")
        connection.execute("GRANT USAGE ON SCHEMA public TO PUBLIC")


def _lets_in(address: str) -> bool:
    try:
        psycopg.connect(address, connect_timeout=5).close()
    except psycopg.OperationalError:
        return False
    return True
