"""A browser that leaves before it is answered is no fault of the panel; anything else is."""

import logging
from collections.abc import Iterator

import pytest

from bench.panel.server.server_log import quieten_server


@pytest.fixture
def log() -> Iterator[logging.Logger]:
    server = logging.getLogger("uvicorn.error")
    level, filters = server.level, server.filters[:]
    quieten_server()
    yield server
    server.setLevel(level)
    server.filters[:] = filters


@pytest.mark.parametrize(
    ("fault", "logged"),
    [
        (RuntimeError("No response returned."), False),
        (RuntimeError("no event loop"), True),
        (ValueError("No response returned."), True),
    ],
)
def test_only_faults_are_logged(log: logging.Logger, fault: Exception, logged: bool) -> None:
    told = (type(fault), fault, None)
    record = log.makeRecord(log.name, logging.ERROR, __file__, 1, "Exception in ASGI application\n", (), told)
    assert bool(log.filter(record)) is logged
