"""Readings of a shaft that is held at a speed: one that comes as zeros is the sensor's cable, and is taken again."""

from drivers.interfaces import DynamometerReading
from procedures.core.bench import Bench
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit

#: A shaft that reads as zeros so many times in a row stands still.
_IN_A_ROW = 3


class ShaftReadings:
    """Takes readings of the dynamometer, and counts those that were `lost`."""

    def __init__(self, bench: Bench) -> None:
        """Read the dynamometer of a `bench`."""
        self.bench = bench
        self.taken = self.lost = 0

    def measure(self) -> DynamometerReading:
        """Return a reading; one of neither speed nor torque is taken again, unless a person reads it or it stays so."""
        for _ in range(_IN_A_ROW):
            self.taken += 1
            read = self.bench.dynamometer.measure()
            if read.speed or read.torque or self.bench.dynamometer.read_by_hand:
                return read
            self.lost += 1
        return read

    def misfit(self) -> Misfit:
        """Return what is to be told of readings that were lost."""
        if not self.lost:
            return Misfit()
        figures: dict[str, float | str] = {"count": float(self.lost), "readings": float(self.taken)}
        return Misfit((Finding(Cause.DROPOUTS, Answer.MODELLED, figures=figures),))
