"""Error of an inductance reading if the rotor is not exactly on d or q (§3.3.3)."""

import math
from typing import NamedTuple

from procedures.estimation.fitting.fit import EstimationError

_ROUNDS = 50
#: sin 2δ beyond this is no misalignment any more but another position.
_LARGEST_SINE = 0.7


class Held(NamedTuple):
    """One locked position: `reading` (H) of A against B and C without the loop that these close, and AB less CA, `difference` (H)."""

    reading: float
    difference: float


class Excess(NamedTuple):
    """By how much the readings (H) are more than those exactly on d and q, and the angles off (rad, electrical)."""

    d: float
    q: float
    angle_d: float
    angle_q: float


def excess(d: Held, q: Held) -> Excess:
    """Return what the angles off d and q add to both readings: off by δ, AB less CA is √3·(Lq − Ld)·sin 2δ of a phase, and the axis read
    has (Lq − Ld)·sin² δ of the other one.

    Raises EstimationError where there is no saliency to tell an angle by, or the rotor rests somewhere else.
    """
    read = d.reading / 1.5, q.reading / 1.5
    saliency = read[1] - read[0]
    more = (0.0, 0.0)
    angles = (0.0, 0.0)
    for _ in range(_ROUNDS):
        if not saliency > 0.0:
            raise EstimationError(
                "the inductance on q is not above that on d: there is no saliency to tell an angle by"
            )
        sines = [held.difference / (math.sqrt(3.0) * saliency) for held in (d, q)]
        if max(abs(sine) for sine in sines) > _LARGEST_SINE:
            raise EstimationError("the lines' readings do not fit a rotor that rests near d and q; align it again")
        angles = 0.5 * math.asin(sines[0]), 0.5 * math.asin(sines[1])
        before = saliency
        more = saliency * math.sin(angles[0]) ** 2, -saliency * math.sin(angles[1]) ** 2
        saliency = read[1] - more[1] - read[0] + more[0]
        if abs(saliency - before) < 1e-9 * read[0]:
            break
    return Excess(1.5 * more[0], 1.5 * more[1], *angles)
