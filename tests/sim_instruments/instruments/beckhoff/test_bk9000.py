"""The virtual coupler with a relay, over Modbus TCP: who feeds its watchdog, what it does without, and what it refuses."""

import threading
from collections.abc import Iterator

import numpy as np
import pytest
from pymodbus.client import ModbusTcpClient

from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.instruments.beckhoff.bk9000 import Bk9000
from sim_instruments.transports.modbus.tcp import ModbusTcpEndpoint
from sim_instruments.transports.modbus.unit import ModbusLine

STATUS, LEFT, TIME, RESET, TYPE = 0x100C, 0x1020, 0x1120, 0x1121, 0x1122
PATIENCE = 30.0


class Clock:
    """The coupler's clock (s), which stands still until the test moves it on: a busy machine starves no watchdog."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


class Contact:
    def __init__(self) -> None:
        self.moves: list[bool] = []
        self.opened = threading.Event()

    def move(self, closed: bool) -> None:
        self.moves.append(closed)
        if not closed:
            self.opened.set()


@pytest.fixture
def contact() -> Contact:
    return Contact()


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    for module in ("beckhoff.bk9000", "silence"):
        monkeypatch.setattr(f"sim_instruments.instruments.{module}.monotonic", made)
    return made


@pytest.fixture
def client(contact: Contact) -> Iterator[ModbusTcpClient]:
    coupler = Bk9000(contact.move)
    endpoint = ModbusTcpEndpoint(ModbusLine((coupler,), VirtualClock(), np.random.default_rng(0)))
    host, port = endpoint.address.removeprefix("tcp://").split(":")
    made = ModbusTcpClient(host, port=int(port), timeout=2.0, retries=0)
    assert made.connect()
    yield made
    made.close()
    endpoint.close()
    coupler.close()
    coupler.close()


def read(client: ModbusTcpClient, address: int) -> int:
    response = client.read_holding_registers(address, count=1, device_id=1)
    assert not response.isError(), response
    return int(response.registers[0])


def armed(client: ModbusTcpClient, milliseconds: int, kind: int = 0) -> None:
    for address, value in ((TYPE, kind), (TIME, milliseconds)):
        assert not client.write_register(address, value, device_id=1).isError()
    assert not client.write_coil(0, True, device_id=1).isError()


def reset(client: ModbusTcpClient) -> None:
    for word in (0xBECF, 0xAFFE):
        assert not client.write_register(RESET, word, device_id=1).isError()


def test_without_food_it_opens_latches_and_is_reset_by_two_words(client: ModbusTcpClient, contact: Contact) -> None:
    armed(client, 200)
    assert read(client, STATUS) == 0
    assert contact.opened.wait(PATIENCE)
    assert contact.moves == [True, False]
    assert read(client, STATUS) == 0x8000
    assert client.write_coil(0, True, device_id=1).exception_code == 4
    assert client.read_coils(0, count=1, device_id=1).exception_code == 4
    client.write_register(RESET, 0xAFFE, device_id=1)
    assert read(client, STATUS) == 0x8000
    reset(client)
    assert read(client, STATUS) == 0
    assert client.read_coils(0, count=2, device_id=1).bits[:2] == [False, False]


@pytest.mark.parametrize(("kind", "stays"), [(0, False), (1, True)])
def test_who_reads_feeds_only_where_reading_counts(
    client: ModbusTcpClient, contact: Contact, clock: Clock, kind: int, stays: bool
) -> None:
    armed(client, 200, kind)
    for _ in range(3):
        clock.now += 0.15
        client.read_coils(0, count=1, device_id=1)
    # It looks again within the time that it was set.
    assert contact.opened.wait(0.3 if stays else PATIENCE) is not stays


def test_registers_neither_feed_nor_change_while_it_runs(
    client: ModbusTcpClient, contact: Contact, clock: Clock
) -> None:
    armed(client, 200)
    assert client.write_register(TIME, 60_000, device_id=1).exception_code == 4
    assert read(client, LEFT) == 200
    clock.now += 0.15
    assert read(client, LEFT) == 50
    clock.now += 0.06
    assert contact.opened.wait(PATIENCE)


def test_fed_it_stays_and_no_time_is_no_watch(client: ModbusTcpClient, contact: Contact, clock: Clock) -> None:
    armed(client, 200)
    for _ in range(6):
        clock.now += 0.15
        assert not contact.opened.wait(0.05)
        assert not client.write_coil(0, True, device_id=1).isError()
    reset(client)
    assert not client.write_register(TIME, 0, device_id=1).isError()
    assert not client.write_coil(0, True, device_id=1).isError()
    clock.now += 10.0
    assert not contact.opened.wait(0.3)
    assert contact.moves == [True]


@pytest.mark.parametrize(
    ("request_", "code"),
    [
        (lambda client: client.write_coil(2, True, device_id=1), 2),
        (lambda client: client.read_coils(1, count=2, device_id=1), 2),
        (lambda client: client.write_register(TYPE, 7, device_id=1), 3),
        (lambda client: client.write_register(STATUS, 1, device_id=1), 2),
        (lambda client: client.read_holding_registers(0x2000, count=1, device_id=1), 2),
    ],
)
def test_what_it_refuses(client: ModbusTcpClient, request_: object, code: int) -> None:
    response = request_(client)  # type: ignore[operator]
    assert response.exception_code == code
