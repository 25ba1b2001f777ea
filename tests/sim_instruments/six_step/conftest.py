import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

from sim_instruments.six_step.drive import SixStepDrive
from sim_instruments.six_step.state import Bridge


@pytest.fixture(scope="session")
def reference() -> ModuleType:
    """The independent simulation beside these tests."""
    spec = importlib.util.spec_from_file_location("six_step_reference", Path(__file__).parent / "reference.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def example() -> SixStepDrive:
    """The document's 92BL-30-25L."""
    return SixStepDrive(
        connection="delta",
        resistance=0.1146,
        self_inductance=0.412e-3,
        mutual_inductance=-0.0233e-3,
        emf_constant=0.0613,
        pole_pairs=4,
        source_voltage=24.32,
        source_resistance=0.124,
        switch_resistance=0.03,
        diode_drop=0.7,
        inertia=1.17e-4,
        coulomb_friction=0.0349,
        viscous_friction=7.941e-6,
    )


@pytest.fixture(scope="session")
def bridge(example: SixStepDrive) -> Bridge:
    return Bridge(example)
