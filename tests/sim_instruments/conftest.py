from collections.abc import Callable, Iterator

import pytest
import pyvisa

from sim_instruments.bench import VirtualBench
from sim_instruments.physics.motor.motor import VirtualMotor
from tests.sim_instruments.motors import BENCH_MOTOR


@pytest.fixture
def bench_motor() -> VirtualMotor:
    return BENCH_MOTOR


@pytest.fixture
def virtual_bench(bench_motor: VirtualMotor) -> Iterator[VirtualBench]:
    with VirtualBench(bench_motor, seed=1) as bench:
        yield bench


@pytest.fixture
def visa(virtual_bench: VirtualBench) -> Callable[[str], pyvisa.resources.MessageBasedResource]:
    """Open a VISA session to a role; the bench closes it."""
    manager = pyvisa.ResourceManager(virtual_bench.visa_library)

    def open_role(role: str) -> pyvisa.resources.MessageBasedResource:
        return manager.open_resource(virtual_bench.address(role), read_termination="\n", write_termination="\n")

    return open_role
