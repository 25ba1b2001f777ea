"""The virtual coupler with a relay, over Modbus TCP: who feeds its watchdog, what it does without, and what it refuses."""

import threading
import time
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
    client: ModbusTcpClient, contact: Contact, kind: int, stays: bool
) -> None:
    armed(client, 400, kind)
    begun = time.monotonic()
    while time.monotonic() - begun < 1.2 and not contact.opened.is_set():
        client.read_coils(0, count=1, device_id=1)
        contact.opened.wait(0.03)
    assert contact.opened.is_set() is not stays


def test_registers_neither_feed_nor_change_while_it_runs(client: ModbusTcpClient, contact: Contact) -> None:
    armed(client, 600)
    assert client.write_register(TIME, 60_000, device_id=1).exception_code == 4
    assert 0 < read(client, LEFT) <= 600
    begun = time.monotonic()
    while not contact.opened.wait(0.03):
        assert time.monotonic() - begun < PATIENCE
        read(client, STATUS)


def test_fed_it_stays_and_no_time_is_no_watch(client: ModbusTcpClient, contact: Contact) -> None:
    armed(client, 500)
    for _ in range(12):
        assert not contact.opened.wait(0.1)
        assert not client.write_coil(0, True, device_id=1).isError()
    reset(client)
    assert not client.write_register(TIME, 0, device_id=1).isError()
    assert not client.write_coil(0, True, device_id=1).isError()
    assert not contact.opened.wait(0.7)
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
