"""A C2000 as its last user left it: parameters that decide what a command does, set, given back, and verified again."""

from dataclasses import replace
from typing import Any

import pytest

from drivers.catalogue import Surroundings
from drivers.delta.dynamometer import DeltaDyn200
from drivers.interfaces import ReportedError
from tests.drivers.modbus.units import OPTIONS, TcpServer, Units

#: 09-30, 00-20, 00-21, 11-27, 11-33, 11-36, 11-37, 11-38: what they are left at, and what they are set to.
PARAMETERS = {
    0x091E: (1, 0),
    0x0014: (0, 1),
    0x0015: (0, 2),
    0x0B1B: (200, 100),
    0x0B21: (0, 1),
    0x0B24: (0, 1),
    0x0B25: (10, 100),
    0x0B26: (10, 100),
}
KEYPAD = {(1, address): left for address, (left, _) in PARAMETERS.items()}
OURS = [(1, address, [wanted]) for address, (_, wanted) in PARAMETERS.items()]


def opened(server: TcpServer, clock: Any, **options: Any) -> DeltaDyn200:
    return DeltaDyn200.open(server.address, replace(OPTIONS, **options), Surroundings(clock), "dynamometer")


def test_a_drive_in_keypad_mode_is_taken_over_and_given_back(server: TcpServer, units: Units, clock: Any) -> None:
    units.registers |= KEYPAD
    dynamometer = opened(server, clock)
    assert units.writes == OURS
    told = {setting.query[:5]: setting for setting in dynamometer.found_state}
    assert (told["00-20"].found, told["00-20"].wanted, told["00-20"].changed) == ("0", "1", True)
    assert (told["00-00"].found, told["00-00"].wanted) == ("5", "")
    dynamometer.close()
    assert units.writes[len(OURS) :] == [(*key, [left]) for key, left in reversed(KEYPAD.items())]
    dynamometer.close()
    assert len(units.writes) == 2 * len(OURS)


def test_the_framing_is_told_where_the_drive_tells_it(server: TcpServer, units: Units, clock: Any) -> None:
    units.registers |= {(1, 0x0900): 1, (1, 0x0901): 192, (1, 0x0904): 13}
    dynamometer = opened(server, clock)
    told = {setting.query[:5]: setting.found for setting in dynamometer.found_state}
    assert (told["09-00"], told["09-01"], told["09-04"]) == ("1", "192", "13")
    dynamometer.close()
    assert units.writes == []


def test_settings_that_are_right_are_not_written(server: TcpServer, units: Units, clock: Any) -> None:
    units.registers[1, 0x0B24] = 2
    opened(server, clock).close()
    assert units.writes == []


def test_a_locked_parameter_is_refused_and_the_others_given_back(server: TcpServer, units: Units, clock: Any) -> None:
    units.registers |= KEYPAD
    units.keeps[1, 0x0B24] = 0
    with pytest.raises(
        ReportedError, match=r"11-36.*is set to 0, but 1 or 2 is needed: the frequency command does not"
    ):
        opened(server, clock)
    assert all(units.registers[key] == value for key, value in KEYPAD.items())


def test_torque_control_is_verified_before_it_is_trusted(server: TcpServer, units: Units, clock: Any) -> None:
    dynamometer = opened(server, clock)
    units.registers[1, 0x0B21] = 2
    with pytest.raises(ReportedError, match=r"11-33.*is set to 2, but 1 is needed"), dynamometer.driving_torque(1.0):
        pass
    assert units.command != 0x12
    dynamometer.close()


def test_a_drive_without_00_21_goes_without_and_one_without_00_20_is_refused(
    server: TcpServer, units: Units, clock: Any
) -> None:
    units.refuse[1, 0x0015] = 2
    opened(server, clock).close()
    units.refuse[1, 0x0014] = 2
    with pytest.raises(ReportedError, match="00-20"):
        opened(server, clock)


def test_another_drive_is_refused_by_its_code(server: TcpServer, units: Units, clock: Any) -> None:
    with pytest.raises(ReportedError, match=r"00-00 identity code.*is set to 5, but 9 is needed.*drive_code"):
        opened(server, clock, drive_code=9)
    opened(server, clock, drive_code=5).close()


def test_filters_of_the_transducer_are_shortened_and_given_back(server: TcpServer, units: Units, clock: Any) -> None:
    units.set_32(0x06, 50)
    units.set_32(0x1E, 20)
    server.requests.clear()
    dynamometer = opened(server, clock)
    # FC16 of two registers, high word first.
    assert [request[18:] for request in server.requests if request[18:23] == "02 10"] == [
        "02 10 00 06 00 02 04 00 00 00 01",
        "02 10 00 1e 00 02 04 00 00 00 01",
    ]
    told = {setting.query[:3]: setting for setting in dynamometer.found_state}
    assert (told["06H"].found, told["06H"].wanted, told["06H"].changed) == ("50", "1", True)
    dynamometer.close()
    assert units.writes[2:] == [(2, 0x1E, [0, 20]), (2, 0x06, [0, 50])]


def test_a_filter_whose_time_constant_is_stated_stays_as_it_is(server: TcpServer, units: Units, clock: Any) -> None:
    units.set_32(0x06, 50)
    units.set_32(0x1E, 20)
    opened(server, clock, torque_filter=0.2, speed_filter=0.1).close()
    assert units.writes == []


def test_a_transducer_without_a_register_for_the_speeds_filter_goes_without(
    server: TcpServer, units: Units, clock: Any
) -> None:
    units.refuse[2, 0x1E] = 2
    opened(server, clock).close()
    assert units.writes == []


def test_a_filter_that_does_not_stay_is_refused_by_name(server: TcpServer, units: Units, clock: Any) -> None:
    units.set_32(0x06, 50)
    units.keeps[2, 0x07] = 50
    with pytest.raises(
        ReportedError, match=r"06H.*is set to 50, but 1 or 0 or 2 is needed: the torque reading lags behind.*02"
    ):
        opened(server, clock)


def test_a_second_process_that_guards_asks_and_sets_nothing(server: TcpServer, units: Units, clock: Any) -> None:
    units.registers |= KEYPAD
    guard = DeltaDyn200.open(server.address, OPTIONS, Surroundings(clock, guarding=True), "dynamometer")
    assert server.requests == []
    guard.close()
    assert units.writes == []
