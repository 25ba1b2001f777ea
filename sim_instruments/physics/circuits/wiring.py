"""Consequences of the wiring alone: the loops that currents can take, and the effect of the source on them."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.linalg import null_space

from sim_instruments.physics.circuits.windings import INCIDENCE, FloatArray

#: Ways to wire a motor on one bench; more than are ever in use at a time.
_KEPT = 256


@dataclass(frozen=True)
class WindingLoops:
    """Loops of a wiring: winding currents are w = `basis`·x. All arrays are shared and read-only.

    `source` is None where it has no closed path; `plus` are the windings' shares in its current, `drive` the loops',
    `reach` the loops that are left when its current is fixed. `wires` (3, loops) are the terminals' shares in the loops, zero for
    a wire that carries no current; a resistance behind the source's + pole adds it times `behind` (loops×loops) to the loops'.
    `principal` says which there are of the loop of the source's current, the other one, and a delta's zero sequence, and gives
    their directions (loops, 3).
    """

    source: tuple[str, str] | None
    basis: FloatArray
    plus: FloatArray
    drive: FloatArray
    reach: FloatArray
    wires: FloatArray
    behind: FloatArray
    principal: tuple[tuple[bool, bool, bool], FloatArray]


@lru_cache(maxsize=_KEPT)
def wiring(connection: str, sockets: tuple[str, ...], source: tuple[str, str] | None) -> WindingLoops:
    """Return what a wiring is: the socket that each terminal meets, and the source's two sockets, + and −."""
    incidence = INCIDENCE[connection]
    groups: dict[str, list[int]] = {}
    for terminal, socket in enumerate(sockets):
        groups.setdefault(f"open {terminal}" if socket == "open" else socket, []).append(terminal)
    closed = source if source is not None and all(pole in groups for pole in source) else None
    rows = [np.ones(3)] if connection == "wye" else []
    for socket, members in groups.items():
        if closed is None or socket not in closed:
            rows.append(incidence[members].sum(axis=0))
    basis: FloatArray = null_space(np.array(rows)) if rows else np.eye(3)
    at_plus = np.zeros(3)
    if closed is not None:
        at_plus[groups[closed[0]]] = 1.0
    plus = at_plus @ incidence
    drive: FloatArray = basis.T @ plus
    joined = np.array([float(len(groups.get(socket, ())) > 1 or socket in (closed or ())) for socket in sockets])
    reach = null_space(drive[np.newaxis, :]) if len(drive) else np.zeros((0, 0))
    wires = joined[:, np.newaxis] * (incidence @ basis)
    present, directions = _principal(basis, drive)
    arrays = (basis, plus, drive, reach, wires, np.outer(drive, drive))
    for shared in (*arrays, directions):
        shared.flags.writeable = False
    return WindingLoops(closed, *arrays, (present, directions))


def _principal(basis: FloatArray, drive: FloatArray) -> tuple[tuple[bool, bool, bool], FloatArray]:
    columns = np.zeros((len(drive), 3))
    driven = float(drive @ drive) > 1e-12
    if driven:
        columns[:, 0] = drive / np.linalg.norm(drive)
    # No source drives a current that only circulates.
    zero = basis.T @ np.full(3, 1.0 / np.sqrt(3.0))
    circulates = bool(zero @ zero > 1.0 - 1e-9)
    if circulates:
        columns[:, 2] = zero
    others = null_space(columns.T, rcond=1e-9) if len(drive) else columns[:, :0]
    if others.shape[1]:
        columns[:, 1] = others[:, 0]
    return (driven, bool(others.shape[1]), circulates), columns
