"""Motors and benches that the tests of the virtual bench's physics share."""

from collections.abc import Mapping
from typing import Any

import pytest

from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.world.machine_data import Leads, SupplyStage
from sim_instruments.world.world import World


class Lab:
    """Ready-made motors, an ideal supply, and the usual first steps."""

    #: Supply and leads without resistance of their own worth speaking of, for comparison with textbook values.
    ideal_supply = SupplyStage(maximum_voltage=60.0, maximum_current=100.0, output_resistance=0.0, slew=1e7)
    ideal_leads = Leads(0.0, 0.0, 0.0)
    series_parallel: Mapping[str, str] = {"A": "supply+", "B": "supply-", "C": "supply-"}

    @staticmethod
    def lg_400w(**changes: Any) -> VirtualMotor:
        values: dict[str, Any] = {
            "connection": "wye",
            "phase_resistances": (16.3e-3, 15.9e-3, 15.8e-3),
            "d_axis_inductance": 73e-6,
            "q_axis_inductance": 76.5e-6,
            "flux_linkage": 8.5e-3,
            "pole_pairs": 4,
            "inertia": 2.5e-5,
            "coulomb_friction": 0.02,
            "viscous_friction": 2e-5,
        }
        return VirtualMotor(**{**values, **changes})

    @staticmethod
    def outrunner(**changes: Any) -> VirtualMotor:
        values: dict[str, Any] = {
            "connection": "delta",
            "phase_resistances": (0.15, 0.16, 0.155),
            "d_axis_inductance": 60e-6,
            "q_axis_inductance": 70e-6,
            "flux_linkage": 5e-3,
            "pole_pairs": 7,
            "inertia": 1e-5,
            "coulomb_friction": 0.005,
            "viscous_friction": 1e-5,
        }
        return VirtualMotor(**{**values, **changes})

    @staticmethod
    def gimbal(**changes: Any) -> VirtualMotor:
        values: dict[str, Any] = {
            "connection": "wye",
            "phase_resistances": (5.0, 5.0, 5.0),
            "d_axis_inductance": 1.5e-3,
            "q_axis_inductance": 1.5e-3,
            "flux_linkage": 0.03,
            "pole_pairs": 11,
            "inertia": 5e-5,
            "coulomb_friction": 0.004,
        }
        return VirtualMotor(**{**values, **changes})

    def ideal_world(self, motor: VirtualMotor, **more: Any) -> tuple[World, VirtualClock]:
        clock = VirtualClock()
        return World(motor, clock, supply=self.ideal_supply, leads=self.ideal_leads, **more), clock

    @staticmethod
    def energise(world: World, voltage: float, current: float, wiring: Mapping[str, str]) -> None:
        world.connect(wiring)
        world.supply.set_voltage(voltage)
        world.supply.set_current_limit(current)
        world.supply.switch(True)


@pytest.fixture(scope="session")
def lab() -> Lab:
    return Lab()
