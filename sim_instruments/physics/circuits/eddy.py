"""A circuit whose windings are coupled to eddy currents in the iron."""

from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from sim_instruments.physics.circuits.coupled import CoupledNetwork
from sim_instruments.physics.circuits.windings import FloatArray, Windings


class EddyNetwork(CoupledNetwork):
    """A network beside each of whose windings lies a shorted one: a ladder of resistance and inductance.

    The shorted windings have the windings' own inductances L(θ), a resistance each, and share the part k of the flux:
    L·(w + k·e)' + R·w = u and L·(e + k·w)' + Rₑ·e = 0, with their three currents e (A); `eddy_currents` are those that the circuit
    begins with.
    """

    def __init__(self, windings: Windings, *given: Any, eddy_currents: FloatArray | None = None, **more: Any) -> None:
        iron = windings.motor.iron
        super().__init__(windings, *given, coupling=iron.eddy_coupling * np.eye(3), **more)
        self._begin = np.zeros(3) if eddy_currents is None else eddy_currents
        self._shorted: FloatArray = np.hstack([iron.eddy_coupling * self.own_basis, np.eye(3)])
        self.damping = block_diag(self.damping, iron.eddy_resistance * np.eye(3))

    @cached_property
    def _inertances(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        windings, own = self.windings, self.own_basis
        mean, cos, sin = (
            np.vstack([own.T @ part @ self.flux_basis, part @ self._shorted])
            for part in (windings.inductance_mean, windings.inductance_cos, windings.inductance_sin)
        )
        return mean, cos, sin

    def first_currents(self, winding_currents: FloatArray) -> FloatArray:
        """Return the eddy currents (A) that the circuit begins with."""
        return self._begin
