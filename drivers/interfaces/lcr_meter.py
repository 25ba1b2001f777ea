"""LCR meter: series resistance and inductance between two terminals."""

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from drivers.interfaces.identity import Accuracy, Instrument


class Aperture(Enum):
    """Measurement time."""

    SHORT = "SHOR"
    MEDIUM = "MED"
    LONG = "LONG"


class Wanted(Enum):
    """What a measurement is taken for; a meter that a person reads asks for no more than that."""

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


class LcrMeter(Instrument, Protocol):
    """An LCR bridge or meter."""

    @property
    def read_by_hand(self) -> bool:
        """Whether a person types the readings in, so that a series of them is not to be had."""

    @property
    def source_impedance(self) -> float:
        """Impedance (Ω) behind which the test signal stands: level over it is the most that flows."""

    def configure(self, frequency: float, level: float = 1.0, aperture: Aperture = Aperture.MEDIUM) -> None:
        """Set the series L–R function, test frequency (Hz), level (V rms, open circuit) and measurement time; no bias."""

    def correct_short(self) -> None:
        """Measure the shorted leads at the present settings and subtract them from now on."""

    def measure(self, wanted: Wanted = Wanted.BOTH) -> ImpedanceReading:
        """Trigger one measurement and return it; what is not `wanted` may be NaN.

        Raises OverloadError (no value within range) or MeasurementError (status other than good).
        """

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
