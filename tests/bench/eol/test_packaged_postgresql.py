"""The packaged server: there while it is wanted, gone with whoever wanted it."""

import signal
import subprocess
import sys
import threading
from pathlib import Path

import psycopg
import pytest

from tests.bench.eol.postgresql import own_database, packaged_server

ROOT = Path(__file__).parents[3]
OWNER = """
import sys
from tests.bench.eol.postgresql import packaged_server
with packaged_server() as address:
    print(address, flush=True)
    sys.stdin.readline()
"""


def refused(address: str) -> bool:
    """Wait until nothing listens any more."""
    for _ in range(600):
        try:
            psycopg.connect(address, connect_timeout=5).close()
        except psycopg.OperationalError as error:
            if "refused" in str(error):
                return True
        threading.Event().wait(0.1)
    return False


def test_it_serves_for_the_length_of_the_block_and_by_its_password_only() -> None:
    with packaged_server() as address:
        with own_database(address) as database, psycopg.connect(database) as connection:
            assert connection.execute("SELECT 6 * 7").fetchone() == (42,)
        before, _, after = address.partition("://postgres:")
        with pytest.raises(psycopg.OperationalError, match="password"):
            psycopg.connect(f"{before}://postgres@{after.partition('@')[2]}")
    assert refused(address)


def test_it_ends_with_an_owner_that_is_killed() -> None:
    with subprocess.Popen(
        [sys.executable, "-c", OWNER], cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as owner:
        assert owner.stdout is not None
        address = owner.stdout.readline().strip()
        psycopg.connect(address).close()
        owner.send_signal(signal.SIGKILL)
    assert refused(address)
