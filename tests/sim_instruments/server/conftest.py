from collections.abc import Iterator

import pytest

from sim_instruments.server.served_bench import ServedBench
from tests.sim_instruments.motors import BENCH_MOTOR


@pytest.fixture(scope="module")
def bench() -> Iterator[ServedBench]:
    with ServedBench(BENCH_MOTOR, speedup=50.0, seed=1, pages={"/motor": {"truth": {"pole_pairs": 4.0}}}) as served:
        yield served
