"""Dynamometer: a machine that drives or brakes the shaft, with torque and speed readings."""

from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Protocol

from drivers.interfaces.identity import Accuracy, Instrument


@dataclass(frozen=True)
class DynamometerReading:
    """One reading, all taken in a single transaction: `speed` (rad/s, mechanical), `torque` (N·m, on the shaft by the
    dynamometer, positive when it drives the motor forwards), `power` (W, shaft), at bench time `time` (s).
    """

    time: float
    speed: float
    torque: float
    power: float
    speed_accuracy: Accuracy
    torque_accuracy: Accuracy


class Dynamometer(Instrument, Protocol):
    """A four-quadrant dynamometer. Speeds are mechanical, rad/s; torques N·m."""

    @property
    def read_by_hand(self) -> bool:
        """Whether a person sets and reads it, and is not asked for more than a step needs."""

    @property
    def maximum_speed(self) -> float:
        """Largest speed (rad/s) that may be commanded."""

    @property
    def maximum_torque(self) -> float:
        """Largest torque (N·m) that may be commanded."""

    def zero_torque(self) -> None:
        """Take the present torque reading as zero (shaft at rest, nothing driven)."""

    def driving_speed(self, speed: float) -> AbstractContextManager[None]:
        """Hold the shaft at a speed (rad/s) for the length of the block; it then coasts.

        Returns from entering once the speed has settled; raises MeasurementError where it does not.
        """

    def set_speed(self, speed: float) -> None:
        """Change the commanded speed (rad/s) inside a `driving_speed` block and wait until it has settled."""

    def driving_torque(self, torque: float, speed_limit: float | None = None) -> AbstractContextManager[None]:
        """Put a constant torque (N·m) on the shaft for the length of the block; it then coasts.

        The drive keeps the speed (rad/s) below `speed_limit` by itself, its largest speed when not given.
        """

    def command_zero(self) -> None:
        """Command no torque and no speed, whatever the drive does now; it stays enabled if it was."""

    def measure(self) -> DynamometerReading:
        """Return one reading of speed, torque and power."""

    def stop(self) -> None:
        """Brake to standstill, wait until the shaft is at rest, and disable the drive."""
