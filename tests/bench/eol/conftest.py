"""Databases that end-of-line tests keep records in."""

import math
import shutil
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from sqlalchemy import Engine, make_url

from bench.eol.record import CheckRecord, MeasuredFigure
from bench.eol.store.database import open_database
from bench.eol.store.records import Records
from bench.eol.verdict import Verdict
from tests.bench.eol.motor_records import motor_record
from tests.bench.eol.postgresql import ClearedDatabase, own_database
from tests.bench.eol.wire import Wire

NOON = datetime(2026, 11, 21, 12, tzinfo=UTC)


@pytest.fixture(scope="session")
def database(postgresql: str) -> Iterator[ClearedDatabase]:
    """This worker's PostgreSQL database."""
    with own_database(postgresql) as address:
        yield ClearedDatabase(address)


@pytest.fixture
def server(database: ClearedDatabase, request: pytest.FixtureRequest) -> Iterator[str]:
    """A PostgreSQL database with nothing in it; with its tables for tests that have it opened."""
    database.clear(with_tables="engine" in request.fixturenames)
    yield database.address
    database.leave()


@pytest.fixture(scope="session")
def made_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file with the tables and no records."""
    made = tmp_path_factory.mktemp("made") / "records.sqlite"
    open_database(str(made)).dispose()
    return made


@pytest.fixture
def wire(server: str) -> Iterator[Wire]:
    url = make_url(server)
    between = Wire(url.host or "127.0.0.1", url.port or 5432)
    yield between
    between.close()


@pytest.fixture(params=["sqlite", "postgresql"])
def reference(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    if request.param == "postgresql":
        return str(request.getfixturevalue("server"))
    file = tmp_path / "records.sqlite"
    if "engine" in request.fixturenames:
        shutil.copyfile(request.getfixturevalue("made_file"), file)
    return str(file)


@pytest.fixture
def engine(reference: str) -> Iterator[Engine]:
    opened = open_database(reference)
    yield opened
    opened.dispose()


@pytest.fixture
def records(engine: Engine) -> Records:
    return Records(engine)


@pytest.fixture
def put(records: Records) -> Callable[..., None]:
    """Keep one motor's record: figures by parameter, each with its limits."""
    kept = 0

    def save(
        batch: str = "B1",
        model: str = "LG-400W",
        serial: str = "",
        limits: tuple[float, float] = (9.0, 11.0),
        error: bool = False,
        person: str = "Wang",
        **values: float,
    ) -> None:
        nonlocal kept
        kept += 1
        low, high = limits
        verdicts = {
            name: Verdict.ERROR if math.isnan(v) else Verdict.PASS if low <= v <= high else Verdict.FAIL
            for name, v in values.items()
        }
        verdict = Verdict.ERROR if error else Verdict.FAIL if Verdict.FAIL in verdicts.values() else Verdict.PASS
        measured = tuple(MeasuredFigure(n, v, "Ω", 0.01, 0.02, low, high, verdicts[n]) for n, v in values.items())
        records.save(
            motor_record(
                kept,
                batch=batch,
                person=person,
                model=model,
                serial_number=serial or f"P-{kept:04d}",
                started=NOON + timedelta(minutes=kept),
                ended=NOON + timedelta(minutes=kept, seconds=3),
                verdict=verdict,
                first_pass=verdict is Verdict.PASS,
                bench_time=1.0,
                measured=measured,
                checks=(CheckRecord("r", 1, verdict, 1.0), CheckRecord("r", 2, verdict, 1.0)),
            )
        )

    return save
