"""Insulation tester: the resistance between winding and frame at a high DC voltage."""

from dataclasses import dataclass
from typing import Protocol

from drivers.interfaces.declarations import (
    NO_QUANTITY,
    Amount,
    Lasting,
    Quantity,
    energises,
    gives_unit,
    in_units,
    question,
)
from drivers.interfaces.identity import Instrument, Reading


@dataclass(frozen=True)
class InsulationReading:
    """Insulation resistance (Ω) at a test voltage (V).

    With `beyond_range`, `resistance` is the largest that the tester tells apart, and the true one is larger still.
    """

    resistance: Reading
    voltage: float
    beyond_range: bool


VOLTAGE = Amount(Quantity.INSULATION_VOLTAGE, "V", own="maximum_voltage")


class InsulationTester(Instrument, Protocol):
    """A tester that applies its voltage for one measurement only and discharges the object afterwards."""

    @property
    @question
    def maximum_voltage(self) -> float:
        """Largest test voltage (V): the lesser of the model's and the station's."""

    @gives_unit("Ω")
    @in_units(duration="s")
    @energises(Lasting.CALL, voltage=VOLTAGE, duration=NO_QUANTITY)
    def measure(self, voltage: float, duration: float) -> InsulationReading:
        """Apply `voltage` (V DC) for `duration` (s), read the resistance at its end, discharge, and return.

        The output is off and discharged when this returns or raises. Raises SetpointError outside the allowed range and
        BreakdownError where the test did not reach its voltage, MeasurementError where it broke off otherwise.
        """
