"""The electrical angle at which a locked rotor stands, from three bridge readings, and the current that would have brought it there."""

import cmath
import math
from typing import NamedTuple

from procedures.estimation.winding.joined_lines import JoinedLines
from procedures.estimation.winding.wiring import CONTINUITY, Kind, Mistake, Poles, currents, mistakes

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


def held_angle(read: JoinedLines) -> AxisAngle:
    """Return where a rotor stands from the inductances along phase A's axis, across it and between both."""
    double = complex(read.across - read.along, -2.0 * read.mutual)
    return AxisAngle(0.5 * cmath.phase(double), abs(double) / (0.5 * (read.along + read.across)))


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
