"""The temperature of a virtual motor's magnets."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Magnets:
    """Magnets that warm up behind the winding; without a `time_constant` (s) they are always as warm as the winding.

    They tend to the ambient temperature, the share `winding_share` (0 … 1) of the winding's rise above it, and `thermal_resistance`
    (K/W) times the iron's loss.
    """

    time_constant: float | None = None
    winding_share: float = 1.0
    thermal_resistance: float = 0.0

    def __post_init__(self) -> None:
        if self.time_constant is not None and not 0.0 < self.time_constant < math.inf:
            raise ValueError(f"magnets: time_constant is {self.time_constant}; it must be positive and finite")
        if not 0.0 <= self.winding_share <= 1.0:
            raise ValueError(f"magnets: winding_share is {self.winding_share}; it lies in 0 … 1")
        if not 0.0 <= self.thermal_resistance < math.inf:
            raise ValueError(
                f"magnets: thermal_resistance is {self.thermal_resistance}; it must be finite and not negative"
            )

    def final(self, ambient: float, winding: float, iron_loss: float) -> float:
        """Return the temperature (°C) that they tend to, at those of ambient and winding (°C) and the iron's loss (W)."""
        return ambient + self.winding_share * (winding - ambient) + self.thermal_resistance * iron_loss


#: Magnets as warm as the winding.
AS_WARM = Magnets()
