"""Statistics over a million motors: `pytest tests/benchmarks/test_eol_statistics.py --benchmark-enable -n 0` (filling takes minutes)."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from bench.eol.line_statistics import StatisticsRequest, line_statistics
from bench.eol.store.database import open_database
from bench.eol.yields import GROUPINGS, Grouping
from tests.bench.eol.postgresql import own_database
from tests.benchmarks.line_records import AGAIN, PARAMETERS, fill

MOTORS = 1_000_000


@pytest.fixture(scope="module")
def server(postgresql: str) -> Iterator[str]:
    with own_database(postgresql) as address:
        yield address


@pytest.fixture(scope="module", params=["sqlite", "postgresql"])
def filled(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> str:
    """A database with the records; a few where nothing is timed, for the test itself."""
    reference = (
        str(Path(tmp_path_factory.mktemp("records")) / "records.sqlite")
        if request.param == "sqlite"
        else str(request.getfixturevalue("server"))
    )
    fill(reference, _motors(request.config))
    return reference


def _motors(config: pytest.Config) -> int:
    return MOTORS if config.getoption("benchmark_enable") else 2_000


@pytest.mark.parametrize(
    ("golden", "by"),
    [((), ()), (("P-00000101", "P-00000201"), ()), ((), GROUPINGS)],
    ids=["all", "without golden motors", "by every occasion"],
)
def test_every_parameter(
    benchmark, filled: str, golden: tuple[str, ...], by: tuple[Grouping, ...], request: pytest.FixtureRequest
) -> None:
    engine = open_database(filled)
    found = benchmark.pedantic(line_statistics, (engine, StatisticsRequest(golden=golden, by=by)), rounds=3)
    engine.dispose()
    count = _motors(request.config) - len(golden)
    benchmark.extra_info["motors"] = count
    assert found.selection.count == count
    assert {name: each.distribution.count for name, each in found.parameters.items()} == dict.fromkeys(
        (name for name, *_ in PARAMETERS), count
    )
    motors = found.yields.motors
    assert motors.final.count == count - _motors(request.config) // AGAIN
    assert {sum(group.final.count for group in groups) for groups in motors.groups.values()} <= {motors.final.count}
