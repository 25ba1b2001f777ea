"""Dynamometer on Modbus: bytes on the wire, registers, settling, limits and what it reports."""

import math
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.catalogue import Surroundings
from drivers.delta.c2000 import frequency_register
from drivers.delta.dynamometer import DeltaDyn200
from drivers.delta.options import DeltaDyn200Options
from drivers.interfaces import Accuracy, CommunicationError, MeasurementError, ReportedError, SetpointError
from tests.drivers.modbus.units import OPTIONS, RPM, TcpServer, Units


def test_bytes_of_one_measurement(dynamometer: DeltaDyn200, units: Units, server: TcpServer, clock: Any) -> None:
    units.set_32(0x00, -12345)
    units.set_speed(1500.25)
    units.set_32(0x04, 1939)
    server.requests.clear()
    clock.time = 4.0
    reading = dynamometer.measure()
    # One block of six registers, and nothing else: the sensor tells no direction.
    assert [request[6:] for request in server.requests] == ["00 00 00 06 02 03 00 00 00 06"]
    assert reading.torque == -1.2345
    assert reading.speed == pytest.approx(1500.25 * RPM)
    assert reading.power == pytest.approx(-193.95, rel=1e-3)
    assert reading.speed_accuracy.source.endswith("direction not known")
    assert reading.time == 4.0
    assert reading.torque_accuracy.offset == pytest.approx(0.005)
    assert "typical of its class" in reading.torque_accuracy.source
    assert reading.torque_accuracy.resolution == pytest.approx(1e-4)
    assert reading.speed_accuracy.resolution == pytest.approx(0.01 * RPM)


def test_the_sign_of_the_speed_is_that_of_the_command_until_the_shaft_is_let_go(
    dynamometer: DeltaDyn200, units: Units
) -> None:
    units.set_32(0x12, 0)
    with dynamometer.driving_speed(-62.83):
        assert dynamometer.measure().speed == pytest.approx(-62.83, rel=1e-3)
    units.set_speed(300.0)
    coasting = dynamometer.measure()
    assert coasting.speed == pytest.approx(-300 * RPM)
    assert "not known" not in coasting.speed_accuracy.source


def test_a_shaft_at_rest_turns_the_way_it_is_pushed(dynamometer: DeltaDyn200, units: Units) -> None:
    with dynamometer.driving_torque(-1.0):
        units.set_speed(60.0)
        assert dynamometer.measure().speed == pytest.approx(-60 * RPM)
    # A brake on a shaft that turns already does not reverse it.
    with dynamometer.driving_torque(1.0):
        assert dynamometer.measure().speed == pytest.approx(-60 * RPM)


def test_bytes_of_a_driving_block(dynamometer: DeltaDyn200, units: Units, server: TcpServer) -> None:
    units.registers[1, 0x000A] = 2
    server.requests.clear()
    with dynamometer.driving_speed(-100.0):
        assert units.command == 0x22
    writes = [request[18:] for request in server.requests if request[18:23] == "01 06"]
    # 100 rad/s with two pole pairs is 31.83 Hz = 3183 = 0x0C6F.
    assert writes == [
        "01 06 00 16 00 01",
        "01 06 00 0a 00 00",
        "01 06 20 01 0c 6f",
        "01 06 20 00 00 22",
        "01 06 20 00 00 01",
    ]
    assert units.command == 0x01


def test_bytes_of_a_constant_torque(dynamometer: DeltaDyn200, units: Units) -> None:
    with dynamometer.driving_torque(-1.25):
        assert units.registers[1, 0x0B22] == 0xFF06  # −250 per mille of 5 N·m
        assert units.registers[1, 0x000A] == 2
        assert units.command == 0x12
    assert units.command == 0x01
    assert units.registers[1, 0x0B22] == 0


def test_speed_changes_within_the_block(dynamometer: DeltaDyn200, units: Units) -> None:
    with dynamometer.driving_speed(50.0):
        dynamometer.set_speed(-80.0)
        assert dynamometer.measure().speed == pytest.approx(-80.0, rel=1e-3)


def test_slip_within_the_tolerance_is_settled(dynamometer: DeltaDyn200, units: Units) -> None:
    units.slip = 0.96
    with dynamometer.driving_speed(100.0):
        assert dynamometer.measure().speed == pytest.approx(96.0, rel=1e-3)


def test_a_speed_that_does_not_settle_ends_disabled(dynamometer: DeltaDyn200, units: Units, clock: Any) -> None:
    units.slip = 0.5
    with (
        pytest.raises(MeasurementError, match=r"50 rad/s 2 s after 100 rad/s was commanded"),
        dynamometer.driving_speed(100.0),
    ):
        pass
    assert units.command == 0x01
    assert clock.now() == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize(
    ("way", "value", "message"),
    [
        ("driving_speed", 201.0, "speed = 201 rad/s is outside -200 … 200 rad/s, the limit of the station"),
        ("driving_speed", math.nan, "speed = nan"),
        ("driving_torque", -5.5, "torque = -5.5 N·m is outside -5 … 5 N·m, the limit of the model"),
    ],
)
def test_limits(dynamometer: DeltaDyn200, units: Units, way: str, value: float, message: str) -> None:
    with pytest.raises(SetpointError, match=message), getattr(dynamometer, way)(value):
        pass
    assert units.writes == []


def test_a_fault_of_the_drive_is_named(dynamometer: DeltaDyn200, units: Units) -> None:
    units.registers[1, 0x2100] = 0x0015
    with pytest.raises(ReportedError, match="the drive is in fault 21"), dynamometer.driving_speed(10.0):
        pass


def test_an_exception_names_register_and_meaning(dynamometer: DeltaDyn200, units: Units) -> None:
    units.refuse[1, 0x2001] = 3
    with (
        pytest.raises(
            ReportedError, match=r"2001H of unit 1 \(frequency command\)'.*3 \(illegal data value\) at 2001H"
        ),
        dynamometer.driving_speed(10.0),
    ):
        pass
    assert units.command == 0x01


@pytest.mark.parametrize("code", [10, 11])
def test_a_gateways_unit_that_is_not_there(units: Units, server: TcpServer, clock: Any, code: int) -> None:
    units.refuse[2, 0x08] = code
    with pytest.raises(CommunicationError, match="unit 2 does not answer"):
        DeltaDyn200.open(server.address, OPTIONS, Surroundings(clock), "dynamometer")


def test_decimals_that_cannot_be(units: Units, server: TcpServer, clock: Any) -> None:
    units.registers[2, 0x09] = 9
    with pytest.raises(CommunicationError, match=r"torque decimals = 9 is outside 0 … 6.*DYN-200"):
        DeltaDyn200.open(server.address, OPTIONS, Surroundings(clock), "dynamometer")


@given(st.floats(-1000, 1000), st.integers(1, 6))
def test_frequency_command_is_within_half_a_step(speed: float, pole_pairs: int) -> None:
    frequency = frequency_register(speed, pole_pairs) * 0.01
    assert abs(frequency - abs(speed) * pole_pairs / (2 * math.pi)) <= 0.0050001


def test_options_replace_accuracy_and_direction(server: TcpServer, units: Units, clock: Any) -> None:
    accuracy = Accuracy(gain=2e-3, source="certificate")
    options = DeltaDyn200Options(
        maximum_speed=200.0,
        speed_filter=0.02,
        torque_filter=0.05,
        torque_accuracy=accuracy,
        speed_accuracy=accuracy,
        direction_from="command",
        watchdog_time=0.0,
    )
    dynamometer = DeltaDyn200.open(server.address, options, Surroundings(clock), "dynamometer")
    with dynamometer.driving_speed(-20.0):
        reading = dynamometer.measure()
        assert (reading.speed_filter, reading.torque_filter) == (0.02, 0.05)
    assert reading.speed == pytest.approx(-20.0, rel=1e-2)
    # No statement makes the last digit finer than it is sent.
    for found, count in ((reading.torque_accuracy, 1e-4), (reading.speed_accuracy, 0.02 * math.pi / 60.0)):
        assert found.resolution == pytest.approx(count)
        assert replace(found, resolution=0.0) == accuracy
    dynamometer.close()


@pytest.mark.parametrize(("decimals", "resolution"), [(2, 0.01), (4, 5e-4)])
def test_a_stated_step_that_is_finer_than_the_display_s_does_not_count(
    server: TcpServer, units: Units, clock: Any, decimals: int, resolution: float
) -> None:
    units.set_32(0x08, decimals)
    stated = Accuracy(offset=1e-3, resolution=5e-4, source="certificate")
    options = replace(OPTIONS, torque_accuracy=stated)
    dynamometer = DeltaDyn200.open(server.address, options, Surroundings(clock), "dynamometer")
    found = dynamometer.measure().torque_accuracy
    assert found.resolution == pytest.approx(resolution)
    assert replace(found, resolution=stated.resolution) == stated
    dynamometer.close()


def test_a_held_speed_whose_reading_ripples_is_settled(dynamometer: DeltaDyn200, units: Units) -> None:
    # A sensor out of centre: five times what readings may be apart.
    units.ripple = 0.01
    with dynamometer.driving_speed(100.0):
        assert dynamometer.measure().speed == pytest.approx(100.0, rel=0.011)
    assert units.command == 0x01


def test_a_speed_between_two_steps_of_a_coarse_sensor_says_so(dynamometer: DeltaDyn200, units: Units) -> None:
    units.ripple = 0.5
    with (
        pytest.raises(
            MeasurementError,
            match=r"in steps of 4\.32\d rad/s.*10 rad/s is not told from 5\.66\d to 14\.3.*more pulses a turn",
        ),
        dynamometer.driving_speed(10.0),
    ):
        pytest.fail("settled between two steps")
    assert units.command == 0x01
