"""Two figures that a wrong gain of voltage or current parts, and a winding's resistance by strokes against what it is known to be."""

import math
from dataclasses import dataclass

import numpy as np

from procedures.estimation.fitting.fit import FloatArray

#: Two figures agree within so many standard uncertainties of their ratio.
_AGREE = 3.0
#: Of a difference so many of its standard uncertainties are held beside it; 95 % of a rectangle end at that share of its limit.
_COVERED, _INSIDE = 2.0, 0.95
#: Beside the resistance and its warming, so many trains of strokes tell their scatter.
_FEWEST = 3


@dataclass(frozen=True)
class GainRatio:
    """One figure over another that it is to equal, gains of voltage and current going into either whole, with its standard uncertainty."""

    ratio: float
    standard_uncertainty: float

    @property
    def contradicted(self) -> bool:
        """Whether they differ by more than both uncertainties."""
        return abs(self.ratio - 1.0) > _AGREE * self.standard_uncertainty

    @property
    def excess(self) -> float:
        """Half-width by which a gain of voltage or current may be beyond its limit: what the two differ by more than chance has it.

        It counts from one standard uncertainty on, told or not. A larger share would widen the maps of undisturbed benches by more than
        half in the mean.
        """
        off, own = abs(self.ratio - 1.0), self.standard_uncertainty
        beyond = math.sqrt(3.0 * max(off**2 - own**2, 0.0))
        # Far off, the difference itself is known.
        return min(beyond, (off + _COVERED * own) / _INSIDE)


@dataclass(frozen=True)
class KnownResistance:
    """A winding's resistance (Ω, per phase of the equivalent wye) as warm as before the strokes, with its standard uncertainty (Ω)."""

    value: float
    standard_uncertainty: float

    def beside(self, shown: FloatArray, weights: FloatArray, heat: FloatArray, *alike: float) -> GainRatio | None:
        """Return resistances `shown` (Ω, shape (n,)) by trains of strokes over this one; None for too few trains.

        `heat` (A²·s, shape (n,)) had gone through the winding by the middle of each train: what that warmed it by is taken off. `alike`
        are standard uncertainties (relative) of what goes into all shown resistances alike.
        """
        if shown.size < _FEWEST:
            return None
        root = np.sqrt(weights)
        design = np.column_stack((np.ones_like(heat), heat / float(np.max(heat)))) * root[:, None]
        (cold, warming), *_ = np.linalg.lstsq(design, shown * root, rcond=None)
        left = shown * root - design @ (cold, warming)
        scatter = math.sqrt(float(left @ left) / (shown.size - 2) * float(np.linalg.pinv(design.T @ design)[0, 0]))
        own = self.standard_uncertainty / self.value
        return GainRatio(float(cold) / self.value, math.hypot(scatter / float(cold), own, *alike))
