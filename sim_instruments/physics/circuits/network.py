"""The currents that a wiring allows, and their driving voltages."""

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np
from scipy.linalg.lapack import dsygvd

from sim_instruments.physics.circuits.small import solve_small
from sim_instruments.physics.circuits.source import Source, VoltageSource
from sim_instruments.physics.circuits.windings import FloatArray, Windings
from sim_instruments.physics.circuits.wiring import wiring
from sim_instruments.physics.motor.saturation import AxisLaw


class Network:
    """Windings whose terminals meet sockets; equal sockets are joined, "open" ones are not.

    Winding currents are w = basis·x: the loops that Kirchhoff's current law leaves. With a `source` (two socket
    names, + and −) they obey M·x' + K·x + basisᵀ·EMF = drive·u, and the source's current is driveᵀ·x.
    `held` says that the rotor stands, and so that the circuit may saturate. In each terminal's wire is the `lead_resistance` (Ω) and that
    of its clamp's contact (Ω, shape (3,)).
    """

    def __init__(
        self,
        windings: Windings,
        sockets: Sequence[str],
        source: tuple[str, str] | None = None,
        *,
        source_resistance: float = 0.0,
        lead_resistance: float = 0.0,
        contacts: FloatArray | None = None,
        held: bool = False,
    ) -> None:
        self.windings = windings
        self.saturation: AxisLaw | None = self._axis_law(held)
        self.sockets = tuple(sockets)
        self.source_resistance = source_resistance
        self.contacts: FloatArray = np.zeros(3) if contacts is None else contacts
        #: Resistances (Ω, shape (3,)) of the terminals' wires, contacts included.
        self.wire_resistances = lead_resistance + self.contacts
        self._wiring = joined = wiring(windings.motor.connection, self.sockets, source)
        self.source = joined.source
        self.basis, self.drive, self._plus = joined.basis, joined.drive, joined.plus
        self.damping: FloatArray = (
            self.basis.T @ (windings.resistance[:, np.newaxis] * self.basis)
            + joined.wires.T @ (self.wire_resistances[:, np.newaxis] * joined.wires)
            + source_resistance * joined.behind
        )

    def _axis_law(self, held: bool) -> AxisLaw | None:
        return self.windings.saturation if held else None

    @property
    def flux_basis(self) -> FloatArray:
        """The part of the loop currents that flows in the windings' inductances (3, loops)."""
        return self.basis

    @property
    def ohmic_basis(self) -> FloatArray:
        """The part of the loop currents that flows in the windings' resistances (3, loops)."""
        return self.basis

    @property
    def loops(self) -> int:
        """Number of independent currents."""
        return int(self.basis.shape[1])

    @property
    def reach(self) -> FloatArray:
        """Directions (loops, loops − 1) of the loop currents that are free where the source's current is fixed."""
        return self._wiring.reach

    def imposed(self, source: Source) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return what a source makes of the loops: directions (loops, free) of the free currents, the currents (A) that it fixes, and its
        voltage (V) less what these drop, with its slope (V/s).
        """
        if isinstance(source, VoltageSource):
            return np.eye(self.loops), np.zeros(self.loops), self.drive * source.voltage, self.drive * source.slope
        fixed = self.drive * (source.current / float(self.drive @ self.drive))
        return self.reach, fixed, -self.damping @ fixed, np.zeros(self.loops)

    def behind(self, needed: FloatArray) -> FloatArray:
        """Return the voltage (V, shape (n,)) behind the source's resistance, from what the loops need (V, shape (loops, n))."""
        return self.drive @ needed / float(self.drive @ self.drive)

    @property
    def principal_loops(self) -> tuple[tuple[bool, bool, bool], FloatArray]:
        """The presence of the source's loop, the other one, and a delta's zero sequence, and their directions (loops, 3) in the
        loops.
        """
        return self._wiring.principal

    @property
    def joins_terminals(self) -> bool:
        """True if joined terminals, and no source, close a path through the windings."""
        return self.source is None and bool(self.loops) and bool(self._wiring.wires.any())

    @property
    def drives_current(self) -> bool:
        """True if the source has a path through the motor."""
        return bool(self.loops) and float(self.drive @ self.drive) > 1e-12

    def inertance(self, angle: float) -> FloatArray:
        """Return M = basisᵀ·L(θ)·basis (H) at an electrical angle."""
        mean, cos, sin = self._inertances
        return mean + math.cos(2.0 * angle) * cos + math.sin(2.0 * angle) * sin

    @cached_property
    def _inertances(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        windings, seen = self.windings, self.flux_basis
        mean, cos, sin = (
            seen.T @ part @ seen
            for part in (windings.inductance_mean, windings.inductance_cos, windings.inductance_sin)
        )
        return mean, cos, sin

    def axis_shares(self, angle: float) -> FloatArray:
        """Return the loops' shares (2, loops) in the currents of d and q axis at an electrical angle."""
        return (2.0 / 3.0) * self.windings.axes(angle) @ self.basis

    def axis_inertances(self, angle: float) -> tuple[FloatArray, ...]:
        """Return Z (H), D and Q (loops×loops each) of M = Z + Ld·D + Lq·Q at an electrical angle."""
        return tuple(self.basis.T @ part @ self.basis for part in self.windings.axis_inductances(angle))

    def differential_inertance(self, loops: FloatArray, angle: float) -> FloatArray:
        """Return dψ/dx (H) of the loops at loop currents (A): M, or where the circuit saturates less."""
        if self.saturation is None:
            return self.inertance(angle)
        along, across = (self.axis_shares(angle) @ loops).tolist()
        result, *parts = self.axis_inertances(angle)
        inductances = self.saturation.differential_inductances(along, across)
        for inductance, part in zip(inductances, parts, strict=True):
            result = result + inductance * part
        return result

    @cached_property
    def mean_inertance(self) -> FloatArray:
        """M with the inductance averaged over a turn."""
        return self._inertances[0]

    def loop_currents(self, winding_currents: FloatArray, angle: float) -> FloatArray:
        """Return the loop currents (A) into which given winding currents fall when this network is joined: flux in its loops stays."""
        if self.loops == 0:
            return np.zeros(0)
        flux = self.basis.T @ self.windings.inductance(angle) @ winding_currents
        return solve_small(self.inertance(angle), flux)

    def voltage_for_constant_current(self, loops: FloatArray, angle: float, electrical_speed: float) -> float:
        """Return the source voltage (V) at which its current would not change, for given loop currents and rotor."""
        windings = self.windings
        emf = windings.emf_per_speed(np.array([angle]))[:, 0]
        slope = windings.inductance_slope(angle) @ (self.basis @ loops)
        left = -self.damping @ loops - electrical_speed * (self.basis.T @ (slope + emf))
        return self._constant_by(loops, angle, left)

    def _constant_by(self, loops: FloatArray, angle: float, left: FloatArray) -> float:
        """Return the source voltage (V) that keeps its current, with what is left (V, shape (loops,)) for the inductances without it."""
        inertance, reach = self.differential_inertance(loops, angle), self.reach
        slopes = (
            reach @ solve_small(reach.T @ inertance @ reach, reach.T @ left) if reach.size else np.zeros(self.loops)
        )
        return float(self.drive @ (inertance @ slopes - left)) / float(self.drive @ self.drive)

    def source_current(self, winding_currents: FloatArray) -> FloatArray:
        """Return the current (A, shape (n,)) that the source delivers at winding currents (3, n)."""
        return self._plus @ winding_currents

    def terminal_currents(self, winding_currents: FloatArray) -> FloatArray:
        """Return the currents (A, shape (3, n)) into the terminals."""
        return self.windings.incidence @ winding_currents

    def node_potentials(
        self, drops: FloatArray, winding_currents: FloatArray, source_voltage: FloatArray
    ) -> FloatArray:
        """Return potentials (V, shape (5, n)) of A, B, C, N and the artificial star, from the windings' voltage drops.

        Zero is the source's − pole, or without a source the star. N of a delta is its artificial star.
        """
        a, b, c = drops
        if self.windings.motor.connection == "wye":
            terminals = np.array([a, b, c])
            star = np.zeros_like(a)
        else:
            terminals = np.array([a - c, b - a, c - b]) / 3.0
            star = terminals.mean(axis=0)
        currents = self.terminal_currents(winding_currents)
        shift = np.zeros_like(a)
        if self.source is not None:
            for pole, potential in ((self.source[1], 0.0), (self.source[0], source_voltage)):
                if pole in self.sockets:
                    at = self.sockets.index(pole)
                    behind = (
                        self.source_resistance * self.source_current(winding_currents)
                        if pole == self.source[0]
                        else 0.0
                    )
                    shift = potential - behind - self.wire_resistances[at] * currents[at] - terminals[at]
                    break
        terminals = terminals + shift
        return np.vstack([terminals, star + shift, terminals.mean(axis=0)])

    def driving_point_impedance(self, angles: FloatArray, angular_frequency: float) -> np.ndarray:
        """Return the impedance (Ω, complex, shape (n,)) between the source's poles at n electrical angles.

        Raises ValueError where the source has no path.
        """
        if not self.drives_current:
            raise ValueError("driving_point_impedance(): the source has no path through the motor")
        mean, cos, sin = self._inertances
        inertance = (
            mean
            + np.cos(2 * angles)[:, np.newaxis, np.newaxis] * cos
            + np.sin(2 * angles)[:, np.newaxis, np.newaxis] * sin
        )
        matrix = self.damping + 1j * angular_frequency * inertance
        result: np.ndarray
        if self.loops == 1:
            result = matrix[:, 0, 0] / self.drive[0] ** 2
        elif self.loops == 2:
            first, mutual, second = matrix[:, 0, 0], matrix[:, 0, 1], matrix[:, 1, 1]
            a, b = self.drive.tolist()
            result = (first * second - mutual**2) / (a * a * second - 2.0 * a * b * mutual + b * b * first)
        else:
            right = np.broadcast_to(self.drive[:, np.newaxis], (len(angles), self.loops, 1))
            result = 1.0 / (self.drive @ np.linalg.solve(matrix, right)[:, :, 0].T)
        return result


def modes(damping: FloatArray, inertance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return decay rates (1/s) and shapes V of M·x' = −K·x, with Vᵀ·M·V = 1."""
    if len(damping) == 0:
        return np.zeros(0), np.zeros((0, 0))
    if len(damping) == 1:
        return damping[0] / inertance[0], 1.0 / np.sqrt(inertance)
    # LAPACK itself: round a matrix of two, scipy.linalg.eigh's checks take ten times as long.
    rates, shapes, failed = dsygvd(damping, inertance, uplo="L")
    if failed:
        raise np.linalg.LinAlgError(f"a circuit without modes: dsygvd says {failed}")
    return rates, shapes
