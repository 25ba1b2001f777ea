"""Currents and voltages of a rotor that is turned from outside: a phasor for each harmonic of the EMF."""

import numpy as np

from sim_instruments.physics.circuits.network import Network, modes
from sim_instruments.physics.circuits.source import Source, VoltageSource
from sim_instruments.physics.circuits.windings import FloatArray, turned
from sim_instruments.physics.motion.motion import Motion


class Rotating:
    """Steady-state currents at the present speed; exact for open terminals, and for a delta's circulating current.

    Closed paths carry what the EMF drives through resistance and the inductance averaged over a turn; the transient
    on entering, and saliency, are left out.
    """

    def __init__(self, network: Network, motion: Motion, source: Source) -> None:
        self.network = network
        self.motion = motion
        self.source = source
        reach, offset, force, _ = network.imposed(source)
        self._rates, shapes = modes(reach.T @ network.damping @ reach, reach.T @ network.mean_inertance @ reach)
        self._shapes = reach @ shapes
        self._direct = offset + self._shapes @ (self._shapes.T @ force / self._rates)
        # Harmonics that the closed paths do not see at all drive nothing.
        phasors = self._shapes.T @ (network.flux_basis.T @ network.windings.emf_phasors)
        driving = np.any(np.abs(phasors) > 1e-12 * abs(network.windings.flux_linkage), axis=0)
        self._orders = tuple(
            order for order, drives in zip(network.windings.emf_orders, driving, strict=True) if drives
        )
        self._phasors = phasors[:, driving]

    def _currents(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return loop currents and their slopes, shapes (loops, n)."""
        currents = np.repeat(self._direct[:, np.newaxis], len(times), axis=1)
        slopes = np.zeros_like(currents)
        if not self._orders:
            return currents, slopes
        pole_pairs = self.network.windings.pole_pairs
        speed = self.motion.speed(times) * pole_pairs
        turning = turned(self.motion.angle(times) * pole_pairs, self._orders)
        iron = self.network.windings.motor.iron
        for order, emf, turn in zip(self._orders, self._phasors.T, turning, strict=True):
            frequency = 1j * order * speed
            if iron.lowers_emf:
                turn = turn * self._share(speed, order)
            modal = -emf[:, np.newaxis] * (speed * turn) / (self._rates[:, np.newaxis] + frequency)
            currents += self._shapes @ modal.real
            slopes += self._shapes @ (frequency * modal).real
        return currents, slopes

    def winding_currents(self, times: FloatArray) -> FloatArray:
        """Return the winding currents (A, shape (3, n))."""
        return self.network.basis @ self._currents(times)[0]

    def magnetising_currents(self, times: FloatArray) -> FloatArray:
        """Return the currents (A, shape (3, n)) that, in all turns of the windings, would magnetise as the real ones do."""
        return self.network.flux_basis @ self._currents(times)[0]

    def drops(self, times: FloatArray) -> FloatArray:
        """Return the voltage drops (V, shape (3, n)) along the windings."""
        windings = self.network.windings
        result: FloatArray = self._emf(times)
        if self.network.loops:
            currents, slopes = self._currents(times)
            result = result + windings.resistance[:, np.newaxis] * (self.network.ohmic_basis @ currents)
            result = result + windings.inductance_mean @ (self.network.flux_basis @ slopes)
        return result

    def source_voltage(self, times: FloatArray) -> FloatArray:
        """Return the voltage (V) behind the source's resistance."""
        if isinstance(self.source, VoltageSource):
            return self.source.at(times)
        network = self.network
        currents, slopes = self._currents(times)
        needed = network.mean_inertance @ slopes + network.damping @ currents + network.flux_basis.T @ self._emf(times)
        return network.behind(needed)

    def _emf(self, times: FloatArray) -> FloatArray:
        windings = self.network.windings
        speed = self.motion.speed(times) * windings.pole_pairs
        angle = self.motion.angle(times) * windings.pole_pairs
        if windings.motor.iron.lowers_emf:
            shares = np.array([self._share(speed, order) for order in windings.emf_orders])
            lowered: FloatArray = (windings.emf_phasors @ (turned(angle, windings.emf_orders) * shares)).real
            return lowered * speed
        return windings.emf_per_speed(angle) * speed

    def _share(self, electrical_speed: FloatArray, order: int) -> FloatArray:
        motor = self.network.windings.motor
        return motor.iron.emf_share(electrical_speed, order, motor.pole_pairs, motor.flux_temperature_coefficient)
