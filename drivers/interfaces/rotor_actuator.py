"""Rotor actuator: brake, clutch and positioning drive in place of the hand on the shaft."""

from typing import Protocol

from drivers.interfaces.identity import Instrument, Reading


class RotorActuator(Instrument, Protocol):
    """Holds, turns and frees the shaft of the motor under test. Angles are mechanical, in rad, and do not wrap."""

    @property
    def maximum_speed(self) -> float:
        """Largest speed (rad/s) at which it turns the shaft."""

    def lock(self) -> None:
        """Hold the shaft where it stands; returns when the brake has closed."""

    def release(self) -> None:
        """Open brake and clutch, so that the shaft turns freely; returns when they have opened."""

    def turn(self, speed: float) -> None:
        """Turn the shaft evenly at `speed` (rad/s, sign is direction) until stopped. Raises SetpointError beyond the maximum."""

    def stop(self) -> None:
        """End turning and let the shaft go; returns when the drive stands."""

    def move_by(self, angle: float) -> None:
        """Turn the shaft by an angle (rad) and let it go."""

    def angle(self) -> Reading:
        """Return the shaft's angle (rad) by the encoder that sits on it."""

    def couple_dynamometer(self) -> None:
        """Close the coupling to the dynamometer; refused with InstrumentError while the shaft turns."""

    def uncouple_dynamometer(self) -> None:
        """Open the coupling to the dynamometer; refused with InstrumentError while the shaft turns."""
