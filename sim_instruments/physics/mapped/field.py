"""The capability of a rotating field if the fluxes follow a law of both currents."""

import numpy as np

from sim_instruments.physics.circuits.windings import FloatArray
from sim_instruments.physics.field import Synchronous
from sim_instruments.physics.mapped.windings import MappedWindings


class MappedSynchronous(Synchronous):
    """Pull-out torque, load angle and voltage of a rotating field of an `amplitude` (A, peak), by the law's fluxes.

    The iron's loss brakes the shaft apart from this.
    """

    def __init__(self, windings: MappedWindings, amplitude: float) -> None:
        self._windings = windings
        motor = windings.motor
        super().__init__(
            windings.resistance_y,
            motor.d_axis_inductance_y,
            motor.q_axis_inductance_y,
            windings.flux_linkage_y,
            motor.pole_pairs,
            amplitude,
        )

    def _torque(self, load_angle: FloatArray) -> FloatArray:
        current = self._amplitude * np.exp(1j * load_angle)
        flux = self._windings.flux_linkages_y(current, np.zeros_like(load_angle))
        result: FloatArray = 1.5 * self._p * (flux.conj() * current).imag
        return result

    def voltage(self, electrical_speed: float, torque: float) -> float:
        """Return the phase voltage (V, peak) that the current takes at an electrical speed (rad/s) and torque (N·m)."""
        current = np.array([self._amplitude * np.exp(1j * self.load_angle(abs(torque)))])
        speed = np.array([abs(electrical_speed)])
        flux = self._windings.flux_linkages_y(current, speed)
        return float(np.abs(self._resistance * current + 1j * speed * flux)[0])
