"""A virtual C2000 that nobody speaks to any more: what it does by parameters 09-02 and 09-03, over Modbus TCP."""

import time
from collections.abc import Iterator

import pytest
from pymodbus.client import ModbusTcpClient

from sim_instruments.bench import VirtualBench
from sim_instruments.physics.motor.motor import VirtualMotor

TREATMENT, TIME_OUT, COMMAND, FREQUENCY, RESET, STATUS = 0x0902, 0x0903, 0x2000, 0x2001, 0x2002, 0x2100
FORWARD = 0b01_00_10
#: Whatever comes, comes within this time (s), however busy the machine.
PATIENCE = 30.0


@pytest.fixture
def bench(bench_motor: VirtualMotor) -> Iterator[VirtualBench]:
    with VirtualBench(bench_motor, seed=1) as opened:
        opened.world.couple_dynamometer()
        yield opened


@pytest.fixture
def client(bench: VirtualBench) -> Iterator[ModbusTcpClient]:
    host, port = str(bench.address("dynamometer")).removeprefix("tcp://").split(":")
    made = ModbusTcpClient(host, port=int(port), timeout=1.0, retries=0)
    assert made.connect()
    yield made
    made.close()


def write(client: ModbusTcpClient, address: int, value: int) -> None:
    assert not client.write_register(address, value, device_id=1).isError()


def running(client: ModbusTcpClient, treatment: int, tenths: int = 3) -> None:
    write(client, TREATMENT, treatment)
    write(client, TIME_OUT, tenths)
    write(client, FREQUENCY, 1000)
    write(client, COMMAND, FORWARD)


def status(client: ModbusTcpClient) -> tuple[int, int]:
    """Return warning and fault, then the state bits."""
    response = client.read_holding_registers(STATUS, count=2, device_id=1)
    return response.registers[0], response.registers[1] & 0b11


def silent_until_off(bench: VirtualBench) -> float:
    """Say nothing until the machine is off; return how long (s) that takes."""
    begun = time.monotonic()
    while bench.world.dynamometer.enabled:
        assert time.monotonic() - begun < PATIENCE
        bench.clock.sleep(0.01)
    return time.monotonic() - begun


def test_it_coasts_and_says_why(bench: VirtualBench, client: ModbusTcpClient) -> None:
    running(client, 2)
    assert bench.world.dynamometer.enabled
    assert silent_until_off(bench) > 0.2
    assert status(client) == (5 << 8, 0)
    write(client, RESET, 0b10)
    assert status(client) == (0, 0)


def test_it_starts_again_when_it_is_told_to(bench: VirtualBench, client: ModbusTcpClient) -> None:
    running(client, 2)
    silent_until_off(bench)
    write(client, COMMAND, FORWARD)
    assert status(client) == (0, 0b11)


def test_every_message_starts_the_time_anew_even_one_that_is_refused(
    bench: VirtualBench, client: ModbusTcpClient
) -> None:
    # Long against what a busy machine may keep a message waiting.
    running(client, 2, tenths=15)
    begun = time.monotonic()
    while time.monotonic() - begun < 2.0:
        assert client.read_holding_registers(0x7777, count=1, device_id=1).isError()
        time.sleep(0.03)  # noqa: TID251  the silence that is watched is the wall's
    assert bench.world.dynamometer.enabled


def test_it_ramps_down(bench: VirtualBench, client: ModbusTcpClient) -> None:
    running(client, 1)
    begun = time.monotonic()
    while (found := bench.world.truth()["dynamometer_enabled"]) and time.monotonic() - begun < 0.6:
        bench.clock.sleep(0.01)
    assert found
    assert status(client)[0] == 5 << 8
    assert status(client)[1] in (0b00, 0b01)


@pytest.mark.parametrize(("treatment", "warning"), [(0, 5 << 8), (3, 0)])
def test_it_goes_on_where_it_is_set_to(
    bench: VirtualBench, client: ModbusTcpClient, treatment: int, warning: int
) -> None:
    running(client, treatment)
    time.sleep(0.6)  # noqa: TID251  the silence that is watched is the wall's
    assert status(client) == (warning, 0b11)


def test_times_and_treatments_that_there_are_not_are_refused(client: ModbusTcpClient) -> None:
    for address, value in ((TREATMENT, 4), (TIME_OUT, 1001)):
        response = client.write_register(address, value, device_id=1)
        assert response.isError()
        assert response.exception_code == 3
