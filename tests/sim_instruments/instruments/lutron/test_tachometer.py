import math
from collections.abc import Iterator

import numpy as np
import pytest
import serial
from hypothesis import given
from hypothesis import strategies as st

from sim_instruments.bench import VirtualBench
from sim_instruments.faults.line_faults import Fault
from sim_instruments.instruments.errors import TachometerErrors
from sim_instruments.instruments.lutron.tachometer import LutronTachometer, frame


@pytest.fixture
def port(virtual_bench: VirtualBench) -> Iterator[serial.Serial]:
    with serial.Serial(str(virtual_bench.address("tachometer")), 9600, timeout=1.0) as opened:
        yield opened


def turn(bench: VirtualBench, speed_rpm: float) -> None:
    bench.world.turn_shaft(speed_rpm * math.pi / 30.0)
    bench.clock.sleep(2.0)


def value(data: bytes) -> float:
    assert (len(data), data[:3], data[-1:]) == (16, b"\x0241", b"\r")
    return (-1.0 if data[5:6] == b"1" else 1.0) * int(data[7:15]) / 10.0 ** int(data[6:7])


def test_frames_to_the_byte() -> None:
    assert frame(123.4, 1) == b"\x0241220100001234\r"
    assert frame(2500.0, 0) == b"\x0241220000002500\r"
    assert frame(-0.5, 2, "19") == b"\x0241191200000050\r"
    with pytest.raises(ValueError, match="does not fit"):
        frame(1e9, 0)


@given(st.floats(-9e4, 9e4), st.integers(0, 3))
def test_a_frame_carries_its_value(number: float, decimals: int) -> None:
    data = frame(number, decimals)
    assert value(data) == pytest.approx(number, abs=0.5001 * 10.0**-decimals)


def test_a_frame_a_second(virtual_bench: VirtualBench, port: serial.Serial) -> None:
    turn(virtual_bench, 456.7)
    port.reset_input_buffer()
    virtual_bench.clock.sleep(1.0)
    assert value(port.read(16)) == pytest.approx(456.7, abs=0.11)
    port.timeout = 0.05
    assert port.read(1) == b""
    virtual_bench.clock.sleep(0.9)
    assert port.read(1) == b""
    virtual_bench.clock.sleep(0.1)
    assert len(port.read(16)) == 16


def test_a_long_pause_brings_the_latest_frame_only(virtual_bench: VirtualBench, port: serial.Serial) -> None:
    turn(virtual_bench, 1500.0)
    port.reset_input_buffer()
    virtual_bench.clock.sleep(60.0)
    assert value(port.read(16)) == pytest.approx(1500.0, abs=1.0)
    port.timeout = 0.05
    assert port.read(1) == b""


def test_the_last_digit_falls_on_either_side(virtual_bench: VirtualBench) -> None:
    virtual_bench.world.turn_shaft(1500.4 * math.pi / 30.0)
    virtual_bench.clock.sleep(2.0)
    seen = {value(virtual_bench.instrument("tachometer").reading()) for _ in range(200)}
    assert seen == {1500.0, 1501.0}


def test_standing_still_and_turning_backwards(virtual_bench: VirtualBench, port: serial.Serial) -> None:
    virtual_bench.clock.sleep(1.0)
    assert port.read(16) == b"\x0241220100000000\r"
    turn(virtual_bench, -300.0)
    assert value(virtual_bench.instrument("tachometer").reading()) == pytest.approx(300.0, abs=0.11)


def test_errors_and_annunciator(virtual_bench: VirtualBench) -> None:
    unit = LutronTachometer(virtual_bench.world, np.random.default_rng(0), TachometerErrors(0.01), annunciator="19")
    turn(virtual_bench, 1000.0)
    assert unit.reading()[3:5] == b"19"
    assert value(unit.reading()) == pytest.approx(1010.0, abs=1.0)


def test_faults_of_the_stream(virtual_bench: VirtualBench, port: serial.Serial) -> None:
    faults = virtual_bench.faults("tachometer")
    faults.add(Fault.at("silence", 1))
    faults.add(Fault.at("half", 2))
    faults.add(Fault.at("garbage", 3))
    port.timeout = 0.05
    virtual_bench.clock.sleep(1.0)
    assert port.read(16) == b""
    virtual_bench.clock.sleep(1.0)
    assert len(port.read(16)) == 8
    virtual_bench.clock.sleep(1.0)
    assert min(port.read(16)) >= 0x80
    virtual_bench.clock.sleep(1.0)
    assert len(port.read(16)) == 16


def test_a_line_that_nobody_reads_blocks_nobody(virtual_bench: VirtualBench) -> None:
    virtual_bench.address("tachometer")
    for _ in range(2000):
        virtual_bench.clock.sleep(1.0)
    assert virtual_bench.clock.now() == 2000.0
