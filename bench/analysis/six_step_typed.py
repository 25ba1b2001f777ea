"""What a user types of a six-step drive beside its table of loads: the winding, and the EMF."""

import math
from dataclasses import dataclass
from typing import Literal

from bench.i18n.errors import UsageError
from drivers.interfaces.text import text
from procedures.six_step.figures import STATE_MEAN
from procedures.six_step.settings import EquivalentResistanceSettings
from procedures.techniques.temperature.settings import COLD

#: Relative: k_e as typed without an uncertainty; the mean over a state of an EMF that is no sine, by its fundamental.
UNSTATED_EMF, _SHAPE = 0.01, 0.01


@dataclass(frozen=True)
class TypedWinding:
    """What was typed of the winding: R_11 (Ω) at `reference` (°C) and L11 − L12 (H) with half-widths, R_t (Ω); None where it was not."""

    connection: Literal["wye", "delta"] | None = None
    resistance: float | None = None
    resistance_uncertainty: float | None = None
    reference: float = COLD
    inductance: float | None = None
    inductance_uncertainty: float | None = None
    switch_resistance: float | None = None
    copper_coefficient: float = 0.00393

    def settings(self, magnet_coefficient: float) -> EquivalentResistanceSettings:
        """Return it as the procedure's settings, with the magnets' coefficient (1/K)."""
        return EquivalentResistanceSettings(
            winding_resistance=self.resistance,
            winding_resistance_uncertainty=self.resistance_uncertainty,
            winding_resistance_temperature=self.reference,
            winding_inductance=self.inductance,
            winding_inductance_uncertainty=self.inductance_uncertainty,
            coefficient=self.copper_coefficient,
            magnet_coefficient=magnet_coefficient,
        )


@dataclass(frozen=True)
class TypedEmf:
    """What was typed of the EMF at 25 °C: k_e (V·s/rad, mean between the conducting terminals) or λ (V·s), its half-width (same unit), and
    how far the Hall sensors may lead or lag (rad, electrical).

    `leads` (Ω) is what lies between the voltmeter and the drive's own terminals, None where nobody says.
    """

    constant: float | None = None
    flux_linkage: float | None = None
    uncertainty: float | None = None
    commutation: float = math.radians(15.0)
    magnet_coefficient: float = -0.001
    leads: float | None = None

    def at_25(self, pole_pairs: int | None) -> tuple[float, float] | None:
        """Return k_e (V·s/rad) at 25 °C and its half-width as typed, None where it was not; by a flux linkage it holds for a sine."""
        if self.constant is not None:
            half = UNSTATED_EMF * self.constant if self.uncertainty is None else self.uncertainty
            return self.constant, half
        if self.flux_linkage is None:
            return None
        if pole_pairs is None:
            raise UsageError(text("--flux-linkage: type --pole-pairs as well"))
        factor = STATE_MEAN * math.sqrt(3.0) * pole_pairs
        half = UNSTATED_EMF * self.flux_linkage if self.uncertainty is None else self.uncertainty
        return factor * self.flux_linkage, factor * (half + _SHAPE * self.flux_linkage)
