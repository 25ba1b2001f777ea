"""A virtual bench of faultless instruments, and the real drivers in front of it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import pytest

from bench.journal.waveforms import StoredRecord
from bench.safety.station_instruments import StationInstruments
from bench.station.visa_library import StationVisa
from bench.virtual.virtual_station import virtual_station
from procedures.core.bench import Role
from procedures.core.nameplate import Nameplate, WindingConnection
from sim_instruments.bench import BenchSetting, VirtualBench
from sim_instruments.disturbances.bench import Disturbances
from sim_instruments.instruments.errors import (
    DynamometerErrors,
    Errors,
    LcrErrors,
    ScopeErrors,
    SupplyErrors,
    VoltmeterErrors,
)
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.world.machine_data import Leads
from tests.sim_instruments.motors import BENCH_MOTOR

NONE = (0.0, 0.0, 0.0, 0.0)
FAULTLESS = Errors(
    supply=SupplyErrors(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    lcr_meter=LcrErrors(0.0, 0.0, 0.0, 0.0),
    oscilloscope=ScopeErrors(NONE, NONE, 0.0),
    dynamometer=DynamometerErrors(0.0, 0.0, 0.0),
    voltmeter=VoltmeterErrors((0.0,) * 5, (0.0,) * 5),
)
PLATE = Nameplate(
    name="bench",
    connection=WindingConnection.WYE,
    rated_current=10.0,
    maximum_current=10.0,
    rated_speed_rpm=3000.0,
    maximum_speed_rpm=6000.0,
    rated_voltage=48.0,
)


class Nothing:
    """A journal and a store that keep nothing."""

    def record(self, event: Any) -> None:
        """Let it go."""

    def store(self, name: str, waveforms: Any) -> StoredRecord:
        """Let it go."""
        return StoredRecord(name, "", 0)


@dataclass
class Stand:
    """A bench and its drivers."""

    bench: VirtualBench
    instruments: StationInstruments

    @property
    def world(self) -> Any:
        return self.bench.world

    def driver(self, role: Role) -> Any:
        return self.instruments.get(role)

    def sleep(self, seconds: float) -> None:
        self.bench.clock.sleep(seconds)


Make = Callable[..., Stand]


@pytest.fixture
def stand() -> Iterator[Make]:
    opened: list[Stand] = []

    def make(disturbances: Disturbances | None = None, motor: VirtualMotor = BENCH_MOTOR) -> Stand:
        setting = BenchSetting(leads=Leads(0.0, 0.0, 0.0), disturbances=disturbances or Disturbances())
        virtual = VirtualBench(motor, seed=3, errors=FAULTLESS, setting=setting, sockets=False)
        nothing = Nothing()
        instruments = StationInstruments(
            virtual_station(virtual.addresses()),
            PLATE,
            virtual.clock,
            nothing,
            nothing,
            StationVisa(virtual.visa_library),
            lambda _: None,
            in_process=virtual,
        )
        opened.append(Stand(virtual, instruments))
        return opened[-1]

    yield make
    for one in opened:
        one.instruments.close()
        one.bench.close()
