"""The direct-current resistance between two points of the bench's wiring, as an ohmmeter's test current meets it."""

import math
from collections.abc import Sequence

import numpy as np

from sim_instruments.physics.circuits.network import Network
from sim_instruments.world.constants import BRIDGE_POLES, SUPPLY_POLES
from sim_instruments.world.impedance import SOURCE_RESISTANCE

#: A wire without resistance (Ω) would make the equations singular.
_LEAST = 1e-9

Resistor = tuple[str, str, float]


def direct_resistance(network: Network, first: str, second: str, *, stiff: bool, bridge: bool) -> float:
    """Return the resistance (Ω) between two nodes of a wiring at rest, infinite where nothing connects them.

    Nodes are the motor's own terminals A, B, C and the sockets that they meet. `stiff` says that the supply holds its voltage: it
    is then its own resistance; an output that impresses a current, or is off, is open. `bridge` says that the bridge's leads are on.
    """
    wires = [
        (terminal, socket, max(float(resistance), _LEAST))
        for terminal, socket, resistance in zip("ABC", network.sockets, network.wire_resistances, strict=True)
        if socket != "open"
    ]
    resistors = [*_windings(network), *wires]
    if stiff:
        resistors.append((*SUPPLY_POLES, max(network.source_resistance, _LEAST)))
    if bridge:
        resistors.append((*BRIDGE_POLES, SOURCE_RESISTANCE))
    return _between(resistors, first, second)


def _windings(network: Network) -> list[Resistor]:
    windings = network.windings
    result = []
    for number, resistance in enumerate(windings.motor.without_short.resistances_at(windings.temperature)):
        ends = [label for label, share in zip("ABC", windings.incidence[:, number], strict=True) if share]
        first, second = (*ends, "N")[:2]
        result.append((first, second, resistance))
    return result


def _between(resistors: Sequence[Resistor], first: str, second: str) -> float:
    reached, grown = {first}, True
    while grown:
        nodes = {node for one in resistors if {*one[:2]} & reached for node in one[:2]}
        grown = not nodes <= reached
        reached |= nodes
    if second not in reached:
        return math.inf
    others = sorted(reached - {second})
    conductance = np.zeros((len(others), len(others)))
    for one, other, resistance in resistors:
        places = [(others.index(node), sign) for node, sign in ((one, 1.0), (other, -1.0)) if node in others]
        for row, sign in places:
            for column, opposite in places:
                conductance[row, column] += sign * opposite / resistance
    drive = np.array([float(node == first) for node in others])
    return float(drive @ np.linalg.solve(conductance, drive))
