"""A winding network with further closed circuits: shorted turns, or the paths of eddy currents in the iron."""

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from sim_instruments.physics.circuits.network import Network
from sim_instruments.physics.circuits.windings import FloatArray, Windings


class CoupledNetwork(Network, ABC):
    """A network whose windings are coupled to closed circuits that no terminal reaches; their currents come after the loop currents.

    The windings are magnetised as by winding currents w + coupling·c, with `coupling` (3, circuits) and the circuits' currents c.
    """

    def __init__(self, windings: Windings, *given: Any, coupling: FloatArray, **more: Any) -> None:
        super().__init__(windings, *given, **more)
        own, circuits = self.basis, coupling.shape[1]
        self._own, self._circuits = own.shape[1], circuits
        self._flux_basis: FloatArray = np.hstack([own, coupling])
        self.basis = np.hstack([own, np.zeros((3, circuits))])
        self.drive = np.concatenate([self.drive, np.zeros(circuits)])

    @property
    def flux_basis(self) -> FloatArray:
        """The part of the currents of loops and circuits that flows in the windings' inductances (3, loops)."""
        return self._flux_basis

    @property
    def own_basis(self) -> FloatArray:
        """The basis of the loops that the network has without the circuits."""
        return self.basis[:, : self._own]

    @property
    def reach(self) -> FloatArray:
        """Directions of the currents that are free where the source's current is fixed."""
        return block_diag(self._wiring.reach, np.eye(self._circuits))

    def loop_currents(self, winding_currents: FloatArray, angle: float) -> FloatArray:
        """Return the loop currents (A) as a network without the circuits has them, and the circuits' currents after them."""
        first = self.first_currents(winding_currents)
        if not self._own:
            return first
        own, inductance = self.own_basis, self.windings.inductance(angle)
        loops = np.linalg.solve(own.T @ inductance @ own, own.T @ inductance @ winding_currents)
        return np.concatenate([loops, first])

    @abstractmethod
    def first_currents(self, winding_currents: FloatArray) -> FloatArray:
        """Return the currents (A) that the circuits begin with, at given winding currents."""
