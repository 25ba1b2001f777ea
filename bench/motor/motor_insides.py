"""The part of every virtual motor's table besides its figures: insulation, Hall sensors, and internal defects."""

import math
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from bench.files.toml_file import Section
from bench.motor.motor_sections import number
from drivers.interfaces.text import text
from sim_instruments.physics.motor.hall import SimulatedHallSensors

Sensor = Annotated[int, Field(ge=1, le=3, strict=True)]
Placement = Annotated[float, Field(ge=-math.pi, le=math.pi, strict=True)]
TerminalName = Literal["A", "B", "C"]


class HallSection(Section):
    """`[virtual.hall]`: three Hall sensors; sensors are 1, 2, 3, leads H1, H2, H3."""

    offset: float = number("rad", 0.0, at_least=-math.pi, up_to=math.pi, description="electrical, of all three")
    placements: tuple[Placement, Placement, Placement] = Field(
        (0.0, 0.0, 0.0),
        description="a list of three numbers from -π to π rad, electrical: each sensor's own error",
        json_schema_extra={"unit": "rad"},
    )
    order: tuple[Sensor, Sensor, Sensor] = Field(
        (1, 2, 3), description="the sensors on leads H1, H2, H3: [1, 2, 3] in some order"
    )
    inverted: tuple[Sensor, ...] = Field((), description="a list of sensors: 1, 2, 3")
    stuck_low: tuple[Sensor, ...] = Field((), description="a list of sensors: 1, 2, 3")
    stuck_high: tuple[Sensor, ...] = Field((), description="a list of sensors: 1, 2, 3")
    voltage: float = number("V", 5.0, above=0.0, up_to=30.0, description="of a high level")

    @model_validator(mode="after")
    def _possible(self) -> "HallSection":
        both = sorted(set(self.stuck_low) & set(self.stuck_high))
        if both:
            raise ValueError(
                text("sensor {sensor} is in stuck_low and in stuck_high; give it in one of them", sensor=both[0])
            )
        self.sensors()
        return self

    def sensors(self) -> SimulatedHallSensors:
        """Return them as the virtual motor takes them. Raises ValueError for an order that is none."""
        return SimulatedHallSensors(
            self.offset,
            self.placements,
            self.order,
            self.inverted,
            (*((sensor, "low") for sensor in self.stuck_low), *((sensor, "high") for sensor in self.stuck_high)),
            self.voltage,
        )


class InsideSection(Section):
    """The common part of the tables of both kinds of virtual motor."""

    insulation_resistance: float = number("ohm", 2.0e9, above=0.0, up_to=1e15, description="winding to frame")
    frame_capacitance: float = number("F", 1.0e-9, at_least=0.0, up_to=1e-3, description="winding to frame")
    exchanged_terminals: tuple[TerminalName, TerminalName] | None = Field(
        None, description='two of "A", "B", "C", whose wires are exchanged inside the motor'
    )
    hall: HallSection | None = None

    @model_validator(mode="after")
    def _two_terminals(self) -> "InsideSection":
        pair = self.exchanged_terminals
        if pair is not None and pair[0] == pair[1]:
            raise ValueError(
                text(
                    'exchanged_terminals = ["{first}", "{second}"]; give two different terminals',
                    first=pair[0],
                    second=pair[1],
                )
            )
        return self

    def insides(self) -> dict[str, Any]:
        """Return what it says of the motor, by the virtual motor's names; without a table of Hall sensors nothing of them."""
        found: dict[str, Any] = {
            "insulation_resistance": self.insulation_resistance,
            "frame_capacitance": self.frame_capacitance,
            "exchanged": self.exchanged_terminals,
        }
        return found if self.hall is None else {**found, "halls": self.hall.sensors()}
