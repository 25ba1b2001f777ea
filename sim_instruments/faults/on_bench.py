"""Faults of the motor, its wiring and the machines round it."""

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from sim_instruments.faults.description import ActiveFault, Description
from sim_instruments.world.settings import Heating, Terminal
from sim_instruments.world.sources.stuck_output import Reports

if TYPE_CHECKING:
    from sim_instruments.faults.target import FaultTarget


class OpenPhase(Description):
    """Break the wire at a terminal; null mends it."""

    fault: Literal["open_phase"]
    terminal: Terminal | None

    def begin(self, bench: "FaultTarget") -> ActiveFault:
        """Do it."""
        bench.world.set_open_phase(self.terminal)
        return ActiveFault(lambda: bench.world.set_open_phase(None))


class Swapped(Description):
    """Two wires with exchanged labels; null puts them right."""

    fault: Literal["swapped"]
    pair: Annotated[list[Terminal], Field(min_length=2, max_length=2, description="two terminals")] | None

    def check(self, bench: "FaultTarget") -> None:
        """Raise ValueError for one terminal given twice."""
        super().check(bench)
        if self.pair is not None and self.pair[0] == self.pair[1]:
            raise ValueError(f"swapped wires must be two different ones, not {self.pair[0]} twice")

    def begin(self, bench: "FaultTarget") -> ActiveFault:
        """Do it."""
        bench.world.set_swapped(None if self.pair is None else (self.pair[0], self.pair[1]))
        return ActiveFault(lambda: bench.world.set_swapped(None))


class StuckRotor(Description):
    """Jam the rotor, or free it."""

    fault: Literal["stuck_rotor"]
    stuck: bool = True

    def begin(self, bench: "FaultTarget") -> ActiveFault:
        """Do it."""
        bench.world.set_stuck_rotor(self.stuck)
        return ActiveFault(lambda: bench.world.set_stuck_rotor(False))


class MotorUnplugged(Description):
    """Tear all of the motor's wires off."""

    fault: Literal["motor_unplugged"]

    def begin(self, bench: "FaultTarget") -> ActiveFault:
        """Do it."""
        bench.world.damage.unplug(True)
        return ActiveFault(lambda: bench.world.damage.unplug(False))


class StuckOutput(Description):
    """An output that stays on once it is, while its instrument reports it on or, wrongly, off."""

    fault: Literal["stuck_output"]
    role: str
    reports: Reports = "on"

    def check(self, bench: "FaultTarget") -> None:
        """Raise ValueError for a role without an output."""
        super().check(bench)
        bench.world.damage.check_output(self.role)

    def begin(self, bench: "FaultTarget") -> ActiveFault:
        """Do it."""
        bench.world.damage.stick(self.role, self.reports)
        return ActiveFault(lambda: bench.world.damage.stick(self.role, None))


class StuckRelay(Description):
    """Make a relay's contact stay closed or open independent of its coil; the switch unit does not detect it."""

    fault: Literal["stuck_relay"]
    crosspoint: str
    closed: bool = True

    def check(self, bench: "FaultTarget") -> None:
        """Raise ValueError for a crosspoint that there is not."""
        super().check(bench)
        bench.check_crosspoint(self.crosspoint)

    def begin(self, bench: "FaultTarget") -> ActiveFault:
        """Do it."""
        bench.stick_relay(self.crosspoint, self.closed)
        return ActiveFault(
            lambda: bench.stick_relay(self.crosspoint, None),
            # Nobody feels an open contact that nobody wants closed.
            lambda: self.closed or bench.relay_called(self.crosspoint),
        )


class CurrentLimited(Description):
    """A supply that gives no more than a current, so that it is in CC where CV is expected."""

    fault: Literal["current_limited"]
    current: Annotated[float, Field(gt=0.0, le=1e4, json_schema_extra={"unit": "A"})] = 0.05

    def begin(self, bench: "FaultTarget") -> ActiveFault:
        """Do it."""
        bench.world.damage.limit_supply(self.current)
        return ActiveFault(lambda: bench.world.damage.limit_supply(None))


class SpeedRunaway(Description):
    """Make dynamometer or inverter run away to a speed while it is on, independent of its commands."""

    fault: Literal["speed_runaway"]
    role: Literal["dynamometer", "inverter"]
    speed: Annotated[float, Field(gt=0.0, le=1e5, json_schema_extra={"unit": "rad/s"})] = 1e5

    def begin(self, bench: "FaultTarget") -> ActiveFault:
        """Do it."""
        damage = bench.world.damage
        run_away = damage.run_dynamometer_away if self.role == "dynamometer" else damage.run_inverter_away
        run_away(self.speed)
        return ActiveFault(lambda: run_away(None))


class ThermalRunaway(Description):
    """A winding that overheats by itself, towards a temperature as a first-order lag."""

    fault: Literal["thermal_runaway"]
    temperature: Annotated[float, Field(ge=-60.0, le=400.0, json_schema_extra={"unit": "°C"})] = 200.0
    time_constant: Annotated[float, Field(ge=0.1, le=1e5, json_schema_extra={"unit": "s"})] = 30.0

    def begin(self, bench: "FaultTarget") -> ActiveFault:
        """Do it."""
        bench.world.damage.overheat(Heating(self.temperature, self.time_constant))
        return ActiveFault(lambda: bench.world.damage.overheat(None))
