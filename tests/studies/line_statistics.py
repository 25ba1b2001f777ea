"""`python -m tests.studies.line_statistics`: all statistics over very many motors on a PostgreSQL server.

The server itself makes the records, which for ten millions takes a quarter of an hour and 20 GB; then the finished stretches are
summed up, as a line does at a batch's end, and `line_statistics` is timed, cold once and warm. A database that is there already may be
a file, too.
"""

import argparse
import os
import statistics
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import time as time_of_day

import psycopg
from sqlalchemy import Engine

from bench.eol.line_statistics import LineStatistics, StatisticsRequest, line_statistics
from bench.eol.store.database import open_database
from bench.eol.store.schema import CHECK, FIGURE, MOTOR
from bench.eol.store.summing import sum_up
from bench.eol.yields import GROUPINGS
from tests.bench.eol.postgresql import USUAL, own_database
from tests.benchmarks.line_records import AGAIN, PARAMETERS

#: Motors made in one statement, and of one batch; a second of the line's time lies between two.
_AT_ONCE, _BATCH = 500_000, 100_000


def fill(reference: str, motors: int) -> None:
    """Put records into a new database as a line leaves them, without their indexes, which are made at the end."""
    engine = open_database(reference)
    with engine.begin() as connection:
        for table in (MOTOR, FIGURE, CHECK):
            for index in table.indexes:
                index.drop(connection)
    with psycopg.connect(reference, autocommit=True) as connection:
        connection.execute("SET synchronous_commit = off")
        # Every figure has its motor: nothing looks it up for each.
        connection.execute("SET session_replication_role = replica")
        connection.execute("SELECT setseed(0.25)")
        for first in range(1, motors + 1, _AT_ONCE):
            _fill(connection, first, min(motors, first + _AT_ONCE - 1))
        with engine.begin() as making:
            making.exec_driver_sql("SET LOCAL maintenance_work_mem = '1GB'")
            for table in (MOTOR, FIGURE, CHECK):
                for index in table.indexes:
                    index.create(making)
        connection.execute("SELECT setval('motor_id_seq', %s)", (motors,))
        connection.execute("VACUUM (ANALYZE)")
    engine.dispose()


def _fill(connection: "psycopg.Connection[object]", first: int, last: int) -> None:
    span = {"first": first, "last": last, "batch": _BATCH, "again": AGAIN}
    connection.execute(
        "CREATE TEMP TABLE made (key integer, name text, value float8, unit text, low float8, high float8)"
    )
    for n, (name, unit, mean, sigma) in enumerate(PARAMETERS):
        off = 0.8 * sigma if n % 3 == 2 else 0.0
        connection.execute(
            "INSERT INTO made SELECT key, %(name)s,"
            " %(mean)s + %(sigma)s * sqrt(-2 * ln(1 - random())) * cos(2 * pi() * random()), %(unit)s, %(low)s, %(high)s"
            " FROM generate_series(%(first)s::int, %(last)s::int) AS key",
            {
                **span,
                "name": name,
                "unit": unit,
                "mean": mean + off,
                "sigma": sigma,
                "low": mean - 4.0 * sigma,
                "high": mean + 4.0 * sigma,
            },
        )
    connection.execute(
        "INSERT INTO motor SELECT key, lpad(to_hex(key), 36, '0'), 'B' || lpad((1 + (key - 1) / %(batch)s)::text, 3, '0'),"
        " 1 + (key - 1) %% %(batch)s, 'Pump', repeat('0', 64), 'line ' || 1 + key %% 3, (1 + key %% 4)::text, 'Wang', 'LG-400W',"
        " 'P-' || lpad((CASE WHEN key %% %(again)s = 0 THEN key - %(again)s / 2 ELSE key END)::text, 8, '0'),"
        " at, at + interval '3 s', CASE WHEN good THEN 'pass' ELSE 'fail' END,"
        " good AND key %% 100 <> 0, 12.5, '', 'runs/' || key, repeat('f', 64)"
        " FROM (SELECT key, bool_and(value BETWEEN low AND high) AS good,"
        "       timestamptz '2026-01-01' + key * interval '1 s' AS at FROM made GROUP BY key) AS each ORDER BY key",
        span,
    )
    connection.execute(
        "INSERT INTO figure SELECT key, name, value, unit, (high - low) / 160, (high - low) / 80, low, high,"
        " CASE WHEN value BETWEEN low AND high THEN 'pass' ELSE 'fail' END FROM made ORDER BY key, name"
    )
    connection.execute(
        "INSERT INTO check_attempt SELECT key, name, 1, CASE WHEN key %% 100 = 0 AND name = 'stator-resistance'"
        " THEN 'error' ELSE 'pass' END, 3, '' FROM generate_series(%(first)s::int, %(last)s::int) AS key,"
        " (VALUES ('back-emf-constant'), ('dq-inductance'), ('mechanical'), ('stator-resistance')) AS each (name)"
        " ORDER BY key, name",
        span,
    )
    connection.execute("DROP TABLE made")


def timed(engine: Engine, request: StatisticsRequest) -> tuple[float, LineStatistics]:
    """Return how long (s) all statistics take, and the statistics."""
    began = time.perf_counter()
    found = line_statistics(engine, request)
    return time.perf_counter() - began, found


@contextmanager
def filled(server: str, database: str, motors: int) -> Iterator[str]:
    """Give a database with the records: the named one, or one of its own for the length of the block."""
    if database:
        yield database
        return
    with own_database(server) as reference:
        began = time.perf_counter()
        fill(reference, motors)
        print(f"{motors} motors made in {time.perf_counter() - began:.0f} s", flush=True)
        yield reference


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--motors", type=int, default=10_000_000)
    parser.add_argument("--server", default=USUAL)
    parser.add_argument("--database", default="", help="address or file of a database filled before")
    parser.add_argument("--rounds", type=int, default=5)
    given = parser.parse_args()
    with filled(given.server, given.database, given.motors) as reference:
        engine = open_database(reference)
        first, found = timed(engine, StatisticsRequest())
        print(f"{found.selection.count} motors, for the first time, before summing up: {first:.2f} s", flush=True)
        began = time.perf_counter()
        print(f"{sum_up(engine)} stretches summed up in {time.perf_counter() - began:.1f} s", flush=True)
        for name, request in (
            ("all", StatisticsRequest()),
            ("without two golden motors", StatisticsRequest(golden=("P-00000101", "P-00000201"))),
            ("all, by station, socket, shift, date and plan", StatisticsRequest(by=GROUPINGS)),
            ("all, by shift, which begin at 06:05", StatisticsRequest(by=("shift",), shifts=(time_of_day(6, 5),))),
            ("one batch", StatisticsRequest(batches=("B001",))),
        ):
            took = [timed(engine, request)[0] for _ in range(given.rounds)]
            shown = ", ".join(f"{each:.2f}" for each in took)
            load = os.getloadavg()[0]
            print(f"{name}: {shown} s, median {statistics.median(took):.2f} s, load {load:.1f}", flush=True)
        engine.dispose()


if __name__ == "__main__":
    main()
