"""Parts of a six-step BLDC drive: machine, bridge and source."""

import math
from dataclasses import dataclass, fields
from typing import Literal


class SixStepError(ValueError):
    """A drive or an operating point that cannot be solved, and why."""


@dataclass(frozen=True)
class EmfHarmonic:
    """A harmonic of a winding's EMF, relative to its fundamental k·ω·cos(φ).

    It adds k·ω·amplitude·cos(order·φ + phase); phase in rad. The order is odd: an even one would break
    the half-wave symmetry on which six-step commutation rests.
    """

    order: int
    amplitude: float
    phase: float = 0.0


@dataclass(frozen=True)
class SixStepDrive:
    """A permanent-magnet machine on a three-phase bridge in 120° six-step conduction with Hall commutation (§7).

    Windings: resistance in Ω, self- and mutual inductance in H, `emf_constant` the peak EMF of one winding (delta) or
    phase (wye) in V/(rad/s) of mechanical speed. Mechanics: kg·m², N·m and N·m/(rad/s). Bridge: `switch_resistance`
    in Ω, conducting both ways, and `diode_drop` in V, constant. Source: `source_voltage` in V behind
    `source_resistance` in Ω; it takes current back as it gives it. `advance_angle` in electrical rad commutates earlier
    when positive, later when negative.

    Raises SixStepError when a value is outside its physical range.
    """

    connection: Literal["delta", "wye"]
    resistance: float
    self_inductance: float
    mutual_inductance: float
    emf_constant: float
    pole_pairs: int
    source_voltage: float
    source_resistance: float
    switch_resistance: float
    diode_drop: float
    inertia: float
    coulomb_friction: float = 0.0
    viscous_friction: float = 0.0
    emf_harmonics: tuple[EmfHarmonic, ...] = ()
    advance_angle: float = 0.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, float) and not math.isfinite(value):
                raise SixStepError(f"{field.name} is {value}: a finite number is needed")
        for name in ("resistance", "self_inductance", "emf_constant", "source_voltage", "inertia"):
            if getattr(self, name) <= 0:
                raise SixStepError(f"{name} is {getattr(self, name):g}: it must be greater than 0")
        for name in ("source_resistance", "switch_resistance", "diode_drop", "coulomb_friction", "viscous_friction"):
            if getattr(self, name) < 0:
                raise SixStepError(f"{name} is {getattr(self, name):g}: it must be 0 or greater")
        if self.connection not in ("delta", "wye"):
            raise SixStepError(f'connection is "{self.connection}": "delta" or "wye" is allowed')
        if self.pole_pairs < 1:
            raise SixStepError(f"pole_pairs is {self.pole_pairs}: it must be 1 or more")
        if not -0.5 * self.self_inductance < self.mutual_inductance < self.self_inductance:
            raise SixStepError(
                f"mutual_inductance is {self.mutual_inductance:g} H with a self_inductance of "
                f"{self.self_inductance:g} H: the inductance matrix is positive definite only for "
                f"{-0.5 * self.self_inductance:g} H < mutual_inductance < {self.self_inductance:g} H"
            )
        if abs(self.advance_angle) >= math.pi / 2:
            raise SixStepError(
                f"advance_angle is {math.degrees(self.advance_angle):g}° electrical: it must lie within ±90°"
            )
        self._check_harmonics()

    def _check_harmonics(self) -> None:
        seen: set[int] = set()
        for harmonic in self.emf_harmonics:
            order = harmonic.order
            if order < 3 or order % 2 == 0:
                raise SixStepError(f"emf_harmonics holds order {order}: odd orders from 3 are allowed")
            if order in seen:
                raise SixStepError(f"emf_harmonics holds order {order} twice: give each order once")
            if not (math.isfinite(harmonic.amplitude) and math.isfinite(harmonic.phase)):
                raise SixStepError(f"emf_harmonics, order {order}: amplitude and phase must be finite numbers")
            seen.add(order)

    def friction_torque(self, speed: float) -> float:
        """Torque lost in the bearings, N·m, at a mechanical speed above 0 in rad/s."""
        return self.coulomb_friction + self.viscous_friction * speed
