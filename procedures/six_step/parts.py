"""Winding, switches and EMF constant of a six-step drive, with their uncertainties at any temperature of the winding."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from GTC import get_covariance
from GTC.lib import UncertainReal


@dataclass(frozen=True)
class WindingData:
    """R_11 (Ω) at 0 K above `reference` (°C), its copper, L11 − L12 (H), and how much of the winding's warmth reaches the magnets.

    `magnets` (1/K) takes the EMF constant along with the winding's temperature above `start` (°C); the share that reaches them is
    in it.
    """

    resistance: UncertainReal
    reference: float
    coefficient: float
    coefficient_reference: float
    inductance: UncertainReal
    magnets: UncertainReal
    start: UncertainReal

    def resistance_at(self, temperature: UncertainReal | float) -> UncertainReal:
        """Return R_11 (Ω) at a temperature (°C)."""
        at = 1.0 + self.coefficient * (temperature - self.coefficient_reference)
        given = 1.0 + self.coefficient * (self.reference - self.coefficient_reference)
        return self.resistance * at / given

    def magnets_at(self, temperature: UncertainReal) -> UncertainReal:
        """Return the magnets' flux with the winding at a temperature (°C), over that at the beginning."""
        return 1.0 + self.magnets * (temperature - self.start)


@dataclass(frozen=True)
class Parts:
    """The winding, the switch's on-resistance (Ω), and the line EMF constant (V·s/rad) as the run began."""

    winding: WindingData
    switch_resistance: UncertainReal
    emf_constant: UncertainReal

    def emf_at(self, temperature: UncertainReal) -> UncertainReal:
        """Return the line EMF constant (V·s/rad) with the winding at a temperature (°C)."""
        return self.emf_constant * self.winding.magnets_at(temperature)

    def as_finding(self, temperature: UncertainReal) -> dict[str, Any]:
        """Return the figures at a temperature (°C) with the covariances of their errors, JSON-ready."""
        figures = {
            "line_emf_constant": self.emf_at(temperature),
            "switch_resistance": self.switch_resistance,
            "winding_resistance": self.winding.resistance_at(temperature),
            "winding_inductance": self.winding.inductance,
        }
        return {
            "winding_temperature": float(temperature.x),
            "values": {name: float(figure.x) for name, figure in figures.items()},
            "covariance": covariance(list(figures.values())).tolist(),
        }


def covariance(quantities: Sequence[UncertainReal]) -> Any:
    """Return the covariance matrix of some quantities, shape (n, n)."""
    return np.array([[float(get_covariance(a, b)) for b in quantities] for a in quantities])
