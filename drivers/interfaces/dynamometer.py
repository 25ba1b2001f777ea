"""Dynamometer: a machine that drives or brakes the shaft, with torque and speed readings."""

from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Protocol

from drivers.interfaces.declarations import (
    Amount,
    Quantity,
    energises,
    makes_safe,
    question,
    readings,
    set_point,
    setting,
)
from drivers.interfaces.identity import Accuracy, Instrument


@dataclass(frozen=True)
class DynamometerReading:
    """One reading, all taken in a single transaction: `speed` (rad/s, mechanical), `torque` (N·m, on the shaft by the
    dynamometer, positive when it drives the motor forwards), `power` (W, shaft), at bench time `time` (s). `speed_filter` and
    `torque_filter` (s) are the time constants of first-order filters that they went through, as far as they are known.
    """

    time: float
    speed: float
    torque: float
    power: float
    speed_accuracy: Accuracy
    torque_accuracy: Accuracy
    speed_filter: float = 0.0
    torque_filter: float = 0.0


SPEED = Amount(Quantity.SPEED, "rad/s", own="maximum_speed", signed=True)
SPEED_LIMIT = Amount(Quantity.SPEED, "rad/s", own="maximum_speed", ceiling=True)
TORQUE = Amount(Quantity.TORQUE, "N·m", own="maximum_torque", signed=True)


class Dynamometer(Instrument, Protocol):
    """A four-quadrant dynamometer. Speeds are mechanical, rad/s; torques N·m."""

    @property
    @question
    def maximum_speed(self) -> float:
        """Largest speed (rad/s) that may be commanded."""

    @property
    @question
    def maximum_torque(self) -> float:
        """Largest torque (N·m) that may be commanded."""

    @setting
    def zero_torque(self) -> None:
        """Take the present torque reading as zero (shaft at rest, nothing driven)."""

    @energises(speed=SPEED)
    def driving_speed(self, speed: float) -> AbstractContextManager[None]:
        """Hold the shaft at a speed (rad/s) for the length of the block; it then coasts.

        Returns from entering once the speed has settled; raises MeasurementError where it does not.
        """

    @set_point(speed=SPEED)
    def set_speed(self, speed: float) -> None:
        """Change the commanded speed (rad/s) inside a `driving_speed` block and wait until it has settled."""

    @energises(torque=TORQUE, speed_limit=SPEED_LIMIT)
    def driving_torque(self, torque: float, speed_limit: float | None = None) -> AbstractContextManager[None]:
        """Put a constant torque (N·m) on the shaft for the length of the block; it then coasts.

        The drive keeps the speed (rad/s) below `speed_limit` by itself, its largest speed when not given.
        """

    @makes_safe("command_zero")
    def command_zero(self) -> None:
        """Command no torque and no speed, whatever the drive does now; it stays enabled if it was."""

    @readings(speed=SPEED, torque=TORQUE)
    def measure(self) -> DynamometerReading:
        """Return one reading of speed, torque and power."""

    @makes_safe("brake")
    def stop(self) -> None:
        """Brake to standstill, wait until the shaft is at rest, and disable the drive."""
