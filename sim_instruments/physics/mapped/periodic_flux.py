"""Steady states of a turning rotor whose fluxes follow a law of both currents: what repeats every electrical turn."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from sim_instruments.physics.circuits.source import Source
from sim_instruments.physics.circuits.windings import ComplexArray, FloatArray
from sim_instruments.physics.mapped.network import MappedNetwork
from sim_instruments.physics.mapped.windings import slopes_behind_loss

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

#: Harmonics of the currents beyond the EMF's highest, and the least, that saliency, saturation and unlike windings are followed to.
_BEYOND, _LEAST = 6, 16
_STEPS, _ENOUGH = 40, 1e-11
#: How often a speed is halved on the way to a steady state that Newton's method does not find at once.
_HALVINGS = 12
#: Distance of the speeds between which steady states are interpolated, in arsinh(ω·L/R), and how many are solved as they are.
_SPACING, _FEW = 0.1, 6
#: Within this range of the speed, relative, the currents are a parabola over it.
_NARROW = 0.02
#: A harmonic smaller than this beside the largest is nothing.
_NOTHING = 1e-10


@dataclass(frozen=True)
class SteadyTurn:
    """One electrical turn at one speed: `harmonics` Xₙ (A, (n from 0 on, loops)) of the loop currents Re Σ Xₙ·exp(jnθ), peak.

    `loops` (A, (points, loops)) are those currents at evenly spaced angles, `torque` (N·m) is their mean on the rotor.
    """

    loops: FloatArray
    harmonics: ComplexArray
    torque: float


class PeriodicFlux:
    """Loop currents at any constant speed, found by collocation: reachᵀ·(ω·dΦ/dθ + K·x − drive·u) = 0 at evenly spaced angles.

    Exact but for the number of harmonics: fluxes, saliency, harmonics of the EMF, unlike windings and the iron's loss are in it.
    """

    def __init__(self, network: MappedNetwork, source: Source) -> None:
        self.network = network
        windings = network.windings
        self._reach, self._offset, force, _ = network.imposed(source)
        self._free = self._reach.shape[1]
        highest = max(max(windings.emf_orders) + _BEYOND, _LEAST)
        points = 2 * highest + 1
        self._angles: FloatArray = (2.0 * math.pi / points) * np.arange(points, dtype=np.float64)
        self._shares = windings.shares(self._angles)
        basis = network.basis @ self._reach
        #: The free loops' shares in d and q axis (2, free, points).
        self._axis_shares = np.einsum("akn,kf->afn", self._shares, basis)
        self._rest = basis.T @ windings.rest_flux(self._angles)
        self._zero = basis.T @ windings.zero_sequence @ basis
        self._damping = self._reach.T @ network.damping @ self._reach
        self._force = self._reach.T @ force
        number = np.arange(points)
        half = 0.5 * (self._angles[:, np.newaxis] - self._angles)
        sines = np.sin(half) + np.eye(points)
        signs = np.where((number[:, np.newaxis] - number) % 2, -1.0, 1.0)
        #: Derivative by the angle of what is known at these angles; of an odd number of them it is exact.
        self._derivative = 0.5 * signs / sines * (1.0 - np.eye(points))
        law_at = windings.law.at(0.0, 0.0)
        self._time_constant = 0.5 * (law_at[2] + law_at[5]) / float(windings.resistance.mean())
        self._turns: dict[float, SteadyTurn] = {}

    def turn(self, electrical_speed: float) -> SteadyTurn:
        """Return the steady state at an electrical speed (rad/s, of either sign)."""
        result = self._turns.get(electrical_speed)
        if result is None:
            result = self._turns[electrical_speed] = self._solved(electrical_speed)
        return result

    def harmonics(self, electrical_speeds: FloatArray) -> tuple[tuple[int, ...], ComplexArray]:
        """Return the orders that matter at n electrical speeds (rad/s), and their phasors (A, peak, (orders, loops, n))."""
        speeds, place = np.unique(electrical_speeds, return_inverse=True)
        if len(speeds) <= _FEW:
            every = np.array([self.turn(float(speed)).harmonics for speed in speeds])[place]
        else:
            nodes, turns = self._grid(float(speeds[0]), float(speeds[-1]))
            every = _course(nodes, np.array([turn.harmonics for turn in turns]))(self._scaled(electrical_speeds))
        sizes = np.abs(every).max(axis=(0, 2), initial=0.0)
        kept = np.flatnonzero(sizes > _NOTHING * max(float(sizes.max(initial=0.0)), 1e-300))
        return tuple(kept.tolist()), np.moveaxis(every[:, kept], 0, -1)

    def braking_torque(self, speed: FloatArray) -> FloatArray:
        """Return the mean torque (N·m, against the motion, (n,)) at mechanical speeds (rad/s, not negative)."""
        return self._braking(self._scaled(np.asarray(speed) * self.network.windings.pole_pairs))

    @cached_property
    def _braking(self) -> "_GrowingCourse":
        return _GrowingCourse(self)

    def _scaled(self, speeds: FloatArray) -> FloatArray:
        return np.arcsinh(speeds * self._time_constant)

    def at_scaled(self, node: float) -> SteadyTurn:
        """Return the steady state at arsinh(ω·L/R); none is a rotor that begins to turn."""
        return self.turn(math.sinh(node) / self._time_constant if node else 1e-9 / self._time_constant)

    def _grid(self, low: float, high: float) -> tuple[FloatArray, list[SteadyTurn]]:
        first, last = self._scaled(np.array([low, high]))
        if high - low <= _NARROW * max(abs(low), abs(high)):
            speeds = np.array([low, 0.5 * (low + high), high])
            return self._scaled(speeds), [self.turn(float(speed)) for speed in speeds]
        numbers = np.arange(math.floor(first / _SPACING) - 2, math.ceil(last / _SPACING) + 3)
        if first >= 0.0:
            numbers = numbers[numbers >= 0]
        elif last <= 0.0:
            numbers = numbers[numbers <= 0]
        nodes = _SPACING * numbers
        if first < 0.0 >= last:
            return nodes, [self.turn(math.sinh(node) / self._time_constant or -1e-9) for node in nodes.tolist()]
        return nodes, [self.at_scaled(float(node)) for node in nodes]

    # Newton's method

    def _solved(self, speed: float) -> SteadyTurn:
        free = self._currents(speed, _HALVINGS)
        loops: FloatArray = self._offset + free @ self._reach.T
        points = len(self._angles)
        harmonics = np.fft.rfft(loops, axis=0) / points
        harmonics[1:] *= 2.0
        windings = self.network.windings
        torque = windings.torque(self._angles, self.network.basis @ loops.T, np.full(points, speed))
        return SteadyTurn(loops, harmonics, float(torque.mean()))

    def _currents(self, speed: float, halvings: int) -> FloatArray:
        points = len(self._angles)
        if not self._free:
            return np.zeros((points, 0))
        begin = np.tile(np.linalg.solve(self._damping, self._force), (points, 1))
        if self._turns:
            nearest = min(self._turns, key=lambda known: abs(known - speed))
            begin = (self._turns[nearest].loops - self._offset) @ self._reach
        free = self._newton(begin, speed)
        if free is None and halvings:
            free = self._newton(self._currents(0.5 * speed, halvings - 1), speed)
        if free is None:
            raise RuntimeError(f"no steady state of the currents was found at {speed:.6g} rad/s (electrical)")
        return free

    def _newton(self, free: FloatArray, speed: float) -> FloatArray | None:
        error, slope = self._residual(free, speed)
        scale = _ENOUGH * (
            abs(speed * self.network.windings.flux_linkage)
            + float(np.abs(self._force).max())
            + float(np.abs(self._damping @ free.T).max())
        )
        size = float(np.abs(error).max())
        for _ in range(_STEPS):
            if size <= scale:
                return free
            step = np.linalg.solve(slope, error.ravel()).reshape(free.shape)
            share = 1.0
            while True:
                tried, slope_there = self._residual(free - share * step, speed)
                left = float(np.abs(tried).max())
                if left < size or left <= scale:
                    break
                share *= 0.5
                if share < 1e-4:
                    return free if size <= 1e3 * scale else None
            free, error, slope, size = free - share * step, tried, slope_there, left
        return None

    def _residual(self, free: FloatArray, speed: float) -> tuple[FloatArray, FloatArray]:
        """Return the voltages (V, (points, free)) that are left over, and their derivatives by all currents."""
        windings = self.network.windings
        speeds = np.full(len(self._angles), speed)
        loops = self._offset + free @ self._reach.T
        _, found = windings.axis_fluxes(self._shares, speeds, self.network.basis @ loops.T)
        flux = np.einsum("afn,an->nf", self._axis_shares, found[:2]) + self._rest.T
        flux += (loops @ self.network.basis.T) @ windings.zero_sequence @ (self.network.basis @ self._reach)
        error: FloatArray = speed * (self._derivative @ flux) + free @ self._damping.T - self._force
        inductances = slopes_behind_loss(found, windings.lost_share(speeds))
        own = (2.0 / 3.0) * np.einsum(
            "afn,abn,bgn->nfg", self._axis_shares, inductances, self._axis_shares
        ) + self._zero
        points = len(self._angles)
        slope = speed * np.einsum("jk,kfg->jfkg", self._derivative, own)
        slope[np.arange(points), :, np.arange(points), :] += self._damping
        size = points * self._free
        return error, slope.reshape(size, size)


def _course(nodes: FloatArray, values: FloatArray | ComplexArray) -> "BSpline":
    """Return the smooth course through values along the first axis: of order 5, or less where they are few."""
    from scipy.interpolate import make_interp_spline

    return make_interp_spline(nodes, values, k=5 if len(nodes) > 5 else min(2, len(nodes) - 1))


class _GrowingCourse:
    """The braking torque over arsinh(ω·L/R), solved as far as anybody has asked."""

    def __init__(self, periodic: PeriodicFlux) -> None:
        self._periodic = periodic
        self._torques: list[float] = []
        self._course: BSpline | None = None

    def __call__(self, scaled: FloatArray) -> FloatArray:
        needed = max(math.ceil(float(np.max(scaled, initial=0.0)) / _SPACING) + 3, 6)
        if self._course is None or len(self._torques) < needed:
            # Some more than asked: an integrator looks ahead.
            for number in range(len(self._torques), needed + 2):
                self._torques.append(-self._periodic.at_scaled(number * _SPACING).torque)
            self._course = _course(_SPACING * np.arange(len(self._torques), dtype=np.float64), np.array(self._torques))
        return np.asarray(self._course(scaled), dtype=np.float64)
