"""LCR meter: series resistance and inductance between two terminals."""

import math
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from drivers.interfaces.declarations import (
    NO_QUANTITY,
    Amount,
    Converted,
    Quantity,
    question,
    reading,
    set_point,
    setting,
)
from drivers.interfaces.identity import Accuracy, Instrument


class Aperture(Enum):
    """Measurement time."""

    SHORT = "SHOR"
    MEDIUM = "MED"
    LONG = "LONG"


class Wanted(Enum):
    """The quantities that a measurement is for; a meter that a person reads asks only for these."""

    BOTH = "resistance and inductance"
    RESISTANCE = "resistance"
    INDUCTANCE = "inductance"


@dataclass(frozen=True)
class ImpedanceReading:
    """Series equivalent of an impedance: resistance (Ω) and inductance (H) at `frequency` (Hz), each with its accuracy.

    `inductance` is NaN and `frequency` 0 for an instrument that only gives a DC resistance; `resistance` is NaN
    for one that was asked for inductance alone.
    """

    resistance: float
    inductance: float
    frequency: float
    resistance_accuracy: Accuracy
    inductance_accuracy: Accuracy
    time: float


FREQUENCY = Amount(Quantity.FREQUENCY, "Hz", own="maximum_frequency", offered="frequencies")
LEVEL = Amount(
    Quantity.LEVEL,
    "V rms",
    also=(
        # A motor's limits are peaks; the most that flows is the level over the source's impedance.
        Converted(Quantity.VOLTAGE, 1.0 / math.sqrt(2.0)),
        Converted(Quantity.CURRENT, 1.0 / math.sqrt(2.0), times="source_impedance"),
    ),
)


class LcrMeter(Instrument, Protocol):
    """An LCR bridge or meter."""

    @property
    @question
    def maximum_frequency(self) -> float:
        """Largest test frequency (Hz); infinite where the meter's is not known."""

    @property
    @question
    def source_impedance(self) -> float:
        """Impedance (Ω) behind which the test signal stands: level over it is the most that flows."""

    @set_point(frequency=FREQUENCY, level=LEVEL, aperture=NO_QUANTITY)
    def configure(self, frequency: float, level: float = 1.0, aperture: Aperture = Aperture.MEDIUM) -> None:
        """Set the series L–R function, test frequency (Hz), level (V rms, open circuit) and measurement time; no bias."""

    @setting
    def correct_short(self) -> None:
        """Measure the shorted leads at the present settings and subtract them from now on."""

    @reading()
    def measure(self, wanted: Wanted = Wanted.BOTH) -> ImpedanceReading:
        """Trigger one measurement and return it; what is not `wanted` may be NaN.

        Raises OverloadError (no value within range) or MeasurementError (status other than good).
        """

    @question
    def accuracy_at(
        self,
        resistance: float,
        inductance: float,
        frequency: float,
        level: float | None = None,
        aperture: Aperture | None = None,
    ) -> tuple[Accuracy, Accuracy]:
        """Return the limits of error that a reading of this resistance (Ω) and inductance (H) at `frequency` (Hz) would have.

        Level (V rms) and measurement time are those that are set where they are not given; nothing is set by asking.
        """
