"""Two stations of one name on one server."""

from collections.abc import Callable, Iterator
from datetime import timedelta
from pathlib import Path

import pytest
from sqlalchemy import Engine

from bench.eol.store.database import open_database
from bench.eol.store.namesakes import namesake
from bench.eol.store.records import Records
from tests.bench.eol.motor_records import NOON, motor_record


@pytest.fixture
def own(tmp_path: Path) -> Iterator[Engine]:
    opened = open_database(str(tmp_path / "own.sqlite"))
    yield opened
    opened.dispose()


@pytest.fixture
def tested(own: Engine, engine: Engine) -> Callable[..., None]:
    """Keep a motor's test on the server, and of the station itself in its own database too."""

    def keep(serial: str, hours: float, *, here: bool, station: str = "S") -> None:
        began = NOON + timedelta(hours=hours)
        record = motor_record(
            identifier=f"{serial:>036}",
            serial_number=serial,
            station=station,
            started=began,
            ended=began,
            run=f"/runs/{serial}",
        )
        Records(engine).save(record)
        if here:
            Records(own).save(record)

    return keep


def test_a_test_of_another_station_is_found_by_what_the_own_records_lack(
    own: Engine, engine: Engine, tested: Callable[..., None]
) -> None:
    def asked():
        return namesake(own, "S", lambda question: question(engine))

    tested("OLD", -5.0, here=False)
    assert asked() is None, "a new station knows nothing of its name"
    tested("MINE", 0.0, here=True)
    tested("OTHER", 1.0, here=False, station="T")
    assert asked() is None, "what is older it may have put away, and another name is another station"
    tested("THEIRS", 2.0, here=False)
    tested("MINE-2", 3.0, here=True)
    found = asked()
    assert found is not None
    assert (found.serial_number, found.run) == ("THEIRS", "/runs/THEIRS")
    assert found.started == NOON + timedelta(hours=2.0)


def test_a_server_that_does_not_answer_tells_nothing(own: Engine, tested: Callable[..., None]) -> None:
    tested("MINE", 0.0, here=True)
    assert namesake(own, "S", lambda _question: None) is None
