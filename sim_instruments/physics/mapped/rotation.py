"""Currents and voltages of a rotor that is turned, whose fluxes follow a law of both currents."""

import numpy as np

from sim_instruments.physics.circuits.network import Network
from sim_instruments.physics.circuits.source import Source, VoltageSource
from sim_instruments.physics.circuits.windings import FloatArray, turned
from sim_instruments.physics.mapped.network import MappedNetwork
from sim_instruments.physics.mapped.periodic_flux import PeriodicFlux
from sim_instruments.physics.mapped.windings import MappedWindings
from sim_instruments.physics.motion.motion import Motion

#: Times worked on at once, which bounds the memory.
_CHUNK = 1 << 13


class MappedRotation:
    """Open or closed loops of a rotor that is turned from outside or coasts; they pass through the steady states of its speed.

    The transient on closing a loop is left out.
    """

    def __init__(self, network: MappedNetwork, motion: Motion, source: Source) -> None:
        self.network: Network = network
        self._windings = network.windings
        self.motion = motion
        self.source = source
        self.periodic = PeriodicFlux(network, source)

    def winding_currents(self, times: FloatArray) -> FloatArray:
        """Return the winding currents (A, shape (3, n))."""
        return self.network.basis @ self._currents(times)[0]

    def drops(self, times: FloatArray) -> FloatArray:
        """Return the voltage drops (V, shape (3, n)) along the windings."""
        basis = self.network.basis
        loops, slopes = self._currents(times)
        return self._windings.drops(*self._turning(times), basis @ loops, basis @ slopes)

    def source_voltage(self, times: FloatArray) -> FloatArray:
        """Return the voltage (V) behind the source's resistance."""
        if isinstance(self.source, VoltageSource):
            return self.source.at(times)
        network, windings = self.network, self._windings
        loops, slopes = self._currents(times)
        currents = network.basis @ loops
        induced = windings.drops(*self._turning(times), currents, network.basis @ slopes)
        induced -= windings.resistance[:, np.newaxis] * currents
        needed = network.basis.T @ induced + network.damping @ loops
        return network.behind(needed)

    def _turning(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        pairs = self.network.windings.pole_pairs
        return self.motion.angle(times) * pairs, self.motion.speed(times) * pairs

    def _currents(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return loop currents (A) and their slopes (A/s), shapes (loops, n)."""
        currents, slopes = np.zeros((2, self.network.loops, len(times)))
        if not self.network.loops:
            return currents, slopes
        angles, speeds = self._turning(times)
        for begin in range(0, len(times), _CHUNK):
            part = slice(begin, begin + _CHUNK)
            speed = speeds[part]
            orders, phasors = self.periodic.harmonics(speed)
            waves = turned(angles[part], [order for order in orders if order])
            if orders and orders[0] == 0:
                currents[:, part] += phasors[0].real
                phasors = phasors[1:]
            for order, phasor, turn in zip([order for order in orders if order], phasors, waves, strict=True):
                wave = phasor * turn
                currents[:, part] += wave.real
                slopes[:, part] += (1j * order * speed * wave).real
        return currents, slopes


class IronBrake:
    """The braking torque of the iron's loss on a turning shaft at currents that turn with it (A, d + j·q of the Y-equivalent)."""

    def __init__(self, windings: MappedWindings, current: complex = 0j) -> None:
        self._windings = windings
        self._current = current

    def braking_torque(self, speed: FloatArray) -> FloatArray:
        """Return the torque (N·m, against the motion, shape (n,)) at mechanical speeds (rad/s, not negative)."""
        windings = self._windings
        electrical = np.maximum(speed, 1e-12) * windings.pole_pairs
        # An integrator asks for one speed after the other.
        if len(electrical) == 1:
            flux = np.array([windings.flux_linkage_of(self._current, float(electrical[0]))])
        else:
            flux = windings.flux_linkages_y(np.full(len(electrical), self._current), electrical)
        lost = windings.motor.iron.lost_share(electrical)
        result: FloatArray = 1.5 * windings.pole_pairs * lost * np.abs(flux) ** 2
        return result
