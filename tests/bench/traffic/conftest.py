"""One session with every instrument."""

import pytest

from bench.traffic.traffic_file import Recording
from tests.bench.traffic.sessions import everything, recorded


@pytest.fixture(scope="session")
def recording() -> Recording:
    return recorded(everything)
