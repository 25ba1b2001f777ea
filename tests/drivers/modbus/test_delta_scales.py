"""DYN-200: what its registers are worth is settled against the shaft itself, and its zero is read back."""

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.catalogue import Surroundings
from drivers.delta.dyn200 import ShaftReading
from drivers.delta.dynamometer import DeltaDyn200
from drivers.delta.transducer_scales import POWER_STEPS, PowerScale
from drivers.interfaces import CommunicationError, InstrumentError, MeasurementError, ReportedError
from tests.drivers.modbus.units import OPTIONS, RPM, TcpServer, Units


def opened(server: TcpServer, clock: Any, **options: Any) -> DeltaDyn200:
    return DeltaDyn200.open(server.address, replace(OPTIONS, **options), Surroundings(clock), "dynamometer")


def loaded(units: Units, torque: float, rpm: float, counts: int) -> None:
    """Four decimals of torque."""
    units.set_32(0x00, round(torque * 1e4))
    units.set_speed(rpm)
    units.set_32(0x04, counts)


@pytest.mark.parametrize("step", POWER_STEPS)
def test_the_scale_of_the_power_is_found_from_torque_and_speed(
    server: TcpServer, units: Units, clock: Any, step: float
) -> None:
    dynamometer = opened(server, clock)
    # 2 N·m at 1500 rpm are 314.16 W.
    loaded(units, 2.0, 1500.0, round(320.0 / step))
    powers = [dynamometer.measure().power for _ in range(3)]
    assert powers[:2] == pytest.approx([314.16] * 2, rel=1e-4)
    assert powers[2] == pytest.approx(320.0)
    # A load too small to judge by is read on the scale found.
    loaded(units, 0.002, 1500.0, 7)
    assert dynamometer.measure().power == pytest.approx(7 * step)
    dynamometer.close()


def measured(dynamometer: DeltaDyn200, times: int = 3) -> None:
    for _ in range(times):
        dynamometer.measure()


def test_a_power_that_contradicts_the_stated_scale_is_refused(server: TcpServer, units: Units, clock: Any) -> None:
    dynamometer = opened(server, clock, power_step=0.1)
    loaded(units, 2.0, 1500.0, 314)
    dynamometer.measure()
    dynamometer.measure()
    with pytest.raises(
        MeasurementError,
        match=r"04H.*shows 314 counts, while 2 N·m at 1500 rpm make 314.2 W.*Set power_step = 1 in the station file",
    ):
        dynamometer.measure()
    dynamometer.close()


def test_a_power_that_fits_no_scale_accuses_the_decimals(server: TcpServer, units: Units, clock: Any) -> None:
    dynamometer = opened(server, clock)
    loaded(units, 2.0, 1500.0, 100_000)
    with pytest.raises(MeasurementError, match=r"its decimals \(08H, 20H\)"):
        measured(dynamometer)
    dynamometer.close()


@given(torque=st.floats(-5, 5), speed=st.floats(0, 600), step=st.sampled_from(POWER_STEPS), wanted=st.booleans())
def test_no_honest_sensor_is_refused(torque: float, speed: float, step: float, wanted: bool) -> None:
    scale = PowerScale("dynamometer", step if wanted else None)
    shown = ShaftReading(torque, speed, round(torque * speed / step))
    for _ in range(4):
        watts = scale.watts(shown)
    assert watts == pytest.approx(abs(torque) * speed, abs=0.51 * step)


def test_a_passing_contradiction_is_none(server: TcpServer, units: Units, clock: Any) -> None:
    dynamometer = opened(server, clock, power_step=0.1)
    for counts in (3142, 31, 31, 3142, 31):
        loaded(units, 2.0, 1500.0, counts)
        dynamometer.measure()
    dynamometer.close()


@pytest.mark.parametrize(("speed", "shown", "driven"), [(100.0, r"95\.49", r"954\.9"), (8.0, r"7\.6", r"76\.5")])
def test_a_speed_that_contradicts_the_drive_names_the_decimals(
    server: TcpServer, units: Units, clock: Any, speed: float, shown: str, driven: str
) -> None:
    units.speed_decimals = 1  # the register says two
    dynamometer = opened(server, clock)
    with (
        pytest.raises(
            MeasurementError,
            match=rf"02H.*shows {shown}.* rpm with 2 decimals.*\(2103H\) makes {driven} rpm.*Set speed_decimals = 1 in",
        ),
        dynamometer.driving_speed(speed),
    ):
        pass
    assert units.command == 0x01
    dynamometer.close()
    stated = opened(server, clock, speed_decimals=1)
    with stated.driving_speed(speed):
        assert stated.measure().speed == pytest.approx(speed, rel=2e-3)
    stated.close()


def test_in_torque_control_the_speed_is_compared_too(server: TcpServer, units: Units, clock: Any) -> None:
    dynamometer = opened(server, clock, speed_decimals=3)
    with dynamometer.driving_torque(1.0):
        units.set_speed(1500.0)
        units.registers[1, 0x2103] = 5000  # 50 Hz at two pole pairs
        with pytest.raises(MeasurementError, match="Set speed_decimals = 2"):
            measured(dynamometer)
        units.registers[1, 0x2103] = 0
    assert units.command == 0x01
    dynamometer.close()


@pytest.mark.parametrize(("decimals", "speed"), [(3, 1500.0), (4, 100.0)])
def test_in_torque_control_no_reading_of_a_power_of_ten_too_little_is_given(
    server: TcpServer, units: Units, clock: Any, decimals: int, speed: float
) -> None:
    dynamometer = opened(server, clock, speed_decimals=decimals)
    with dynamometer.driving_torque(1.0):
        units.set_speed(speed)
        units.registers[1, 0x2103] = round(speed / 60.0 * 2 * 100)
        with pytest.raises(MeasurementError, match="Set speed_decimals = 2"):
            dynamometer.measure()
        units.registers[1, 0x2103] = 0
    dynamometer.close()


def test_in_torque_control_a_slow_shaft_whose_slip_is_most_of_its_frequency_is_read(
    server: TcpServer, units: Units, clock: Any
) -> None:
    dynamometer = opened(server, clock)
    with dynamometer.driving_torque(1.0):
        units.set_speed(6.0)
        units.registers[1, 0x2103] = 200  # 2 Hz, 60 rpm
        assert [dynamometer.measure().speed for _ in range(5)] == pytest.approx(5 * [6.0 * RPM])
        units.registers[1, 0x2103] = 0
    dynamometer.close()


def test_a_sensor_without_a_register_of_speed_decimals_shows_tenths(
    server: TcpServer, units: Units, clock: Any
) -> None:
    units.refuse[2, 0x20] = 2
    units.speed_decimals = 1
    dynamometer = opened(server, clock)
    with dynamometer.driving_speed(100.0):
        assert dynamometer.measure().speed == pytest.approx(100.0, rel=1e-2)
    dynamometer.close()


def test_the_sign_of_power_and_torque_where_the_station_says_so(server: TcpServer, units: Units, clock: Any) -> None:
    dynamometer = opened(server, clock, direction_from="power")
    for torque, counts, sign in ((2.0, 3142, 1), (2.0, -3142, -1), (-2.0, -3142, 1), (-2.0, 3142, -1)):
        loaded(units, torque, 1500.0, counts)
        reading = dynamometer.measure()
        assert reading.speed == pytest.approx(sign * 1500 * RPM)
        assert reading.power == pytest.approx(reading.torque * reading.speed, rel=1e-2)
    dynamometer.close()


def test_zero_by_the_coil(server: TcpServer, units: Units, clock: Any) -> None:
    dynamometer = opened(server, clock)
    units.set_32(0x00, 1234)
    server.requests.clear()
    dynamometer.zero_torque()
    assert [request[18:] for request in server.requests] == [
        "02 03 00 00 00 06",
        "02 05 00 00 ff 00",
        "02 03 00 00 00 06",
    ]
    assert dynamometer.measure().torque == 0.0
    units.set_speed(100.0)
    with pytest.raises(MeasurementError, match="the shaft turns"):
        dynamometer.zero_torque()
    dynamometer.close()


def test_zero_by_the_register_where_the_coil_does_nothing(server: TcpServer, units: Units, clock: Any) -> None:
    dynamometer = opened(server, clock)
    units.set_32(0x00, 1234)
    units.zeroes = False
    dynamometer.zero_torque()
    assert [request[18:] for request in server.requests if "02 10" in request] == ["02 10 00 00 00 02 04 00 00 00 01"]
    assert "subtraction" not in dynamometer.measure().torque_accuracy.source
    dynamometer.close()


def test_a_sensor_that_takes_no_zero_is_tared_here_and_says_so(server: TcpServer, units: Units, clock: Any) -> None:
    dynamometer = opened(server, clock)
    units.set_32(0x00, 1234)
    units.zeroes = False
    units.keeps = {(2, 0): 0, (2, 1): 1234}
    dynamometer.zero_torque()
    reading = dynamometer.measure()
    assert reading.torque == pytest.approx(0.0, abs=1e-9)
    assert reading.torque_accuracy.source.endswith("zeroed by subtraction here")
    # The register of the power knows nothing of it: 1.1234 N·m at 100 rad/s shown, 1 N·m on the shaft.
    loaded(units, 1.1234, 100.0 / RPM, 1123)
    for _ in range(3):
        reading = dynamometer.measure()
    assert reading.torque == pytest.approx(1.0)
    assert reading.power == pytest.approx(100.0, abs=0.1)
    dynamometer.close()


def test_an_inverted_torque_is_a_setting_and_must_be_the_stations(server: TcpServer, units: Units, clock: Any) -> None:
    units.set_32(0x12, 1)
    with pytest.raises(ReportedError, match=r"12H torque direction.*is set to 1, but 0 is needed.*parameter 12 to 0"):
        opened(server, clock)
    dynamometer = opened(server, clock, torque_inverted=True)
    dynamometer.close()
    assert units.writes == []


def test_a_sensor_that_does_not_answer_names_its_settings(server: TcpServer, units: Units, clock: Any) -> None:
    units.refuse[2, 0x08] = 11
    with pytest.raises(CommunicationError, match=r"09 must be 1 \(Modbus RTU\), 08 and 11 the rate and format"):
        opened(server, clock)


@pytest.mark.parametrize("hung", [1, 2])
def test_a_lost_reply_to_the_zero_is_an_error(server: TcpServer, units: Units, clock: Any, hung: int) -> None:
    dynamometer = opened(server, clock)
    server.hang_up_on = hung + 1
    with pytest.raises(InstrumentError):
        dynamometer.zero_torque()
    dynamometer.close()
