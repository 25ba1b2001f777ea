"""The circuit of a motor with shorted turns: a loop of their own, in which the rest of the winding and the magnets drive a current."""

from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from sim_instruments.physics.network import Network
from sim_instruments.physics.shorted_turns import LEAKAGE
from sim_instruments.physics.windings import FloatArray


class ShortedNetwork(Network):
    """A network one of whose windings has shorted turns; their current i_s (A) comes after the loop currents.

    With μ the turns' share, the winding magnetises as a current w − μ·i_s in all of its turns would; the loop of the short itself
    obeys (μR + R_s)·i_s = μ·(R·w + dψ/dt), leakage apart.
    """

    def __init__(self, *given: Any, **more: Any) -> None:
        super().__init__(*given, **more)
        windings, own = self.windings, self.basis
        short = windings.motor.shorted_turns
        if short is None:
            raise ValueError("ShortedNetwork: the motor has no shorted turns")
        self._own = own.shape[1]
        shorted = np.zeros(3)
        shorted[short.winding] = short.share
        resistance = float(windings.resistance[short.winding])
        self._passed = short.passed_by(resistance) * (shorted > 0.0)
        self._flux_basis: FloatArray = np.hstack([own, -shorted[:, np.newaxis]])
        mutual = -(own.T @ (windings.resistance * shorted))[:, np.newaxis]
        loop = np.array([[short.share * resistance + short.resistance]])
        self.damping = np.block([[self.damping, mutual], [mutual.T, loop]])
        self.basis = np.hstack([own, np.zeros((3, 1))])
        self.drive = np.append(self.drive, 0.0)
        self._leakage = LEAKAGE * float(shorted @ windings.inductance_mean @ shorted)

    @property
    def flux_basis(self) -> FloatArray:
        """What the windings' inductances, magnets and resistances see of the loops' and the short's current (3, loops)."""
        return self._flux_basis

    @property
    def ohmic_basis(self) -> FloatArray:
        """What the windings' resistances see of these currents: in the shorted turns flows the difference."""
        return self._flux_basis

    @property
    def reach(self) -> FloatArray:
        """Directions of the currents that are free where the source's current is fixed."""
        result: FloatArray = block_diag(self._wiring.reach, np.eye(1))
        return result

    @property
    def drives_current(self) -> bool:
        """Whether the source has a path through the motor."""
        return bool(self._own) and float(self.drive @ self.drive) > 1e-12

    @cached_property
    def _inertances(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        windings, seen = self.windings, self._flux_basis
        mean, cos, sin = (
            seen.T @ part @ seen
            for part in (windings.inductance_mean, windings.inductance_cos, windings.inductance_sin)
        )
        mean[-1, -1] += self._leakage
        return mean, cos, sin

    def loop_currents(self, winding_currents: FloatArray, angle: float) -> FloatArray:
        """Return the loop currents (A) as a network without the short has them, then the short's, its share of direct current."""
        passed = float(self._passed @ winding_currents)
        if not self._own:
            return np.array([passed])
        own = self.basis[:, : self._own]
        inductance = self.windings.inductance(angle)
        loops = np.linalg.solve(own.T @ inductance @ own, own.T @ inductance @ winding_currents)
        return np.append(loops, passed)
