"""Error of an inductance reading if the rotor is not exactly on d or q (§3.3.3)."""

import math
from typing import NamedTuple

from procedures.estimation.fitting.fit import EstimationError

_ROUNDS = 50
#: sin 2δ beyond this is no misalignment any more but another position.
_LARGEST_SINE = 0.7


class Held(NamedTuple):
    """One locked position: `reading` (H) of A against B and C, `resistance` (Ω) of that loop, and AB less CA, `difference` (H)."""

    reading: float
    resistance: float
    difference: float


class Excess(NamedTuple):
    """By how much the readings (H) are more than those exactly on d and q, and the angles off (rad, electrical)."""

    d: float
    q: float
    angle_d: float
    angle_q: float


def excess(d: Held, q: Held, angular: float) -> Excess:
    """Return what the angles off d and q add to both readings at a test frequency (rad/s).

    Off by δ, AB less CA is √3·(Lq − Ld)·sin 2δ of a phase; and A against B and C couples into the loop of B and C, which is
    closed: L = Lαα − κ·Lαβ²/Lββ with κ = (ωLββ)²/(R² + (ωLββ)²). Raises EstimationError where there is no saliency to tell an
    angle by, or the rotor rests somewhere else.
    """
    read = d.reading / 1.5, q.reading / 1.5
    resistance = 0.5 * (d.resistance + q.resistance) / 1.5
    ld, lq = read
    more = (0.0, 0.0)
    angles = (0.0, 0.0)
    for _ in range(_ROUNDS):
        saliency = lq - ld
        if not saliency > 0.0:
            raise EstimationError(
                "the inductance on q is not above that on d: there is no saliency to tell an angle by"
            )
        sines = [held.difference / (math.sqrt(3.0) * saliency) for held in (d, q)]
        if max(abs(sine) for sine in sines) > _LARGEST_SINE:
            raise EstimationError("the lines' readings do not fit a rotor that rests near d and q; align it again")
        angles = 0.5 * math.asin(sines[0]), 0.5 * math.asin(sines[1])
        before = more
        more = (
            _more(ld, lq, angles[0], resistance, angular),
            _more(lq, ld, angles[1], resistance, angular),
        )
        ld, lq = read[0] - more[0], read[1] - more[1]
        if max(abs(more[0] - before[0]), abs(more[1] - before[1])) < 1e-9 * ld:
            break
    return Excess(1.5 * more[0], 1.5 * more[1], *angles)


def _more(here: float, across: float, angle: float, resistance: float, angular: float) -> float:
    """Return what an angle off adds to a phase's inductance `here`, the other axis having `across` (H)."""
    share = math.sin(angle) ** 2
    own = (across - here) * share
    loop = across - own
    coupling = (across - here) * math.sin(angle) * math.cos(angle)
    reactance = (angular * loop) ** 2
    return own - coupling**2 / loop * reactance / (resistance**2 + reactance)
