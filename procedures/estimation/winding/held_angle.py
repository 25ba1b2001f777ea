"""The electrical angle at which a locked rotor stands, from three bridge readings, and the current that would have brought it there."""

import cmath
import math
from typing import NamedTuple

from procedures.estimation.winding.wiring import CONTINUITY, Kind, Mistake, Poles, currents, mistakes

_ROUNDS = 30
#: A current's angle explains a rotor within this (rad, electrical); less saliency than this share of the inductance tells none.
_NEAR, _TELLING = math.radians(14.0), 0.02


class AxisAngle(NamedTuple):
    """Angle (rad, electrical, −π/2 … π/2) of the d axis from phase A's axis, and saliency Lq − Ld over their mean."""

    angle: float
    saliency: float

    @property
    def telling(self) -> bool:
        """True if the saliency is large enough to determine an angle."""
        return self.saliency > _TELLING


def held_angle(reading: float, ab: float, ca: float, resistance: float, angular: float) -> AxisAngle:
    """Return where a rotor stands from A against B and C, AB and CA (H), and the first one's resistance (Ω), at a frequency (rad/s).

    AB and CA are 1.5·Lαα ∓ √3·Lαβ + 0.5·Lββ; A against B and C is 1.5·(Lαα − κ·Lαβ²/Lββ), B and C being a closed loop, with
    κ = (ωLββ)²/(R² + (ωLββ)²).
    """
    across = (ca - ab) / (2.0 * math.sqrt(3.0))
    along, other = reading / 1.5, ab + ca - 2.0 * reading
    for _ in range(_ROUNDS):
        other = max(ab + ca - 3.0 * along, 1e-3 * along)
        reactance = (angular * other) ** 2
        along = reading / 1.5 + across**2 / other * reactance / ((resistance / 1.5) ** 2 + reactance)
    double = complex(other - along, -2.0 * across)
    return AxisAngle(0.5 * cmath.phase(double), abs(double) / (0.5 * (along + other)))


def current_angle(poles: Poles) -> float | None:
    """Return the angle (rad, electrical) of the current's space vector from phase A's axis; None without a path."""
    shares = currents((1.0, 1.0, 1.0), poles)
    if shares is None:
        return None
    vector = sum(share * cmath.exp(2j * math.pi / 3.0 * k) for k, share in enumerate(shares))
    return cmath.phase(vector)


def explaining(stands: AxisAngle, told: Poles, *, continuous: bool) -> list[Mistake]:
    """Return the mistakes of wiring that would have brought the rotor to where it stands; no mistake goes before all others.

    A magnet's two directions read the same. `continuous` excludes mistakes that break or add continuity. Empty where nothing
    explains it.
    """
    found = []
    for mistake in mistakes(told):
        angle = current_angle(mistake.poles)
        if angle is None or mistake.kind is Kind.TOUCHING or (continuous and mistake.kind in CONTINUITY):
            continue
        if abs(math.remainder(stands.angle - angle, math.pi)) < _NEAR:
            found.append(mistake)
    return found[:1] if found and found[0].kind is Kind.NONE else found
