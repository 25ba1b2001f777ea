"""How far a hand pulls an energised shaft until it feels it drawn on to the next position."""

import math

import numpy as np

from sim_instruments.parts import Parts
from sim_instruments.physics.windings import Windings
from sim_instruments.segment import State
from sim_instruments.settings import Settings


def distance_to_next(parts: Parts, settings: Settings, state: State, direction: int) -> float | None:
    """Return the way (rad, mechanical) from here to where the next stable position clearly draws the shaft on.

    None where no direct current holds the shaft. Cogging is not felt against the current's torque.
    """
    if not settings.supply.on or settings.supply.tripped is not None:
        return None
    windings = Windings(parts.motor, state.temperature)
    network = parts.network(windings, settings, supplied=True)
    if not network.drives_current:
        return None
    loops = np.linalg.solve(network.damping, network.drive)
    supplied = min(settings.supply.voltage, settings.supply.current_limit / float(network.drive @ loops))
    currents = network.basis @ loops * supplied
    period = 2.0 * math.pi / windings.pole_pairs
    way = np.linspace(0.0, 2.0 * period, 2881)
    angles = (state.angle + direction * way) * windings.pole_pairs
    # Seen along the way, a positive pull draws the shaft on and a negative one back.
    pull = direction * windings.torque(angles, np.repeat(currents[:, np.newaxis], len(way), axis=1))
    strongest = float(pull.max())
    if strongest <= 0.0:
        return None
    tops = np.nonzero((pull[:-1] <= 0.0) & (pull[1:] > 0.0))[0]
    # A shaft held a little short of its position still belongs to it: the first top a quarter period away counts.
    over = next((int(top) for top in tops if way[top] > 0.05 * period), None)
    if over is None:
        return None
    friction = parts.shaft(settings).coulomb_friction + parts.motor.cogging_torque
    felt = np.nonzero(pull[over:] >= min(2.0 * friction + 0.1 * strongest, 0.98 * strongest))[0]
    return float(way[over + int(felt[0])])
