"""What bearings, air and slots do to a turning shaft beside Coulomb and viscous friction."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Bearing:
    """Drag beside Coulomb and viscous friction; the default has none.

    `windage` (N·m·s²/rad²) grows with the square of the speed. `stribeck_torque` (N·m) comes on top of Coulomb friction at
    standstill and fades as exp(−(|ω| / stribeck_speed)^stribeck_exponent), speeds in rad/s, once a film of lubricant carries the shaft.
    `cogging_while_turning` says that the shaft feels its cogging torque while it coasts or is driven as well.
    """

    windage: float = 0.0
    stribeck_torque: float = 0.0
    stribeck_speed: float = 10.0
    stribeck_exponent: float = 1.0
    cogging_while_turning: bool = False

    def __post_init__(self) -> None:
        for name in ("windage", "stribeck_torque"):
            value = getattr(self, name)
            if not 0.0 <= value < math.inf:
                raise ValueError(f"bearing: {name} is {value}; it must be finite and not negative")
        for name in ("stribeck_speed", "stribeck_exponent"):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise ValueError(f"bearing: {name} is {value}; it must be positive and finite")

    @property
    def plain(self) -> bool:
        """Whether there is nothing beside Coulomb and viscous friction."""
        return not (self.windage or self.stribeck_torque)

    def drag(self, speed: float) -> float:
        """Return its torque (N·m) against a speed (rad/s), with the speed's sign; static friction has none."""
        size = abs(speed)
        fading = math.exp(-((size / self.stribeck_speed) ** self.stribeck_exponent)) if self.stribeck_torque else 0.0
        torque = self.windage * size * size + self.stribeck_torque * fading
        return math.copysign(torque, speed) if speed else 0.0

    def drags(self, speeds: FloatArray) -> FloatArray:
        """Return its torques (N·m) against speeds (rad/s) of any shape, with the speeds' signs."""
        size = np.abs(speeds)
        fading = np.exp(-((size / self.stribeck_speed) ** self.stribeck_exponent))
        result: FloatArray = np.sign(speeds) * (self.windage * size**2 + self.stribeck_torque * fading)
        return result


#: Coulomb and viscous friction only.
PLAIN = Bearing()
