"""Readings of a six-step drive at one load, and the temperature of its winding at each of several."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from GTC.lib import UncertainReal

from drivers.interfaces import Accuracy, Reading
from drivers.interfaces.text import text, word
from procedures.core.budget import Uncertainties
from procedures.estimation.fitting.repeats import mean_of_readings
from procedures.estimation.six_step import currents as six_step
from procedures.estimation.six_step.warming import warming_shares


@dataclass(frozen=True)
class Averaged:
    """Readings taken under one condition: their mean as one reading, its standard uncertainty from their scatter, degrees of freedom."""

    reading: Reading
    scatter: float
    degrees_of_freedom: float

    @property
    def value(self) -> float:
        """The mean."""
        return self.reading.value

    @property
    def accuracy(self) -> Accuracy:
        """The instrument's limits of error."""
        return self.reading.accuracy

    def widened(self, *, gain: float = 0.0, offset: float = 0.0) -> "Averaged":
        """Return it with limits of error at least as wide as these."""
        return replace(self, reading=widened(self.reading, gain=gain, offset=offset))

    def with_errors(self, uncertainties: Uncertainties, name: str) -> UncertainReal:
        """Return the mean with its scatter and the errors of the instrument `name`."""
        mean = uncertainties.statistical(
            text("{name}: repeats", name=word(name)), self.value, self.scatter, self.degrees_of_freedom
        )
        return uncertainties.instrument(name, mean, self.accuracy)


def widened(reading: Reading, *, gain: float = 0.0, offset: float = 0.0) -> Reading:
    """Return a reading with limits of error at least as wide as these."""
    return replace(reading, accuracy=at_least(reading.accuracy, gain=gain, offset=offset))


def at_least(accuracy: Accuracy, *, gain: float = 0.0, offset: float = 0.0) -> Accuracy:
    """Return limits of error at least as wide as these."""
    return replace(accuracy, gain=max(accuracy.gain, gain), offset=max(accuracy.offset, offset))


def averaged(readings: Sequence[Reading]) -> Averaged:
    """Return the mean of readings taken under one condition."""
    last = readings[-1]
    mean, scatter, freedom = mean_of_readings([r.value for r in readings])
    return Averaged(Reading(mean, last.unit, last.accuracy, last.time), scatter, freedom)


@dataclass(frozen=True)
class LoadPoint:
    """Readings at one load: torque as commanded and as the dynamometer shows it (N·m, braking), speed (rad/s), bus voltage (V), bus
    current (A), and one line's current folded.

    `begun` and `read` (s) are when the load came and when it was read.
    """

    torque: float
    shaft_torque: Averaged
    speed: Reading
    bus_voltage: Averaged
    bus_current: Averaged
    electrical_frequency: float
    line: six_step.LineCurrent | None
    current_accuracy: Accuracy
    begun: float
    read: float

    @property
    def state_time(self) -> float:
        """Length of one state (s)."""
        return 1.0 / (6.0 * self.electrical_frequency)


@dataclass(frozen=True)
class LoadPoints:
    """All points, the smallest load first, with the winding's temperature (°C) before the first and after the last, and at each."""

    points: tuple[LoadPoint, ...]
    before: UncertainReal
    after: UncertainReal
    temperatures: tuple[UncertainReal, ...]

    @classmethod
    def between(
        cls,
        points: Sequence[LoadPoint],
        before: UncertainReal,
        after: UncertainReal,
        end: float,
        uncertainties: Uncertainties,
    ) -> "LoadPoints":
        """Return the points, each at its share of the rise between the two temperatures; `end` (s) is when the last load went."""
        rise = after - before
        shares, half_widths = warming_shares(
            [p.bus_current.value**2 for p in points],
            [p.begun for p in points],
            [p.read for p in points],
            end,
            warmed=float(rise.x) > 0.0,
        )
        # One course of the temperature: where it is early at one load, it is early at all.
        course = uncertainties.limit("course of the winding's temperature between its readings", 0.0, 1.0)
        return cls(
            tuple(points),
            before,
            after,
            tuple(before + rise * (float(s) + float(w) * course) for s, w in zip(shares, half_widths, strict=True)),
        )

    def separated(self) -> list[tuple[LoadPoint, six_step.LineCurrent, UncertainReal]]:
        """Return the points whose currents could be separated, with the line's current and the winding's temperature (°C)."""
        return [(p, p.line, t) for p, t in zip(self.points, self.temperatures, strict=True) if p.line is not None]
