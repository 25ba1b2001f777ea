import importlib.util
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from sim_instruments.physics.motor import VirtualMotor
from sim_instruments.served_bench import ServedBench


@pytest.fixture(scope="session")
def wires() -> ModuleType:
    """The clients beside these tests."""
    spec = importlib.util.spec_from_file_location("served_wires", Path(__file__).parent / "wires.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def served_motor() -> VirtualMotor:
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


@pytest.fixture(scope="module")
def bench(served_motor: VirtualMotor) -> Iterator[ServedBench]:
    with ServedBench(served_motor, speedup=50.0, seed=1, pages={"/motor": {"truth": {"pole_pairs": 4.0}}}) as served:
        yield served
