"""One session with every instrument."""

import pytest

from bench.traffic.traffic_file import SessionRecording
from tests.bench.traffic.sessions import everything, recorded


@pytest.fixture(scope="session")
def recording() -> SessionRecording:
    return recorded(everything)
