import pytest

from sim_instruments.six_step.drive import SixStepDrive
from sim_instruments.six_step.state import Bridge
from tests.sim_instruments.motors import SIX_STEP


@pytest.fixture(scope="session")
def example() -> SixStepDrive:
    """The document's 92BL-30-25L."""
    return SIX_STEP


@pytest.fixture(scope="session")
def bridge(example: SixStepDrive) -> Bridge:
    return Bridge(example)
