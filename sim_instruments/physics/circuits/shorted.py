"""The circuit of a motor with shorted turns: a loop of their own, in which the rest of the winding and the magnets drive a current."""

from functools import cached_property
from typing import Any

import numpy as np

from sim_instruments.physics.circuits.coupled import CoupledNetwork
from sim_instruments.physics.circuits.windings import FloatArray, Windings
from sim_instruments.physics.motor.shorted_turns import LEAKAGE


class ShortedNetwork(CoupledNetwork):
    """A network one of whose windings has shorted turns, in which a current i_s (A) flows.

    With μ the turns' share, the winding magnetises as a current w − μ·i_s in all of its turns would; the loop of the short itself
    obeys (μR + R_s)·i_s = μ·(R·w + dψ/dt), leakage apart.
    """

    def __init__(self, windings: Windings, *given: Any, **more: Any) -> None:
        short = windings.motor.shorted_turns
        if short is None:
            raise ValueError("ShortedNetwork: the motor has no shorted turns")
        shorted = np.zeros(3)
        shorted[short.winding] = short.share
        super().__init__(windings, *given, coupling=-shorted[:, np.newaxis], **more)
        resistance = float(windings.resistance[short.winding])
        self._passed = short.passed_by(resistance) * (shorted > 0.0)
        mutual = -(self.own_basis.T @ (windings.resistance * shorted))[:, np.newaxis]
        loop = np.array([[short.share * resistance + short.resistance]])
        self.damping = np.block([[self.damping, mutual], [mutual.T, loop]])
        self._leakage = LEAKAGE * float(shorted @ windings.inductance_mean @ shorted)

    @property
    def ohmic_basis(self) -> FloatArray:
        """The part of these currents that flows in the windings' resistances: in the shorted turns flows the difference."""
        return self.flux_basis

    @cached_property
    def _inertances(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        mean, cos, sin = super()._inertances
        mean[-1, -1] += self._leakage
        return mean, cos, sin

    def first_currents(self, winding_currents: FloatArray) -> FloatArray:
        """Return the short's share (A) of direct currents in the windings."""
        return np.array([float(self._passed @ winding_currents)])
