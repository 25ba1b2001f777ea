import math
import threading
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import serial
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ModbusException

from sim_instruments.bench import VirtualBench
from sim_instruments.faults.line_faults import Fault
from sim_instruments.instruments.delta.c2000 import DeltaDrive
from sim_instruments.instruments.delta.dyn200 import Dyn200
from sim_instruments.instruments.errors import DynamometerErrors
from sim_instruments.instruments.registers import RegisterError, double_word
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.transports.modbus.rtu import ModbusRtuEndpoint
from sim_instruments.transports.modbus.unit import ModbusLine

Client = ModbusTcpClient | ModbusSerialClient
POLE_PAIRS = 2
#: Whatever comes, comes within this time (s), however busy the machine.
PATIENCE = 60.0
#: What a master leaves the line silent for (s) before each request.
SILENCE = 0.015


class SilentFirst(ModbusSerialClient):
    """Leaves the line silent before each request, as the C2000's manual demands."""

    bench: VirtualBench

    def execute(self, *given: Any, **named: Any) -> Any:
        self.bench.clock.sleep(SILENCE)
        return super().execute(*given, **named)


@pytest.fixture(params=["tcp", "rtu"])
def bench(request: pytest.FixtureRequest, bench_motor: VirtualMotor) -> Iterator[VirtualBench]:
    with VirtualBench(bench_motor, seed=1, line=request.param) as opened:
        opened.world.couple_dynamometer()
        yield opened


@pytest.fixture
def client(bench: VirtualBench) -> Iterator[Client]:
    scheme, rest = str(bench.address("dynamometer")).split("://")
    made: Client
    if scheme == "tcp":
        host, port = rest.split(":")
        made = ModbusTcpClient(host, port=int(port), timeout=0.3, retries=0)
    else:
        made = SilentFirst(rest, baudrate=9600, timeout=0.3, retries=0)
        made.bench = bench
    assert made.connect()
    yield made
    made.close()


def read(client: Client, unit: int, address: int, count: int = 1) -> list[int]:
    response = client.read_holding_registers(address, count=count, device_id=unit)
    assert not response.isError(), response
    return list(response.registers)


def torque_speed_power(client: Client) -> tuple[float, float, float]:
    registers = read(client, 2, 0x00, 6)
    torque, speed_rpm, power = client.convert_from_registers(registers, client.DATATYPE.INT32)
    return torque / 1e4, speed_rpm / 1e2, power / 10.0


def test_speed_mode(client: Client, bench: VirtualBench) -> None:
    client.write_register(0x000A, 0, device_id=1)
    client.write_register(0x2001, 3333, device_id=1)
    client.write_register(0x2000, 0b01_0010, device_id=1)
    bench.clock.sleep(3.0)
    assert read(client, 1, 0x2102) == [3333]
    assert read(client, 1, 0x2103)[0] == pytest.approx(3333, abs=2)
    assert read(client, 1, 0x2101)[0] & 0b11 == 0b11
    torque, speed_rpm, power = torque_speed_power(client)
    assert speed_rpm == pytest.approx(60.0 * 33.33 / POLE_PAIRS, rel=2e-3)
    assert torque == pytest.approx(0.02, abs=0.02)
    assert power == pytest.approx(torque * speed_rpm * math.pi / 30.0, abs=0.06)
    assert read(client, 2, 0x12, 2) == [0, 0]
    client.write_register(0x2000, 0b10_0010, device_id=1)
    bench.clock.sleep(3.0)
    assert read(client, 2, 0x12, 2) == [0, 0]
    assert torque_speed_power(client)[1] > 0.0
    assert bench.world.truth()["shaft_speed"] < 0.0
    client.write_register(0x2000, 0b01, device_id=1)
    bench.clock.sleep(5.0)
    assert read(client, 1, 0x2101)[0] & 0b11 == 0
    assert bench.world.truth()["dynamometer_enabled"] is False


def test_torque_mode_accelerates(client: Client, bench: VirtualBench) -> None:
    client.write_registers(0x000A, [2], device_id=1)
    client.write_registers(0x0B22, [(-40) & 0xFFFF], device_id=1)
    client.write_register(0x2000, 0b01_0010, device_id=1)
    bench.clock.sleep(0.1)
    assert torque_speed_power(client)[0] == pytest.approx(-0.2, abs=5e-3)
    assert torque_speed_power(client)[2] > 0.0
    client.write_register(0x2000, 0b01, device_id=1)
    assert bench.world.truth()["dynamometer_enabled"] is False


def test_coasting_stop(client: Client, bench: VirtualBench) -> None:
    client.write_register(0x0016, 1, device_id=1)
    client.write_register(0x2001, 2000, device_id=1)
    client.write_register(0x2000, 0b01_0010, device_id=1)
    bench.clock.sleep(2.0)
    client.write_register(0x2000, 0b01, device_id=1)
    assert bench.world.truth()["dynamometer_enabled"] is False
    assert bench.world.truth()["shaft_speed"] > 10.0


def test_external_fault_and_reset(client: Client, bench: VirtualBench) -> None:
    client.write_register(0x2001, 2000, device_id=1)
    client.write_register(0x2000, 0b01_0010, device_id=1)
    client.write_register(0x2002, 0b01, device_id=1)
    assert read(client, 1, 0x2100) == [49]
    assert bench.world.truth()["dynamometer_enabled"] is False
    client.write_register(0x2000, 0b01_0010, device_id=1)
    assert bench.world.truth()["dynamometer_enabled"] is False
    client.write_register(0x2002, 0b10, device_id=1)
    client.write_register(0x2000, 0b01_0010, device_id=1)
    assert read(client, 1, 0x2100) == [0]
    assert bench.world.truth()["dynamometer_enabled"] is True


def test_zeroing_the_torque(client: Client) -> None:
    before = [torque_speed_power(client)[0] for _ in range(20)]
    assert sum(before) / 20 == pytest.approx(5e-4, abs=2e-4)
    client.write_coil(0x00, True, device_id=2)
    after = [torque_speed_power(client)[0] for _ in range(20)]
    assert sum(after) / 20 == pytest.approx(0.0, abs=4e-4)
    assert client.write_registers(0x00, [0, 5], device_id=2).exception_code == 3


def test_exceptions(client: Client) -> None:
    assert client.read_holding_registers(0x3000, count=1, device_id=1).exception_code == 2
    assert client.write_register(0x2103, 1, device_id=1).exception_code == 2
    assert client.write_register(0x000A, 9, device_id=1).exception_code == 3
    assert client.read_holding_registers(0x22, count=4, device_id=2).exception_code == 2
    assert read(client, 1, 0x000A) == [0]


def test_requests_take_virtual_time(client: Client, bench: VirtualBench) -> None:
    before = bench.clock.now()
    read(client, 2, 0x00, 6)
    taken = bench.clock.now() - before
    # 8 characters of request, 17 of reply, two gaps of 3.5, eleven bits each at 9600 baud, 5 ms of turnaround, and the silence before.
    expected = 2e-3 if isinstance(client, ModbusTcpClient) else 32 * 11 / 9600 + 5e-3 + SILENCE
    assert taken == pytest.approx(expected)


def test_faults_of_the_line(client: Client, bench: VirtualBench) -> None:
    bench.faults("dynamometer").add(Fault.on("silence", "read 2 0000H"))
    with pytest.raises(ModbusException):
        client.read_holding_registers(0x00, count=6, device_id=2)
    assert len(read(client, 2, 0x00, 6)) == 6
    bench.faults("dynamometer").clear()
    bench.faults("dynamometer").add(Fault.on("half", "read 1 2103H"))
    with pytest.raises(ModbusException):
        client.read_holding_registers(0x2103, count=1, device_id=1)
    before = bench.clock.now()
    bench.faults("dynamometer").clear()
    bench.faults("dynamometer").add(Fault.on("late", "read", delay=1.5))
    client.close()
    assert client.connect()
    read(client, 1, 0x2103)
    assert bench.clock.now() - before == pytest.approx(1.5, abs=0.1)


def test_frames_on_the_serial_line(bench_motor: VirtualMotor) -> None:
    with VirtualBench(bench_motor, line="rtu") as bench:
        path = str(bench.address("dynamometer")).removeprefix("rtu://")
        with serial.Serial(path, 9600, timeout=PATIENCE) as port:
            # Read one register at 000AH of unit 1; the checksum is sent low byte first.
            port.write(bytes.fromhex("01 03 00 0A 00 01 A4 08"))
            assert port.read(7) == bytes.fromhex("01 03 02 00 00 B8 44")
            bench.clock.sleep(0.015)
            port.write(bytes.fromhex("01 06 00 16 00 01 A9 CE"))
            assert port.read(8) == bytes.fromhex("01 06 00 16 00 01 A9 CE")
            port.write(bytes.fromhex("02 03 00 08 00 02 45 FA"))
            assert port.read(9) == bytes.fromhex("02 03 04 00 00 00 04 C8 F0")
            port.timeout = 0.5
            for silent in ("07 03 00 0A 00 01 A4 6E", "01 03 00 0A 00 01 00 00", "01 03 00"):
                port.write(bytes.fromhex(silent))
                assert port.read(1) == b""
            assert asked_again(port, "01 03 00 16 00 01 65 CE", 7) == bytes.fromhex("01 03 02 00 01 79 84")


def test_a_request_right_after_another_units_reply_is_not_heard_by_the_drive(
    bench_motor: VirtualMotor, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [0.0]
    monkeypatch.setattr(ModbusRtuEndpoint, "_times", lambda _: (now[0], now[0]))
    sensor, shown = bytes.fromhex("02 03 00 08 00 02 45 FA"), bytes.fromhex("02 03 04 00 00 00 04 C8 F0")
    drive, mode = bytes.fromhex("01 03 00 0A 00 01 A4 08"), bytes.fromhex("01 03 02 00 00 B8 44")
    with VirtualBench(bench_motor, line="rtu") as bench:
        path = str(bench.address("dynamometer")).removeprefix("rtu://")
        with serial.Serial(path, 9600, timeout=PATIENCE) as port:
            for gap, heard in ((0.009, False), (0.010, False), (0.011, True)):
                port.write(sensor)
                assert port.read(9) == shown
                now[0] += gap
                port.write(drive)
                if heard:
                    assert port.read(7) == mode
                # The sensor needs no more than what ends a frame, and answers after what the drive has not heard.
                port.timeout = 0.3
                assert heard or port.read(1) == b""
                port.timeout = PATIENCE


def asked_again(port: serial.Serial, request: str, length: int) -> bytes:
    """Ask until there is an answer, as a master does: on a busy machine half a frame and the next request are read as one."""
    begun = time.monotonic()
    while not (told := port.read(length)):
        assert time.monotonic() - begun < PATIENCE, "no answer"
        port.write(bytes.fromhex(request))
    return told


def test_nothing_is_left_running(bench_motor: VirtualMotor) -> None:
    before = set(threading.enumerate())
    for line in ("tcp", "rtu"):
        with VirtualBench(bench_motor, line=line) as bench:  # type: ignore[arg-type]
            bench.addresses()
            assert set(threading.enumerate()) != before
        assert set(threading.enumerate()) == before
        bench.close()


def test_registers_without_a_line(virtual_bench: VirtualBench) -> None:
    world = virtual_bench.world
    drive = DeltaDrive(world)
    drive.write(0x0100, [6000])
    drive.write(0x2001, [9000])
    assert drive.read(0x2100, 3)[2] == 6000
    with pytest.raises(RegisterError, match="000BH"):
        drive.write(0x000B, [1])
    transducer = Dyn200(world, np.random.default_rng(0), DynamometerErrors(0.0, -0.25, 0.0))
    assert transducer.read(0x00, 2)[0] == 0xFFFF
    assert transducer.read(0x08, 2) == [0, 4]
    assert transducer.read(0x20, 2) == [0, 2]
    transducer.write(0x06, [0, 10])
    assert transducer.read(0x06, 2) == [0, 10]
    with pytest.raises(RegisterError):
        transducer.write(0x06, [0, 100])
    with pytest.raises(RegisterError):
        transducer.write(0x08, [1])
    assert double_word(-2) == [0xFFFF, 0xFFFE]
    with pytest.raises(ValueError, match="share"):
        ModbusLine((drive, DeltaDrive(world)), virtual_bench.clock, np.random.default_rng(0))
