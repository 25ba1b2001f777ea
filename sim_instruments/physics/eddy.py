"""A circuit whose windings are coupled to eddy currents in the iron."""

from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from sim_instruments.physics.network import Network
from sim_instruments.physics.windings import FloatArray


class EddyNetwork(Network):
    """A network beside each of whose windings lies a shorted one: a ladder of resistance and inductance.

    The shorted windings have the windings' own inductances L(θ), a resistance each, and share the part k of the flux:
    L·(w + k·e)' + R·w = u and L·(e + k·w)' + Rₑ·e = 0. Their three currents e (A) come after the loop currents; `eddy_currents` are
    those that the circuit begins with.
    """

    def __init__(self, *given: Any, eddy_currents: FloatArray | None = None, **more: Any) -> None:
        super().__init__(*given, **more)
        iron, own = self.windings.motor.iron, self.basis
        self._own = own.shape[1]
        self._begin = np.zeros(3) if eddy_currents is None else eddy_currents
        coupling = iron.eddy_coupling * np.eye(3)
        self._flux_basis: FloatArray = np.hstack([own, coupling])
        self._shorted: FloatArray = np.hstack([iron.eddy_coupling * own, np.eye(3)])
        self.damping = block_diag(self.damping, iron.eddy_resistance * np.eye(3))
        self.basis = np.hstack([own, np.zeros((3, 3))])
        self.drive = np.concatenate([self.drive, np.zeros(3)])

    @property
    def flux_basis(self) -> FloatArray:
        """What the windings' inductances see of loop and eddy currents (3, loops)."""
        return self._flux_basis

    @property
    def reach(self) -> FloatArray:
        """Directions of the currents that are free where the source's current is fixed."""
        result: FloatArray = block_diag(self._wiring.reach, np.eye(3))
        return result

    @property
    def drives_current(self) -> bool:
        """Whether the source has a path through the motor."""
        return bool(self._own) and float(self.drive @ self.drive) > 1e-12

    @cached_property
    def _inertances(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        windings, own = self.windings, self.basis[:, : self._own]
        mean, cos, sin = (
            np.vstack([own.T @ part @ self._flux_basis, part @ self._shorted])
            for part in (windings.inductance_mean, windings.inductance_cos, windings.inductance_sin)
        )
        return mean, cos, sin

    def loop_currents(self, winding_currents: FloatArray, angle: float) -> FloatArray:
        """Return the loop currents (A) as a network without iron has them, and the eddy currents after them."""
        if not self._own:
            return self._begin
        own = self.basis[:, : self._own]
        inductance = self.windings.inductance(angle)
        loops = np.linalg.solve(own.T @ inductance @ own, own.T @ inductance @ winding_currents)
        return np.concatenate([loops, self._begin])
