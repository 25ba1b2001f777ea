"""The decrease of each axis's inductance as current saturates the iron."""

import math
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

#: Equivalent current of the magnets along d, as a share of that axis' saturation current.
MAGNET_SHARE = 0.3

Current = TypeVar("Current", float, NDArray[np.float64])


class AxisLaw(Protocol):
    """Differential inductances over the currents of both axes: of each axis alone, or with the terms between them.

    They stand in the order of the parts that a network's `axis_inertances` gives for them.
    """

    def differential_inductances(self, d_current: Current, q_current: Current) -> tuple[Current, ...]:
        """Return them (H) at currents (A, peak)."""

    @property
    def largest(self) -> tuple[float, ...]:
        """The largest (H) at any current; terms between the axes are none."""


@dataclass(frozen=True)
class Saturation:
    """Arctangent law of both axes, without cross-saturation.

    With L the inductance (H) at no current and I the saturation current (A, peak) of an axis:
    ψq = Lq·Iq·atan(iq/Iq), and ψd = λ + Ld·Id·(1 + m²)·[atan(id/Id + m) − atan m], where m = 0.3 stands for the
    magnets that fill part of the iron by themselves. A current along the magnets (id > 0) so finds less inductance than
    one against them; at no current both axes have L exactly. An infinite I is an axis that does not saturate.
    """

    d_axis_inductance: float
    q_axis_inductance: float
    d_axis_current: float
    q_axis_current: float

    def differential_inductances(self, d_current: Current, q_current: Current) -> tuple[Current, Current]:
        """Return dψd/did and dψq/diq (H) at currents (A, peak)."""
        along = d_current / self.d_axis_current + MAGNET_SHARE
        across = q_current / self.q_axis_current
        return (
            self.d_axis_inductance * (1.0 + MAGNET_SHARE**2) / (1.0 + along**2),
            self.q_axis_inductance / (1.0 + across**2),
        )

    @property
    def largest(self) -> tuple[float, float]:
        """Largest differential inductances (H) of d and q axis at any current."""
        saturates = math.isfinite(self.d_axis_current)
        return self.d_axis_inductance * (1.0 + MAGNET_SHARE**2 * saturates), self.q_axis_inductance
