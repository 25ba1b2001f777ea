"""Errors that all rows of a short circuit's table share: the instruments' limits, the flux linkage, the phase that was probed."""

import math
from dataclasses import dataclass

import numpy as np

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.flux.flux_map import MapFigure
from procedures.estimation.flux.short_currents import CurrentSamples

#: Kinds of figures, by what shared errors do to them.
RESISTANCE, INDUCTANCE, Q_INDUCTANCE, LIMIT = "resistance", "inductance", "q-inductance", "limit"
#: Ends and middle of a 95 % interval.
_SHARES = (0.025, 0.5, 0.975)
#: The same table gives the same figures.
_SEED = 2


@dataclass(frozen=True)
class ShortLimits:
    """Half-widths (rectangular), relative: of the gains of current, speed and torque, of what the probed phase's current differs from the
    mean of three (`unequal`), and of what L_q differs from the figure because inductances depend on the current (`saturation`); of the
    torque's zero in N·m. All rows share them.
    """

    current: float = 0.0
    unequal: float = 0.0
    speed: float = 0.0
    torque: float = 0.0
    torque_zero: float = 0.0
    saturation: float = 0.0

    @property
    def of_torque(self) -> float:
        """Largest relative error that gains give the resistance by torque, T·ω over 1.5·I²."""
        return math.sqrt(self.torque**2 + (2.0 * self.current) ** 2 + (2.0 * self.unequal) ** 2)


@dataclass(frozen=True)
class SharedErrors:
    """The limits with the flux linkage's standard uncertainty (relative), as they act on figures.

    With currents read e^g, speeds e^s, torques e^t and the flux linkage taken e^l times as large as they are, the currents show R·e^(l−g+s)
    and L·e^(l−g); the torques beside them show a resistance e^(t−g−l) times that of the currents, which a fit of both finds.
    """

    limits: ShortLimits
    flux: float = 0.0

    @property
    def offset(self) -> float:
        """Standard deviation of ln(R by torque/R by currents) through gains."""
        return math.sqrt((self.limits.torque**2 + self.limits.current**2) / 3.0 + self.flux**2)

    def figure(self, kind: str, logarithms: FloatArray, scale: float, told: CurrentSamples) -> MapFigure:
        """Return the figure `scale`·exp(logarithms) with its 95 % interval, of samples (n,) of what the rows told."""
        limits, random = self.limits, np.random.default_rng(_SEED)
        count = logarithms.size
        g, s, t = (random.uniform(-each, each, count) for each in (limits.current, limits.speed, limits.torque))
        off = self.flux * random.standard_normal(count)
        share = 0.0
        common = g - off
        if np.any(told.others["offset"]):
            # What of the offset between both resistances is the flux linkage's and not the current's gain.
            share = (self.flux**2 - limits.current**2 / 3.0) / self.offset**2
            common = common + share * (told.others["offset"] - (t - g - off))
        bent = random.uniform(-limits.saturation, limits.saturation, count)
        moved = logarithms + {RESISTANCE: common - s, INDUCTANCE: common, Q_INDUCTANCE: common + bent, LIMIT: -g}[kind]
        low, middle, high = (scale * math.exp(float(each)) for each in np.quantile(moved, _SHARES))
        parts = {
            "current": (1.0 + share) * limits.current,
            "flux_linkage": math.sqrt(3.0) * (1.0 - share) * self.flux,
            "torque": abs(share) * limits.torque,
            "speed": limits.speed if kind == RESISTANCE else 0.0,
            "saturation": limits.saturation if kind == Q_INDUCTANCE else 0.0,
        }
        if kind == LIMIT:
            parts = {"current": limits.current}
        return MapFigure(
            middle,
            middle * float(np.std(moved)),
            (low, high),
            scatter=middle * float(np.std(logarithms)),
            shared={name: middle * limit for name, limit in parts.items() if limit > 0.0},
        )
