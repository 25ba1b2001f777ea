"""Cogging whose amplitude changes along a part of a turn, and the resulting uncertainty for the rest of the turn."""

import math

import numpy as np

from procedures.estimation.fitting.misfit import ALARM, Answer, Cause, Finding
from procedures.estimation.mechanics.cogging_spectrum import OrderFit, Orders, Turn, standing

#: What chance makes of the square of a score that nothing is behind, and this much more, does not count.
_CHANCE = 2.5


def modulated(turn: Turn, orders: Orders, solved: OrderFit) -> tuple[float, list[Finding]]:
    """Return by which share (standard uncertainty) the cogging of the whole turn may differ from that of the part turned, and what is told.

    What an eccentric rotor or a gear does comes once a turn: of a wave that a part of a turn shows rising, the height is not known but is
    of the size of its rise over a radian. Long before that rise is beyond chance the part may be a tenth off.
    """
    stand = standing(solved.phasors, solved.axis, orders)
    if orders.whole or not np.any(stand):
        return 0.0, []
    kept = turn.counting
    wave = np.real(solved.phasors[stand] @ np.exp(1j * np.outer(orders.orders[stand], turn.angle)))
    row = wave * turn.along
    across = row[kept] - (solved.basis @ row) @ solved.basis[:, kept]
    square = float(across @ across)
    if square <= 1e-6 * float(row[kept] @ row[kept]):
        return 0.0, []
    along = float(across @ solved.left[kept])
    freedom = max(int(np.sum(kept)) - solved.basis.shape[0] - 1, 1)
    noise = math.sqrt(max((solved.square - along**2 / square) / freedom, turn.resolution**2 / 12.0, 1e-300))
    rise, z = along / square, abs(along) / math.sqrt(square) / noise
    # From the middle of the part to its end, rad.
    half = 0.5 * abs(float(turn.angle[-1] - turn.angle[0]))
    share = min(abs(rise) / min(half, 1.0), 1.0) * math.sqrt(max(0.0, 1.0 - _CHANCE / z**2)) if z else 0.0
    if z <= ALARM:
        return share, []
    figures: dict[str, float | str] = {"record": "cogging", "share": 2.0 * abs(rise)}
    return share, [Finding(Cause.MODULATED, Answer.WIDENED, score=z, figures=figures)]
