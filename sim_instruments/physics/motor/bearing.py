"""The drag of bearings, air and slots on a turning shaft beside Coulomb and viscous friction."""

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
    `brake` (N·m·s/rad) and `brake_speed` (rad/s) are a closed loop's in the magnets' field: brake·ω / (1 + (ω/brake_speed)²).
    `cogging_while_turning` says whether the shaft feels its cogging torque while it coasts or is driven as well; None is where
    that is more than its dry friction: less averages out over a turn.
    """

    windage: float = 0.0
    stribeck_torque: float = 0.0
    stribeck_speed: float = 10.0
    stribeck_exponent: float = 1.0
    cogging_while_turning: bool | None = None
    brake: float = 0.0
    brake_speed: float = 1.0

    def __post_init__(self) -> None:
        for name in ("windage", "stribeck_torque", "brake"):
            value = getattr(self, name)
            if not 0.0 <= value < math.inf:
                raise ValueError(f"bearing: {name} is {value}; it must be finite and not negative")
        for name in ("stribeck_speed", "stribeck_exponent", "brake_speed"):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise ValueError(f"bearing: {name} is {value}; it must be positive and finite")

    @property
    def plain(self) -> bool:
        """True if there is only Coulomb and viscous friction."""
        return not (self.windage or self.stribeck_torque or self.brake)

    def drag(self, speed: float) -> float:
        """Return its torque (N·m) against a speed (rad/s), with the speed's sign; static friction has none."""
        size = abs(speed)
        fading = math.exp(-((size / self.stribeck_speed) ** self.stribeck_exponent)) if self.stribeck_torque else 0.0
        torque = self.windage * size * size + self.stribeck_torque * fading
        torque += self.brake * size / (1.0 + (size / self.brake_speed) ** 2)
        return math.copysign(torque, speed) if speed else 0.0

    def drags(self, speeds: FloatArray) -> FloatArray:
        """Return its torques (N·m) against speeds (rad/s) of any shape, with the speeds' signs."""
        size = np.abs(speeds)
        fading = np.exp(-((size / self.stribeck_speed) ** self.stribeck_exponent))
        induced = self.brake * size / (1.0 + (size / self.brake_speed) ** 2)
        return np.sign(speeds) * (self.windage * size**2 + self.stribeck_torque * fading + induced)


#: Coulomb and viscous friction only.
PLAIN = Bearing()
