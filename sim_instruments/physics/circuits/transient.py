"""Currents of a standing rotor: a linear circuit, solved mode by mode."""

from functools import cached_property

import numpy as np

from sim_instruments.physics.circuits.eddy import EddyNetwork
from sim_instruments.physics.circuits.exponentials import Exponentials
from sim_instruments.physics.circuits.network import Network, modes
from sim_instruments.physics.circuits.source import Source, VoltageSource
from sim_instruments.physics.circuits.windings import FloatArray

#: Modes that begin and end below this (√(W·s)) carry less current than any figure of the bench can show.
_NOTHING = 1e-12


class LinearTransient:
    """Loop currents from given initial ones, under a voltage of constant slope or a regulated current."""

    def __init__(self, network: Network, angle: float, start: float, initial: FloatArray, source: Source) -> None:
        self.network = network
        self.angle = angle
        self.start = start
        self.source = source
        self._inertance = network.inertance(angle)
        reach, self._offset, force, slope = network.imposed(source)
        self.rates, shapes = modes(reach.T @ network.damping @ reach, reach.T @ self._inertance @ reach)
        self._shapes = reach @ shapes
        # Each mode z' = −λ·z + f + s·τ has the particular solution (f + s·τ)/λ − s/λ².
        slope_share = self._shapes.T @ slope / self.rates
        self._steady = (self._shapes.T @ force - slope_share) / self.rates
        self._steady_slope = slope_share
        inner = self._inertance @ (initial - self._offset)
        self._free = self._shapes.T @ inner - self._steady
        #: Loop currents are lasting + decaying·exp(falls·τ) + ramp·τ, of shapes (loops, 1), (loops, modes), (modes, 1), (loops, 1).
        self._lasting = (self._offset + self._shapes @ self._steady)[:, np.newaxis]
        self._decaying = self._shapes * self._free
        self._falls = -self.rates[:, np.newaxis]
        self._ramp = (self._shapes @ self._steady_slope)[:, np.newaxis] if slope.any() else None

    @property
    def settled(self) -> bool:
        """True if the currents stay constant."""
        free = np.abs(self._free)
        return self._ramp is None and bool((free <= _NOTHING + 1e-12 * np.abs(self._steady)).all())

    @cached_property
    def dead(self) -> bool:
        """True if no current flows, and none will."""
        return not (
            self._offset.any()
            or self._ramp is not None
            or (np.abs(self._free) > _NOTHING).any()
            or (np.abs(self._steady) > _NOTHING).any()
        )

    def loop_currents(self, times: FloatArray) -> FloatArray:
        """Return the loop currents (A, shape (loops, n))."""
        # Before its start the circuit stood as it was then.
        passed = np.maximum(times - self.start, 0.0)
        result: FloatArray = self._decaying @ np.exp(self._falls * passed)
        result += self._lasting
        if self._ramp is not None:
            result += self._ramp * passed
        return result

    def loop_slopes(self, times: FloatArray) -> FloatArray:
        """Return the derivatives of the loop currents (A/s, shape (loops, n))."""
        decay = np.exp(self._falls * np.maximum(times - self.start, 0.0))
        result: FloatArray = (self._decaying * -self.rates) @ decay
        return result if self._ramp is None else result + self._ramp

    def winding_currents(self, times: FloatArray) -> FloatArray:
        """Return the winding currents (A, shape (3, n))."""
        return self.network.basis @ self.loop_currents(times)

    def source_voltage(self, times: FloatArray) -> FloatArray:
        """Return the voltage (V) behind the source's resistance."""
        if isinstance(self.source, VoltageSource):
            return self.source.at(times)
        network = self.network
        needed = self._inertance @ self.loop_slopes(times) + network.damping @ self.loop_currents(times)
        return network.behind(needed)

    def drops(self, times: FloatArray) -> FloatArray:
        """Return the voltage drops (V, shape (3, n)) along the windings."""
        windings = self.network.windings
        slopes = self.network.flux_basis @ self.loop_slopes(times)
        return (
            windings.resistance[:, np.newaxis] * (self.network.ohmic_basis @ self.loop_currents(times))
            + windings.inductance(self.angle) @ slopes
        )

    def eddy_currents(self, time: float) -> FloatArray | None:
        """Return the eddy currents (A) in the iron at a time, None where there are none."""
        if not isinstance(self.network, EddyNetwork):
            return None
        return self.loop_currents(np.array([time]))[-3:, 0]

    def copper_heat(self, duration: float) -> float | None:
        """Return the heat (J) in the windings over the first `duration` s, None under a voltage that runs."""
        if self._ramp is not None:
            return None
        basis, rates = self.network.basis, self.rates
        parts = basis @ np.concatenate([self._lasting, self._decaying], axis=1)
        # Integrals of the products of 1 and the exponentials, each with each.
        both = np.concatenate([[0.0], rates])
        sums = both[:, np.newaxis] + both
        sums[0, 0] = 1.0
        products = -np.expm1(-sums * duration) / sums
        products[0, 0] = duration
        return float(self.network.windings.resistance @ ((parts @ products) * parts).sum(axis=1))

    def source_course(self) -> Exponentials:
        """Return the source's current (A) under a voltage, or the voltage (V) behind its resistance under a current."""
        network = self.network
        if isinstance(self.source, VoltageSource):
            share = network.drive
            ramp = 0.0 if self._ramp is None else float((share @ self._ramp)[0])
            return Exponentials(self.start, float((share @ self._lasting)[0]), ramp, share @ self._decaying, self.rates)
        share = network.drive / float(network.drive @ network.drive)
        dropping = share @ network.damping
        amplitudes = dropping @ self._decaying - (share @ self._inertance @ self._decaying) * self.rates
        return Exponentials(self.start, float((dropping @ self._lasting)[0]), 0.0, amplitudes, self.rates)
