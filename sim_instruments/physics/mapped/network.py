"""A winding network whose fluxes follow a law of both currents."""

import numpy as np

from sim_instruments.physics.circuits.network import Network
from sim_instruments.physics.circuits.small import solve_small
from sim_instruments.physics.circuits.windings import FloatArray
from sim_instruments.physics.mapped.windings import MappedWindings
from sim_instruments.physics.motor.flux_law import CrossSaturation, LinearFlux
from sim_instruments.physics.motor.saturation import AxisLaw

_STEPS, _ENOUGH = 50, 1e-13


class MappedNetwork(Network):
    """A network of windings that follow a flux map, or whose iron loses; the present state's own currents count everywhere."""

    windings: MappedWindings

    def _axis_law(self, held: bool) -> AxisLaw | None:
        # Iron loses nothing while the rotor stands: constants stay constants.
        return None if isinstance(self.windings.law, LinearFlux) else CrossSaturation(self.windings.law)

    def flux(self, loops: FloatArray, angle: float) -> FloatArray:
        """Return the flux linkages (V·s, (loops,)) of the loops at loop currents (A), the rotor standing at an electrical angle."""
        return self.basis.T @ self.windings.flux(angle, self.basis @ loops)

    def loop_currents(self, winding_currents: FloatArray, angle: float) -> FloatArray:
        """Return the loop currents (A) into which given winding currents fall when this network is joined: flux in its loops stays."""
        loops: FloatArray = self.basis.T @ winding_currents
        if not self.loops:
            return loops
        if np.abs(self.basis @ loops - winding_currents).max() <= _ENOUGH * np.abs(winding_currents).max(initial=0.0):
            # Nothing changes; the columns of a basis are unit vectors.
            return loops
        wanted = self.basis.T @ self.windings.flux(angle, winding_currents)
        scale = _ENOUGH * max(float(np.abs(wanted).max()), abs(self.windings.flux_linkage))
        error = wanted - self.flux(loops, angle)
        for _ in range(_STEPS):
            if float(np.abs(error).max()) <= scale:
                break
            step, share = solve_small(self.differential_inertance(loops, angle), error), 1.0
            size = float(np.abs(error).max())
            while share > 1e-6:
                error = wanted - self.flux(loops + share * step, angle)
                if float(np.abs(error).max()) < size:
                    break
                share *= 0.5
            loops = loops + share * step
        return loops

    def voltage_for_constant_current(self, loops: FloatArray, angle: float, electrical_speed: float) -> float:
        """Return the source voltage (V) at which its current would not change, for given loop currents and rotor."""
        windings, at, still = self.windings, np.array([angle]), np.zeros((3, 1))
        currents = (self.basis @ loops)[:, np.newaxis]
        # What the windings drop where no current changes, resistance apart.
        turning = (
            windings.drops(at, np.array([electrical_speed]), currents, still)[:, 0]
            - windings.resistance * currents[:, 0]
        )
        left = -self.damping @ loops - self.basis.T @ turning
        return self._constant_by(loops, angle, left)
