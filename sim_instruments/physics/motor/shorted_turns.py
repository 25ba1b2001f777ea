"""Shorted turns of a winding, and their direct consequences."""

import math
from dataclasses import dataclass

#: Share of the shorted turns' own inductance that is not linked with the rest of their coil; a usual one for a slot's leakage.
LEAKAGE = 0.05


@dataclass(frozen=True)
class ShortedTurns:
    """A `share` (0 … 1) of the turns of `winding` (0, 1, 2), bridged by a resistance (Ω). Raises ValueError for what cannot be."""

    winding: int
    share: float
    resistance: float = 0.0

    def __post_init__(self) -> None:
        if self.winding not in (0, 1, 2):
            raise ValueError(f"shorted_turns: winding is {self.winding}; there are 0, 1, 2")
        if not 0.0 < self.share < 1.0:
            raise ValueError(f"shorted_turns: share is {self.share}; it must be above 0 and below 1")
        if not 0.0 <= self.resistance < math.inf:
            raise ValueError(f"shorted_turns: resistance is {self.resistance} Ω; it must be finite and not negative")

    def passed_by(self, winding_resistance: float) -> float:
        """Return the share of a direct current in the winding (of this resistance, Ω) that the short takes past its turns."""
        own = self.share * winding_resistance
        return own / (own + self.resistance)

    def brake(self, winding_resistance: float, inductance: float, flux: float) -> tuple[float, float]:
        """Return slope (N·m·s/rad) and speed (rad/s) of the mean torque slope·ω / (1 + (ω/speed)²) with which it brakes a turning rotor.

        `inductance` (H) is the whole winding's, `flux` its flux linkage over the mechanical angle (V·s/rad, peak).
        """
        resistance = self.share * winding_resistance + self.resistance
        own = self.share**2 * inductance * (1.0 + LEAKAGE)
        return 0.5 * (self.share * flux) ** 2 / resistance, resistance / own
