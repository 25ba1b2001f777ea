"""The supply as a source of the circuit at the moment."""

from dataclasses import dataclass

from sim_instruments.physics.circuits.windings import FloatArray


@dataclass(frozen=True)
class VoltageSource:
    """A voltage (V) that runs with a constant slope (V/s) from its start (s)."""

    start: float
    voltage: float
    slope: float = 0.0

    def at(self, times: FloatArray) -> FloatArray:
        """Return the voltage at the times."""
        return self.voltage + self.slope * (times - self.start)


@dataclass(frozen=True)
class CurrentSource:
    """A regulated current (A)."""

    current: float


Source = VoltageSource | CurrentSource


def absent(start: float) -> VoltageSource:
    """Return the source of a network that has none."""
    return VoltageSource(start, 0.0)
