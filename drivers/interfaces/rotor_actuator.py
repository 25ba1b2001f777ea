"""Rotor actuator: brake, clutch and positioning drive that replace a hand at the shaft."""

from typing import Protocol

from drivers.interfaces.declarations import (
    NO_QUANTITY,
    Amount,
    Lasting,
    Quantity,
    energises,
    in_units,
    makes_safe,
    question,
    reading,
    setting,
)
from drivers.interfaces.identity import Instrument, Reading

SPEED = Amount(Quantity.SPEED, "rad/s", own="maximum_speed", signed=True)


class RotorActuator(Instrument, Protocol):
    """Holds, turns and frees the shaft of the motor under test. Angles are mechanical, in rad, and do not wrap."""

    @property
    @question
    def maximum_speed(self) -> float:
        """Largest speed (rad/s) at which it turns the shaft."""

    @setting
    def lock(self) -> None:
        """Hold the shaft where it stands; returns when the brake has closed."""

    @setting
    def release(self) -> None:
        """Open brake and clutch, so that the shaft turns freely; returns when they have opened."""

    @energises(Lasting.UNTIL_STOPPED, speed=SPEED)
    def turn(self, speed: float) -> None:
        """Turn the shaft evenly at `speed` (rad/s, sign is direction) until stopped. Raises SetpointError beyond the maximum."""

    @makes_safe()
    def stop(self) -> None:
        """End turning and let the shaft go; returns when the drive stands."""

    @in_units(angle="rad")
    @energises(Lasting.CALL, angle=NO_QUANTITY)
    def move_by(self, angle: float) -> None:
        """Turn the shaft by an angle (rad) and let it go."""

    @reading("rad")
    def angle(self) -> Reading:
        """Return the shaft's angle (rad) by the encoder that sits on it."""

    @setting
    def couple_dynamometer(self) -> None:
        """Close the coupling to the dynamometer; refused with InstrumentError while the shaft turns."""

    @setting
    def uncouple_dynamometer(self) -> None:
        """Open the coupling to the dynamometer; refused with InstrumentError while the shaft turns."""
