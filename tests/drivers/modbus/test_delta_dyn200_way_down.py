"""Dynamometer on Modbus: off at the end, whatever happened before."""

from typing import Any

import pytest

from drivers.catalogue import Surroundings
from drivers.delta.dynamometer import DeltaDyn200
from drivers.interfaces import CommunicationError, MeasurementError, ReportedError
from tests.drivers.modbus.units import OPTIONS, RPM, TcpServer, Units


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
@pytest.mark.parametrize("way", ["driving_speed", "driving_torque"])
def test_disabled_after_an_exception(
    dynamometer: DeltaDyn200, units: Units, way: str, error: type[BaseException]
) -> None:
    with pytest.raises(error), getattr(dynamometer, way)(2.0):
        raise error
    assert units.command == 0x01
    assert units.registers[1, 0x2103] == 0


def test_a_drive_that_does_not_stop_is_reported(dynamometer: DeltaDyn200, units: Units) -> None:
    with pytest.raises(ReportedError, match=r"still puts out 31\.83 Hz.*emergency"), dynamometer.driving_speed(100.0):
        units.stuck = True


def test_stop_brakes_waits_and_disables(dynamometer: DeltaDyn200, units: Units, clock: Any) -> None:
    units.set_speed(1000.0)
    units.stuck = True

    def slow_down() -> None:
        units.set_speed(max(0.0, dynamometer.measure().speed / RPM - 300.0))

    clock.on_sleep = slow_down
    dynamometer.stop()
    runs = [values for unit, address, values in units.writes if (unit, address) == (1, 0x2000)]
    assert runs == [[0x01], [0x12], [0x01]]
    assert clock.now() == pytest.approx(0.2)
    clock.on_sleep = None
    units.set_speed(1000.0)
    with pytest.raises(MeasurementError, match="still turns"):
        dynamometer.stop()
    assert units.command == 0x01


def test_make_safe(dynamometer: DeltaDyn200, units: Units) -> None:
    dynamometer.make_safe()
    assert units.command == 0x01
    assert units.registers[1, 0x0016] == 1


def test_command_zero_in_the_midst_of_anything(dynamometer: DeltaDyn200, units: Units, server: TcpServer) -> None:
    with dynamometer.driving_torque(2.0):
        before = len(server.requests)
        server.hang_up_on = 1
        dynamometer.command_zero()
        assert (units.registers[1, 0x0B22], units.registers[1, 0x2001]) == (0, 0)
        assert [request[18:] for request in server.requests[before + 1 :]] == [
            "01 06 0b 22 00 00",
            "01 06 20 01 00 00",
        ]


@pytest.mark.parametrize("broken", [1, 2])
def test_make_safe_outlives_broken_connections(
    dynamometer: DeltaDyn200, units: Units, server: TcpServer, clock: Any, broken: int
) -> None:
    with dynamometer.driving_speed(50.0):
        server.hang_up_on = broken
        dynamometer.make_safe()
        assert units.command == 0x01
    assert sum(clock.slept) < 0.3


def test_disabled_although_the_connection_breaks_at_the_end_of_a_block(
    dynamometer: DeltaDyn200, units: Units, server: TcpServer
) -> None:
    with dynamometer.driving_torque(1.0):
        server.hang_up_on = 1
    assert units.command == 0x01
    assert units.registers[1, 0x0B22] == 0


def test_make_safe_waits_no_longer_than_the_drive_takes(dynamometer: DeltaDyn200, units: Units, clock: Any) -> None:
    units.registers[1, 0x2103] = 3000
    units.stuck = True

    def coast() -> None:
        if clock.now() >= 0.1:
            units.registers[1, 0x2103] = 0

    clock.on_sleep = coast
    dynamometer.make_safe()
    assert 0.1 <= sum(clock.slept) < 0.13


def test_a_dynamometer_that_is_gone_is_reported(units: Units, clock: Any) -> None:
    server = TcpServer(units)
    dynamometer = DeltaDyn200.open(server.address, OPTIONS, Surroundings(clock), "dynamometer")
    server.close()
    with pytest.raises(CommunicationError, match="cannot be opened again"):
        dynamometer.make_safe()
    dynamometer.close()
