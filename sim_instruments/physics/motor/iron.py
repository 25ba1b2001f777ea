"""Iron and magnets at higher frequencies: loss, eddy currents that delay the field, magnets that warm up."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Iron:
    """Loss, eddy currents and what speed does to the flux linkage; the default has none of them.

    `eddy_coupling` k (0 … 1) and `eddy_resistance` (Ω, of a winding) are those of a shorted turn beside each winding: at rest the
    winding's inductance is whole, at high frequencies it is the share 1 − k² of it.
    `emf_corner` (Hz, electrical) is where the laminations' skin depth is their thickness' half: the EMF falls by
    |tanh √(jf/fc) / √(jf/fc)|. `magnet_rise` (K) is how much warmer than the winding the magnets are at `magnet_rise_speed` (rad/s,
    mechanical), growing with the square of the speed.
    `hysteresis_loss` (A/(V·s)) and `eddy_loss` (1/Ω) are of the Y-equivalent: at an electrical speed ω the flux ψ takes the current
    (hysteresis_loss + eddy_loss·|ω|)·|ψ| from those at the terminals, across the flux, and the shaft 1.5·p times that current
    times |ψ| of torque; the loss is 1.5·(hysteresis_loss·|ω| + eddy_loss·ω²)·|ψ|².
    """

    eddy_coupling: float = 0.0
    eddy_resistance: float = 1.0
    emf_corner: float = math.inf
    magnet_rise: float = 0.0
    magnet_rise_speed: float = 100.0
    hysteresis_loss: float = 0.0
    eddy_loss: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.eddy_coupling < 1.0:
            raise ValueError(f"iron: eddy_coupling is {self.eddy_coupling}; it lies in 0 … 1, and is below 1")
        for name in ("eddy_resistance", "emf_corner", "magnet_rise_speed"):
            value = getattr(self, name)
            if not value > 0.0:
                raise ValueError(f"iron: {name} is {value}; it must be positive")
        if not 0.0 <= self.magnet_rise < math.inf:
            raise ValueError(f"iron: magnet_rise is {self.magnet_rise}; it must be finite and not negative")
        for name in ("hysteresis_loss", "eddy_loss"):
            value = getattr(self, name)
            if not 0.0 <= value < math.inf:
                raise ValueError(f"iron: {name} is {value}; it must be finite and not negative")

    @property
    def has_eddy_currents(self) -> bool:
        """True if a shorted turn is coupled to the windings."""
        return self.eddy_coupling > 0.0

    @property
    def loses(self) -> bool:
        """True if a turning flux costs torque and current."""
        return self.hysteresis_loss > 0.0 or self.eddy_loss > 0.0

    def lost_share(self, electrical_speed: FloatArray) -> FloatArray:
        """Return the current per flux (A/(V·s)) that loss takes at electrical speeds (rad/s), with the speed's sign."""
        return np.sign(electrical_speed) * self.hysteresis_loss + electrical_speed * self.eddy_loss

    @property
    def lowers_emf(self) -> bool:
        """True if the EMF is not in proportion to the speed."""
        return math.isfinite(self.emf_corner) or self.magnet_rise > 0.0

    def inductance_share(self, reactance: float) -> float:
        """Return the share of a winding's inductance that is left at a frequency where that inductance has a reactance (Ω)."""
        turned = reactance / self.eddy_resistance
        return 1.0 - self.eddy_coupling**2 * turned**2 / (1.0 + turned**2)

    def emf_share(self, electrical_speed: FloatArray, order: int, pole_pairs: int, coefficient: float) -> FloatArray:
        """Return the share of a harmonic's EMF that is left at electrical speeds (rad/s); `coefficient` (1/K) is the magnets'."""
        share: FloatArray = np.ones_like(electrical_speed)
        if math.isfinite(self.emf_corner):
            root = np.sqrt(1j * np.maximum(np.abs(order * electrical_speed) / (2.0 * math.pi), 1e-9) / self.emf_corner)
            share = np.abs(np.tanh(root) / root)
        warmer = self.magnet_rise * (electrical_speed / pole_pairs / self.magnet_rise_speed) ** 2
        return share * (1.0 + coefficient * warmer)


#: Iron without losses, magnets that stay as warm as the winding.
IDEAL = Iron()
