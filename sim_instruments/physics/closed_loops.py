"""Currents that a turning rotor drives in closed paths of its winding: joined terminals, a short of all three."""

import math
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sim_instruments.physics.circuits.network import Network
from sim_instruments.physics.circuits.source import absent
from sim_instruments.physics.circuits.windings import FloatArray, turned
from sim_instruments.physics.circulating import CirculatingCurrent
from sim_instruments.physics.integration.swing_equations import Shaft
from sim_instruments.physics.mapped.network import MappedNetwork
from sim_instruments.physics.mapped.periodic_flux import PeriodicFlux
from sim_instruments.physics.mapped.rotation import IronBrake
from sim_instruments.physics.motion.motion import Motion

ComplexArray = NDArray[np.complex128]

#: Harmonics beyond the EMF's highest that saliency and unlike windings are followed to: one loop alone pulsates, and has more of them.
_BEYOND, _BEYOND_OF_ONE = 4, 16
#: A harmonic smaller than this beside the largest is nothing.
_NOTHING = 1e-9
#: Within this range of the speed, relative, the currents are a parabola over it.
_NARROW = 0.02


class PeriodicCurrents:
    """The periodic steady state of closed loops at any constant speed; saliency, harmonics and unlike windings are in it.

    With loop currents x(θ) = Σ Xₙ·exp(jnθ), d(M·x)/dθ + K·x/ω = −Bᵀ·e(θ) is one linear system in all Xₙ, which is solved for every
    speed at once by its eigenvalues. The transient on closing the loops is left out.
    """

    def __init__(self, network: Network) -> None:
        self.network = network
        windings = network.windings
        self._loops = network.loops
        self._orders = windings.emf_orders
        highest = max(self._orders) + (_BEYOND if network.loops > 1 else _BEYOND_OF_ONE)
        self._numbers = np.array([n for n in range(-highest, highest + 1) if n])
        place = {int(n): k for k, n in enumerate(self._numbers)}
        size, loops = len(self._numbers), self._loops
        mean, cos, sin = (
            network.basis.T @ part @ network.basis
            for part in (windings.inductance_mean, windings.inductance_cos, windings.inductance_sin)
        )
        up, down = 0.5 * (cos - 1j * sin), 0.5 * (cos + 1j * sin)
        flux = np.zeros((size * loops, size * loops), complex)
        for n, k in place.items():
            rows = slice(k * loops, (k + 1) * loops)
            for other, part in ((n, mean), (n - 2, up), (n + 2, down)):
                if other in place:
                    at = place[other] * loops
                    flux[rows, at : at + loops] += 1j * n * part
        drives = np.zeros((size * loops, len(self._orders)), complex)
        for column, order in enumerate(self._orders):
            phasor = 0.5 * network.basis.T @ windings.emf_phasors[:, column]
            drives[place[order] * loops :][:loops, column] = -phasor
            drives[place[-order] * loops :][:loops, column] = -phasor.conj()
        # K = C·Cᵀ: C⁻¹·flux·C⁻ᵀ has eigenvalues λ, and X(ω) = C⁻ᵀ·V·[ω / (1 + λω)]·V⁻¹·C⁻¹·drives.
        root = np.linalg.cholesky(network.damping)
        inverse = np.kron(np.eye(size), np.linalg.inv(root))
        self._rates, vectors = np.linalg.eig(inverse @ flux @ inverse.T)
        self._shapes: ComplexArray = inverse.T @ vectors
        self._drives: ComplexArray = np.linalg.solve(vectors, inverse @ drives)

    def harmonics(self, electrical_speed: FloatArray) -> ComplexArray:
        """Return Xₙ (A, shape (harmonics, loops, n)) at n electrical speeds (rad/s, of either sign)."""
        driven = self._drives @ self.emf_shares(electrical_speed)
        modal = driven * (electrical_speed / (1.0 + self._rates[:, np.newaxis] * electrical_speed))
        return (self._shapes @ modal).reshape(len(self._numbers), self._loops, -1)

    def orders_of(self, harmonics: ComplexArray) -> tuple[tuple[int, ...], ComplexArray]:
        """Return the positive orders that matter among harmonics of any speeds, and their phasors (orders, loops, n), peak."""
        positive = self._numbers > 0
        sizes = np.abs(harmonics).max(axis=(1, 2), initial=0.0)
        kept = positive & (sizes > _NOTHING * max(float(sizes.max(initial=0.0)), 1e-300))
        return tuple(self._numbers[kept].tolist()), 2.0 * harmonics[kept]

    def braking_torque(self, speed: FloatArray) -> FloatArray:
        """Return the mean torque (N·m, against the motion, shape (n,)) at mechanical speeds (rad/s, not negative).

        In the steady state what the shaft gives is what the loops' resistances take.
        """
        harmonics = self.harmonics(speed * self.network.windings.pole_pairs)
        loss = np.einsum("kin,ij,kjn->n", harmonics.conj(), self.network.damping, harmonics).real
        result: FloatArray = np.divide(loss, speed, out=np.zeros_like(speed), where=speed > 0.0)
        return result

    def emf_shares(self, electrical_speed: FloatArray) -> FloatArray:
        """Return what is left of each harmonic's EMF (orders, n) at electrical speeds (rad/s)."""
        motor = self.network.windings.motor
        if not motor.iron.lowers_emf:
            return np.ones((len(self._orders), len(electrical_speed)))
        rows = [
            motor.iron.emf_share(electrical_speed, order, motor.pole_pairs, motor.flux_temperature_coefficient)
            for order in self._orders
        ]
        return np.array(rows)


class Brake(Protocol):
    """Something that brakes a turning rotor by its magnets' field."""

    def braking_torque(self, speed: FloatArray) -> FloatArray:
        """Return the mean torque (N·m, against the motion, (n,)) at mechanical speeds (rad/s, not negative)."""


@dataclass(frozen=True)
class CombinedBrakes:
    """Brakes that act at the same time."""

    parts: tuple[Brake, ...]

    def braking_torque(self, speed: FloatArray) -> FloatArray:
        """Return their mean torque (N·m, against the motion, (n,)) at mechanical speeds (rad/s, not negative)."""
        result: FloatArray = np.sum([part.braking_torque(speed) for part in self.parts], axis=0)
        return result


@dataclass(frozen=True)
class BrakedShaft(Shaft):
    """A shaft that currents in closed loops or the iron's loss brake with their mean torque; `holding` (N·m) of it at standstill."""

    loops: Brake | None = None
    holding: float = 0.0

    @property
    def static_friction(self) -> float:
        """The torque (N·m) up to which a shaft that stands goes on standing."""
        return super().static_friction + self.holding

    def friction(self, speed: float) -> float:
        """Return friction and braking (N·m) against a speed (rad/s), with the speed's sign."""
        return float(self.frictions(np.array([speed]))[0])

    def frictions(self, speeds: FloatArray) -> FloatArray:
        """Return friction and braking (N·m) against speeds (rad/s, shape (n,)), with the speeds' signs."""
        friction = super().frictions(speeds)
        if self.loops is None:
            return friction
        return friction + np.sign(speeds) * self.loops.braking_torque(np.abs(speeds))


def braked(shaft: Shaft, network: Network, current: complex = 0j) -> Shaft:
    """Return a shaft as the closed loops of a network and the iron brake it; as it is where nothing does.

    `current` (A, d + j·q of the Y-equivalent) is what an inverter impresses, which sets the flux in the iron.
    """
    given = {entry.name: getattr(shaft, entry.name) for entry in fields(shaft)}
    if isinstance(network, MappedNetwork):
        iron, windings = IronBrake(network.windings, current), network.windings
        holding = float(iron.braking_torque(np.zeros(1))[0]) if windings.motor.iron.hysteresis_loss else 0.0
        if network.joins_terminals:
            return BrakedShaft(**given, loops=PeriodicFlux(network, absent(0.0)), holding=holding)
        brakes: list[Brake] = [iron] if windings.motor.iron.loses else []
        if (circulating := _circulating(network)) is not None:
            brakes.append(circulating)
        return BrakedShaft(**given, loops=CombinedBrakes(tuple(brakes)), holding=holding) if brakes else shaft
    # Shorted turns and eddy currents keep the currents that the mean inductance gives, and a brake of their own.
    if type(network) is not Network:
        return shaft
    if network.joins_terminals:
        return BrakedShaft(**given, loops=PeriodicCurrents(network))
    circulating = _circulating(network)
    return shaft if circulating is None else BrakedShaft(**given, loops=circulating)


def _circulating(network: Network) -> CirculatingCurrent | None:
    """Return what the magnets drive round a delta whose terminals nothing joins, None where it is nothing."""
    return CirculatingCurrent.of(network.windings, np.zeros((3, 3))) if network.source is None else None


class ClosedLoops:
    """Currents and voltages of a rotor that is turned while its terminals are joined, no source among them.

    The currents are at every moment those of the steady state at the present speed.
    """

    def __init__(self, network: Network, motion: Motion) -> None:
        self.network = network
        self.motion = motion

    @cached_property
    def periodic(self) -> PeriodicCurrents:
        """The steady states that the currents go through."""
        return PeriodicCurrents(self.network)

    def winding_currents(self, times: FloatArray) -> FloatArray:
        """Return the winding currents (A, shape (3, n))."""
        return self.network.basis @ self._currents(times)[0]

    def drops(self, times: FloatArray) -> FloatArray:
        """Return the voltage drops (V, shape (3, n)) along the windings."""
        windings = self.network.windings
        angles, speeds = self._turning(times)
        loops, slopes = self._currents(times)
        currents = self.network.basis @ loops
        return (
            windings.resistance[:, np.newaxis] * currents
            + windings.inductance_times(angles, self.network.basis @ slopes)
            + speeds * windings.inductance_slope_times(angles, currents)
            + speeds * self._emf_per_speed(angles, speeds)
        )

    def source_voltage(self, times: FloatArray) -> FloatArray:
        """Return the voltage (V) of a source that is no part of this circuit."""
        return absent(0.0).at(times)

    def _turning(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        pairs = self.network.windings.pole_pairs
        return self.motion.angle(times) * pairs, self.motion.speed(times) * pairs

    def _currents(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return loop currents (A) and their slopes (A/s), shapes (loops, n)."""
        angles, speeds = self._turning(times)
        currents, slopes = np.zeros((2, self.network.loops, len(times)))
        if not len(times):
            return currents, slopes
        low, high = float(speeds.min()), float(speeds.max())
        narrow = high - low <= _NARROW * max(abs(low), abs(high))
        nodes = np.array([low, 0.5 * (low + high), high]) if narrow and high > low else speeds
        if high == low:
            nodes = np.array([low])
        orders, phasors = self.periodic.orders_of(self.periodic.harmonics(nodes))
        weights = _parabola(speeds, nodes) if narrow and high > low else None
        for order, phasor, turn in zip(orders, phasors, turned(angles, orders), strict=True):
            at = phasor if weights is None else phasor @ weights
            wave = at * turn
            currents += wave.real
            slopes += (1j * order * speeds * wave).real
        return currents, slopes

    def _emf_per_speed(self, angles: FloatArray, speeds: FloatArray) -> FloatArray:
        windings = self.network.windings
        if not windings.motor.iron.lowers_emf:
            return windings.emf_per_speed(angles)
        shares = self.periodic.emf_shares(speeds)
        return (windings.emf_phasors @ (turned(angles, windings.emf_orders) * shares)).real


def _parabola(at: FloatArray, nodes: FloatArray) -> FloatArray:
    """Return the weights (3, n) of three nodes for values in between."""
    rows = []
    for k in range(3):
        others = [nodes[m] for m in range(3) if m != k]
        rows.append(math.prod(1.0 / (nodes[k] - other) for other in others) * (at - others[0]) * (at - others[1]))
    return np.array(rows)
