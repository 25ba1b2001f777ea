"""A process that has one instrument energise the motor by its driver, says so, and waits to be killed: nobody guards it."""

import sys
from contextlib import AbstractContextManager, ExitStack
from pathlib import Path
from typing import Any

from bench.station.clock import SystemClock
from bench.station.station_file import load_station
from drivers.catalogue import Surroundings
from drivers.transport.can.buses import CanBuses
from procedures.core.bench import Role


def hold_driver(station: str, role: str) -> None:
    """Run in a process that was forked for it."""
    entry = load_station(Path(station)).entries[Role(role)]
    given = Surroundings(SystemClock(), _no_visa, can_buses=CanBuses())
    instrument: Any = entry.driver.open(entry.address, entry.options, given)
    with ExitStack() as on:
        on.enter_context(_energised(instrument, entry.role))
        print(instrument.watchdog.time, flush=True)
        sys.stdin.readline()


def _energised(instrument: Any, role: Role) -> AbstractContextManager[None]:
    if role is Role.DRIVE:
        return instrument.running()
    if role is Role.INVERTER:
        return instrument.driving_current(1.0)
    if role is Role.DYNAMOMETER:
        return instrument.driving_speed(30.0)
    held = ExitStack()
    instrument.turn(2.0)
    held.callback(instrument.stop)
    return held


def _no_visa() -> Any:
    raise AssertionError("none of these is reached by VISA")
