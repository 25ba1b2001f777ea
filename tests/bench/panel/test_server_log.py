"""A browser that leaves before it is answered is no fault of the panel; anything else is."""

import logging
from collections.abc import Iterator

import pytest

from bench.panel.server_log import quieten_server


@pytest.fixture
def log() -> Iterator[logging.Logger]:
    server = logging.getLogger("uvicorn.error")
    level, filters = server.level, server.filters[:]
    quieten_server()
    yield server
    server.setLevel(level)
    server.filters[:] = filters


def test_a_browser_that_left_is_not_logged(log: logging.Logger, caplog: pytest.LogCaptureFixture) -> None:
    log.error("Exception in ASGI application\n", exc_info=RuntimeError("No response returned."))
    assert caplog.records == []


@pytest.mark.parametrize("fault", [RuntimeError("no event loop"), ValueError("No response returned.")])
def test_a_fault_is_logged(log: logging.Logger, caplog: pytest.LogCaptureFixture, fault: Exception) -> None:
    log.error("Exception in ASGI application\n", exc_info=fault)
    assert [record.exc_info[1] for record in caplog.records if record.exc_info] == [fault]
