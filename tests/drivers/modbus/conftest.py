"""A dynamometer on Modbus."""

from collections.abc import Iterator
from typing import Any

import pytest

from drivers.catalogue import Surroundings
from drivers.delta.dynamometer import DeltaDyn200
from tests.drivers.modbus.units import OPTIONS, TcpServer, Units


@pytest.fixture
def units() -> Units:
    return Units()


@pytest.fixture
def server(units: Units) -> Iterator[TcpServer]:
    made = TcpServer(units)
    yield made
    made.close()


@pytest.fixture
def dynamometer(server: TcpServer, clock: Any) -> Iterator[DeltaDyn200]:
    made = DeltaDyn200.open(server.address, OPTIONS, Surroundings(clock), "dynamometer")
    yield made
    made.close()
    made.close()
