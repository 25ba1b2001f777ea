"""The drive's watch over its master, and a second process that holds the line for the shutdown only."""

import threading
from typing import Any

import pytest

from drivers.catalogue import Surroundings
from drivers.delta.dynamometer import DeltaDyn200
from drivers.delta.options import DeltaDyn200Options
from drivers.interfaces import ReportedError, SetpointError, Watchdog, WhenSilent
from tests.drivers.modbus.units import TcpServer, Units

WATCHED = {"maximum_speed": 300.0, "watchdog_time": 0.5}


def test_the_drive_watches_over_its_master(units: Units, server: TcpServer, clock: Any) -> None:
    units.registers |= {(1, 0x0902): 3, (1, 0x0903): 0, (1, 0x2101): 0}
    made = DeltaDyn200.open(server.address, DeltaDyn200Options(**WATCHED), Surroundings(clock), "dynamometer")
    assert units.writes == [(1, 0x0902, [2]), (1, 0x0903, [5])]
    fed = threading.Event()
    server.garble = lambda reply: fed.set() or reply if server.requests[-1].endswith("03 21 01 00 01") else reply
    with made.driving_speed(50.0):
        # Nobody asks anything here, and the drive is asked nevertheless.
        assert fed.wait(10.0)
    made.close()
    assert units.writes[-2:] == [(1, 0x0903, [0]), (1, 0x0902, [3])]
    before = len(units.writes)
    made.close()
    assert len(units.writes) == before


def test_parameters_that_are_so_already_are_not_written(units: Units, server: TcpServer, clock: Any) -> None:
    units.registers |= {(1, 0x0902): 2, (1, 0x0903): 5, (1, 0x2101): 0}
    made = DeltaDyn200.open(server.address, DeltaDyn200Options(**WATCHED), Surroundings(clock), "dynamometer")
    made.close()
    assert units.writes == []


def test_a_drive_without_such_a_watch_is_told_of(units: Units, server: TcpServer, clock: Any) -> None:
    with pytest.raises(ReportedError, match=r"0902H.*a drive without it has no watchdog: watchdog_time = 0"):
        DeltaDyn200.open(server.address, DeltaDyn200Options(**WATCHED), Surroundings(clock), "dynamometer")
    with pytest.raises(SetpointError, match=r"watchdog_time = 0.1 s is outside 0.5 … 100 s"):
        DeltaDyn200.open(
            server.address,
            DeltaDyn200Options(maximum_speed=300.0, watchdog_time=0.1),
            Surroundings(clock),
            "dynamometer",
        )


def test_a_guarding_process_asks_nothing_before_it_must_act(units: Units, server: TcpServer, clock: Any) -> None:
    units.registers[1, 0x2100] = 49
    options = DeltaDyn200Options(**WATCHED)
    made = DeltaDyn200.open(server.address, options, Surroundings(clock, guarding=True), "dynamometer")
    assert server.requests == []
    made.command_zero()
    made.make_safe()
    assert units.command == 0x01
    assert made.measure().speed == 0.0
    made.close()


def test_what_is_armed_is_told(units: Units, server: TcpServer, clock: Any) -> None:
    units.registers |= {(1, 0x0902): 2, (1, 0x0903): 0}
    made = DeltaDyn200.open(server.address, DeltaDyn200Options(**WATCHED), Surroundings(clock), "dynamometer")
    assert made.watchdog == Watchdog(0.5, WhenSilent.COAST, "09-02, 09-03")
    made.close()
    assert made.watchdog is None
    assert DeltaDyn200Options(maximum_speed=1.0).watchdog == Watchdog(2.0, WhenSilent.COAST, "09-02, 09-03")
    assert DeltaDyn200Options(maximum_speed=1.0, watchdog_time=0.0).watchdog is None


def test_a_drive_that_does_not_keep_what_is_written_is_refused_and_left_as_it_was(
    units: Units, server: TcpServer, clock: Any
) -> None:
    units.registers |= {(1, 0x0902): 3, (1, 0x0903): 0}
    units.keeps[1, 0x0903] = 0
    with pytest.raises(
        ReportedError, match=r"09-03 communication time-out is 0 after 5 was written.*watchdog_time = 0"
    ):
        DeltaDyn200.open(server.address, DeltaDyn200Options(**WATCHED), Surroundings(clock), "dynamometer")
    assert units.registers[1, 0x0902] == 3
