from collections.abc import Callable, Iterator

import pytest
import pyvisa

from sim_instruments.bench import VirtualBench
from sim_instruments.physics.motor import VirtualMotor


@pytest.fixture
def bench_motor() -> VirtualMotor:
    return VirtualMotor(
        connection="wye",
        phase_resistances=(0.5, 0.5, 0.5),
        d_axis_inductance=1.0e-3,
        q_axis_inductance=1.5e-3,
        flux_linkage=0.02,
        pole_pairs=4,
        inertia=1.0e-4,
        coulomb_friction=0.01,
        viscous_friction=1.0e-5,
    )


@pytest.fixture
def virtual_bench(bench_motor: VirtualMotor) -> Iterator[VirtualBench]:
    with VirtualBench(bench_motor, seed=1, ambient_temperature=25.0) as bench:
        yield bench


@pytest.fixture
def visa(virtual_bench: VirtualBench) -> Callable[[str], pyvisa.resources.MessageBasedResource]:
    """Open a VISA session to a role; the bench closes it."""
    manager = pyvisa.ResourceManager(virtual_bench.visa_library)

    def open_role(role: str) -> pyvisa.resources.MessageBasedResource:
        return manager.open_resource(virtual_bench.address(role), read_termination="\n", write_termination="\n")

    return open_role
