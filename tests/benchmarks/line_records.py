"""Records of very many motors, put into a database by its own bulk way, in the order and the layout that a line leaves behind."""

import sqlite3
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import psycopg

from bench.eol.store.database import database_url, open_database
from bench.eol.store.schema import CHECK, FIGURE, METADATA, MOTOR
from bench.eol.store.summing import sum_up

#: Parameter, unit, mean, standard deviation; the limits are ± 4 standard deviations, and two processes are off their middle.
PARAMETERS = (
    ("coulomb_friction", "N·m", 0.02, 1.0e-3),
    ("d_axis_inductance", "H", 2.6e-4, 4.0e-6),
    ("flux_linkage", "V·s/rad", 0.0137, 1.1e-4),
    ("inertia", "kg·m²", 6.0e-5, 5.0e-7),
    ("q_axis_inductance", "H", 3.1e-4, 5.0e-6),
    ("stator_resistance", "Ω", 0.0165, 1.5e-4),
)
_PROCEDURES = ("back-emf-constant", "dq-inductance", "mechanical", "stator-resistance")
#: Every so many tests one is of a motor that was tested before.
AGAIN = 50
_CHUNK = 20_000
_BATCH = 100_000


def fill(reference: str, motors: int, seed: int = 1) -> None:
    """Put `motors` records into a new database (a file's path, or a URL of PostgreSQL)."""
    open_database(reference).dispose()
    if database_url(reference).get_backend_name() == "sqlite":
        _fill_sqlite(Path(reference), motors, seed)
    else:
        _fill_postgresql(reference, motors, seed)
    # As a line does at a batch's end.
    engine = open_database(reference)
    sum_up(engine)
    engine.dispose()


def _fill_sqlite(path: Path, motors: int, seed: int) -> None:
    connection = sqlite3.connect(path)
    for pragma in ("synchronous = OFF", "cache_size = -300000"):
        connection.execute(f"PRAGMA {pragma}")
    for tables in _chunks(motors, seed):
        for table, rows in tables.items():
            places = ", ".join("?" * len(rows[0]))
            named = _first_columns(table, len(rows[0]))
            connection.executemany(f"INSERT INTO {table} ({named}) VALUES ({places})", rows)  # noqa: S608  names of our own
        connection.commit()
    connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    connection.close()


def _fill_postgresql(reference: str, motors: int, seed: int) -> None:
    with psycopg.connect(reference, autocommit=True) as connection:
        for tables in _chunks(motors, seed):
            for table, rows in tables.items():
                with connection.cursor().copy(
                    f"COPY {table} ({_first_columns(table, len(rows[0]))}) FROM STDIN"
                ) as copy:
                    for row in rows:
                        copy.write_row(row)
        # What its own service does in the background between one shift and the next.
        connection.execute("VACUUM (ANALYZE)")


def _first_columns(table: str, count: int) -> str:
    """Return the names of a table's first columns; what came later has its default."""
    return ", ".join([column.name for column in METADATA.tables[table].columns][:count])


def _chunks(motors: int, seed: int) -> Iterator[dict[str, list[tuple[Any, ...]]]]:
    """Give rows by table, some motors at a time: one motor after the other, as a line writes them."""
    random = np.random.default_rng(seed)
    noon = datetime(2026, 11, 1, 12, tzinfo=UTC)
    means = np.array([mean + (0.8 * sigma if n % 3 == 2 else 0.0) for n, (_, _, mean, sigma) in enumerate(PARAMETERS)])
    sigmas = np.array([sigma for *_, sigma in PARAMETERS])
    lows = [mean - 4.0 * sigma for _, _, mean, sigma in PARAMETERS]
    highs = [mean + 4.0 * sigma for _, _, mean, sigma in PARAMETERS]
    for first in range(0, motors, _CHUNK):
        count = min(_CHUNK, motors - first)
        values = random.normal(means, sigmas, (count, len(PARAMETERS))).tolist()
        again = (random.random(count) < 0.01).tolist()
        made: dict[str, list[tuple[Any, ...]]] = {MOTOR.name: [], FIGURE.name: [], CHECK.name: []}
        for n in range(count):
            key = first + n + 1
            at = noon + timedelta(seconds=key)
            good = [low <= value <= high for value, low, high in zip(values[n], lows, highs, strict=True)]
            verdict = "pass" if all(good) else "fail"
            made[MOTOR.name].append(
                (
                    key,
                    f"{key:036x}",
                    f"B{1 + (key - 1) // _BATCH:03d}",
                    1 + (key - 1) % _BATCH,
                    "Pump",
                    "0" * 64,
                    f"line {1 + key % 3}",
                    str(1 + key % 4),
                    "Wang",
                    "LG-400W",
                    f"P-{key if key % AGAIN else key - AGAIN // 2:08d}",
                    at,
                    at + timedelta(seconds=3),
                    verdict,
                    verdict == "pass" and not again[n],
                    12.5,
                    "",
                    f"runs/{key}",
                    "f" * 64,
                )
            )
            made[FIGURE.name] += [
                (
                    key,
                    name,
                    values[n][p],
                    unit,
                    sigma / 20.0,
                    sigma / 10.0,
                    lows[p],
                    highs[p],
                    "pass" if good[p] else "fail",
                )
                for p, (name, unit, _, sigma) in enumerate(PARAMETERS)
            ]
            made[CHECK.name] += [
                (key, procedure, 1, "error" if again[n] and p == 0 else "pass", 3.0, "")
                for p, procedure in enumerate(_PROCEDURES)
            ]
        yield made
