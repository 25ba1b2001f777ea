"""Currents of a held rotor whose iron saturates: the one circuit at standstill that has no closed form."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sim_instruments.physics.circuits.network import Network, modes
from sim_instruments.physics.circuits.small import solve_each, solve_small
from sim_instruments.physics.circuits.source import Source, VoltageSource
from sim_instruments.physics.circuits.windings import FloatArray
from sim_instruments.physics.motor.saturation import AxisLaw

if TYPE_CHECKING:
    from scipy.integrate import OdeSolution

#: After so many of its longest time constants a transient under a constant source is over.
_SETTLED = 30.0
_TOLERANCE = 1e-9
#: No axis carries more current than this (A).
_FAR = 1e6


class SaturatedTransient:
    """Loop currents from given initial ones, as `LinearTransient` has them, with dψ/di for the inductances.

    Any wiring, any rotor position. Integrated to a relative 1e-9 until `until` (s), or until a constant source has
    brought it to its steady state, which holds from there on.
    """

    def __init__(
        self,
        network: Network,
        saturation: AxisLaw,
        angle: float,
        start: float,
        initial: FloatArray,
        source: Source,
        until: float,
    ) -> None:
        self.network = network
        self.angle = angle
        self.start = start
        self.source = source
        self._saturation = saturation
        self._reach, self._offset, force, slope = network.imposed(source)
        reach = self._reach
        self._inertances = network.axis_inertances(angle)
        zero, *parts = (reach.T @ part @ reach for part in self._inertances)
        self._zero, self._parts = zero, parts
        shares = network.axis_shares(angle)
        self._shares, self._bias = shares @ reach, shares @ self._offset
        self._damping = reach.T @ network.damping @ reach
        self._force, self._slope = reach.T @ force, reach.T @ slope
        #: Decay rates (1/s) where the inductances are largest.
        self.rates = modes(self._damping, _sum(zero, saturation.largest, parts))[0]
        self._begin: FloatArray = reach.T @ (initial - self._offset)
        self._steady = np.asarray(np.linalg.solve(self._damping, self._force), dtype=np.float64)
        span = until - start
        if not np.any(self._slope):
            moves = self._begin.any() or self._steady.any()
            span = min(span, _SETTLED / float(self.rates.min()) if moves else 0.0)
        self._span = max(span, 0.0)
        self._dense = self._integrated() if self._span > 0.0 and len(self._begin) else None

    def loop_currents(self, times: FloatArray) -> FloatArray:
        """Return the loop currents (A, shape (loops, n))."""
        return self._offset[:, np.newaxis] + self._reach @ self._free(times)

    def loop_slopes(self, times: FloatArray) -> FloatArray:
        """Return the derivatives of the loop currents (A/s, shape (loops, n))."""
        free, passed = self._free(times), times - self.start
        if not len(free):
            return np.zeros((len(self._offset), len(times)))
        along, across = self._bias[:, np.newaxis] + self._shares @ free
        inductances = [
            inductance[:, np.newaxis, np.newaxis]
            for inductance in self._saturation.differential_inductances(along, across)
        ]
        inertances = _sum(self._zero, inductances, self._parts)
        forces = self._force[:, np.newaxis] + self._slope[:, np.newaxis] * passed - self._damping @ free
        return self._reach @ solve_each(inertances, forces)

    def winding_currents(self, times: FloatArray) -> FloatArray:
        """Return the winding currents (A, shape (3, n))."""
        return self.network.basis @ self.loop_currents(times)

    def source_voltage(self, times: FloatArray) -> FloatArray:
        """Return the voltage (V) behind the source's resistance."""
        if isinstance(self.source, VoltageSource):
            return self.source.at(times)
        network = self.network
        currents, slopes = self.loop_currents(times), self.loop_slopes(times)
        zero_part, *parts = (part @ slopes for part in self._inertances)
        needed = _sum(zero_part, self._inductances(currents), parts) + network.damping @ currents
        return network.behind(needed)

    def drops(self, times: FloatArray) -> FloatArray:
        """Return the voltage drops (V, shape (3, n)) along the windings."""
        windings, basis = self.network.windings, self.network.basis
        currents, slopes = self.loop_currents(times), basis @ self.loop_slopes(times)
        zero_part, *parts = (part @ slopes for part in windings.axis_inductances(self.angle))
        resistive: FloatArray = windings.resistance[:, np.newaxis] * (basis @ currents)
        return _sum(resistive + zero_part, self._inductances(currents), parts)

    def _inductances(self, loops: FloatArray) -> Sequence[FloatArray]:
        along, across = self.network.axis_shares(self.angle) @ loops
        return self._saturation.differential_inductances(along, across)

    def _free(self, times: FloatArray) -> FloatArray:
        """Return the currents (A, shape (free, n)) that the source leaves free."""
        # Before its start the circuit stood as it was then.
        passed = np.maximum(times - self.start, 0.0)
        if self._dense is None:
            return np.repeat(self._begin[:, np.newaxis], len(times), axis=1)
        free = np.asarray(self._dense(np.minimum(passed, self._span)), dtype=np.float64)
        return np.where(passed > self._span, self._steady[:, np.newaxis], free)

    def _integrated(self) -> "OdeSolution":
        from scipy.integrate import solve_ivp

        scale = max(float(np.abs(self._begin).max()), float(np.abs(self._steady).max()), 1e-3)
        solution = solve_ivp(
            self._slopes,
            (0.0, self._span),
            self._begin,
            method="DOP853",
            dense_output=True,
            rtol=_TOLERANCE,
            atol=_TOLERANCE * scale,
        )
        if not solution.success or solution.sol is None:
            raise RuntimeError(
                f"the saturated circuit could not be integrated from {self.start:.6g} s on: {solution.message}"
            )
        return solution.sol

    def _slopes(self, passed: float, free: FloatArray) -> FloatArray:
        # A step that the integrator tries and takes back may lie anywhere.
        along, across = (min(max(part, -_FAR), _FAR) for part in (self._bias + self._shares @ free).tolist())
        inertance = _sum(self._zero, self._saturation.differential_inductances(along, across), self._parts)
        return solve_small(inertance, self._force + self._slope * passed - self._damping @ free)


def _sum(first: FloatArray, inductances: Sequence[Any], parts: Sequence[FloatArray]) -> FloatArray:
    """Return Z and what each inductance (H) makes of its part."""
    total = first
    for inductance, part in zip(inductances, parts, strict=True):
        total = total + inductance * part
    return total
