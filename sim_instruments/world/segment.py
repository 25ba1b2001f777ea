"""A stretch of bench time in which one set of closed-form laws holds."""

import math
from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np

from sim_instruments.physics.circuits.network import Network
from sim_instruments.physics.circuits.transient import LinearTransient
from sim_instruments.physics.circuits.windings import FloatArray, Windings
from sim_instruments.physics.commutated import Commutated
from sim_instruments.physics.field import ImpressedField
from sim_instruments.physics.mapped.windings import MappedWindings
from sim_instruments.physics.motion.motion import Motion, RestingShaft
from sim_instruments.physics.rotating import Rotating
from sim_instruments.physics.swing import Shaft

Outcome = Literal["none", "standstill", "breakaway", "trip voltage", "trip current", "lost step", "let go"]
#: Gauss-Legendre's points and weights on −1 … 1, and where in a segment transients are looked at more closely.
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_NEAR = 0.5 ** np.arange(24.0)
#: Where the pieces of a segment at rest begin and end, as shares of it: the two halves, and closer near its start.
_AT_REST = np.sort(np.concatenate([[0.0, 0.5, 1.0], _NEAR[1:]]))

SupplyMode = Literal["off", "cv", "cc", "unregulated", "tripped"]


class Circuit(Protocol):
    """Currents and voltages over time."""

    network: Network

    def winding_currents(self, times: FloatArray) -> FloatArray:
        """Return the winding currents (A, shape (3, n))."""

    def drops(self, times: FloatArray) -> FloatArray:
        """Return the voltage drops (V, shape (3, n)) along the windings."""

    def source_voltage(self, times: FloatArray) -> FloatArray:
        """Return the voltage (V) behind the source's resistance."""


@dataclass(frozen=True)
class FieldState:
    """The inverter's field: electrical `angle` (rad) from terminal A's axis, `speed` (rad/s), rotor in step or not."""

    angle: float
    speed: float
    in_step: bool


@dataclass(frozen=True)
class State:
    """The state that carries over from one segment to the next."""

    angle: float
    speed: float
    winding_currents: FloatArray
    source_voltage: float
    temperature: float
    constant_current_since: float | None = None
    breaking_away: bool = False
    field: FieldState | None = None
    eddy_currents: FloatArray | None = None
    magnet_temperature: float | None = None
    contact_warmth: FloatArray | None = None


@dataclass(frozen=True)
class DynamometerLaw:
    """The torque of the dynamometer's machine: none, a constant one (N·m), or the one that the motion requires.

    `cogging` says that what the motion takes holds the motor's cogging torque.
    """

    kind: Literal["idle", "constant", "balance"] = "idle"
    torque: float = 0.0
    cogging: bool = False


@dataclass(frozen=True)
class Segment:
    """Laws that hold from `start` until `end` (s, infinite while nothing is due), and what then happens by itself.

    `reversals` are the times (s) at which the shaft turns back in between.
    """

    start: float
    end: float
    motion: Motion
    circuit: Circuit
    windings: Windings
    shaft: Shaft
    live: bool
    supply_mode: SupplyMode = "off"
    outcome: Outcome = "none"
    dynamometer: DynamometerLaw = field(default_factory=DynamometerLaw)
    in_step: bool = True
    reversals: tuple[float, ...] = ()

    def winding_currents(self, times: FloatArray) -> FloatArray:
        """Return the winding currents (A, shape (3, n))."""
        return self.circuit.winding_currents(times)

    def terminal_currents(self, times: FloatArray) -> FloatArray:
        """Return the currents (A, shape (3, n)) into terminals A, B, C."""
        return self.circuit.network.terminal_currents(self.winding_currents(times))

    def node_potentials(self, times: FloatArray) -> FloatArray:
        """Return the potentials (V, shape (5, n)) of A, B, C, N and the artificial star."""
        circuit = self.circuit
        return circuit.network.node_potentials(
            circuit.drops(times), circuit.winding_currents(times), circuit.source_voltage(times)
        )

    def output_voltage(self, times: FloatArray) -> FloatArray:
        """Return the voltage (V) at the supply's output."""
        loss = self.circuit.network.source_resistance * self.output_current(times)
        return self.circuit.source_voltage(times) - loss

    def output_current(self, times: FloatArray) -> FloatArray:
        """Return the supply's output current (A)."""
        return self.circuit.network.source_current(self.winding_currents(times))

    def motor_torque(self, times: FloatArray) -> FloatArray:
        """Return the motor's electromagnetic torque (N·m); without the switching ripple's share, of a six-step drive its mean."""
        iron = self.windings.motor.iron.loses
        if not (self.live or iron):
            return np.zeros_like(times)
        circuit = self.circuit
        if isinstance(circuit, Commutated):
            return circuit.torque(times)
        if isinstance(circuit, Rotating):
            currents = circuit.magnetising_currents(times)
        elif isinstance(circuit, ImpressedField):
            currents = circuit.smooth_currents(times)
        else:
            currents = circuit.winding_currents(times)
        pairs = self.windings.pole_pairs
        speeds = self.motion.speed(times) * pairs if iron else None
        return self.windings.torque(self.motion.angle(times) * pairs, currents, speeds)

    @property
    def steady_dynamometer_torque(self) -> float | None:
        """The dynamometer machine's air-gap torque (N·m) where it is the same throughout, None where it is not."""
        return None if self.dynamometer.kind == "balance" else self.dynamometer.torque

    def dynamometer_torque(self, times: FloatArray) -> FloatArray:
        """Return the dynamometer machine's air-gap torque (N·m)."""
        if self.dynamometer.kind == "idle":
            return np.zeros_like(times)
        if self.dynamometer.kind == "constant":
            return np.full_like(times, self.dynamometer.torque)
        speed, shaft = self.motion.speed(times), self.shaft
        friction = shaft.frictions(speed)
        torque: FloatArray = shaft.inertia * self.motion.acceleration(times) + friction - self.motor_torque(times)
        rubbing = self.windings.motor.rubbing_torque
        if rubbing:
            torque = torque + 0.5 * rubbing * np.sign(speed) * np.cos(self.motion.angle(times))
        return torque - self.windings.cogging(self.motion.angle(times)) if self.dynamometer.cogging else torque

    def hall_voltages(self, times: FloatArray) -> FloatArray:
        """Return the voltages (V, shape (3, n)) of Hall leads H1, H2, H3 against H0; zero for a motor without sensors."""
        windings = self.windings
        halls = windings.motor.halls
        if halls is None:
            return np.zeros((3, len(times)))
        return halls.levels(self.motion.angle(times) * windings.pole_pairs - windings.phase_shift)

    @property
    def warms(self) -> bool:
        """True if there are currents that warm the windings."""
        return self.live and not (isinstance(self.circuit, LinearTransient) and self.circuit.dead)

    def copper_loss(self, times: FloatArray) -> FloatArray:
        """Return the loss (W) in the windings that warms them; of a six-step drive its mean over a state."""
        if not self.warms:
            return np.zeros_like(times)
        if isinstance(self.circuit, Commutated):
            return self.circuit.copper_loss(times)
        return self.windings.resistance @ self.winding_currents(times) ** 2

    def iron_loss(self, times: FloatArray) -> FloatArray:
        """Return the loss (W, shape (n,)) in the iron."""
        if not isinstance(self.windings, MappedWindings):
            return np.zeros_like(times)
        pairs = self.windings.pole_pairs
        angles, speeds = self.motion.angle(times) * pairs, self.motion.speed(times) * pairs
        return self.windings.iron_loss(angles, self.winding_currents(times), speeds)

    def field_frequency(self, time: float) -> float:
        """Return the frequency (Hz, signed) of the inverter's field, 0 without one."""
        if not isinstance(self.circuit, ImpressedField):
            return 0.0
        return float(self.circuit.field_speed(np.array([time]))[0]) / (2.0 * math.pi)

    def current_amplitude(self, time: float) -> float:
        """Return the amplitude (A, peak) of the inverter's currents, 0 without them."""
        if not isinstance(self.circuit, ImpressedField):
            return 0.0
        return float(self.circuit.amplitude(np.array([time]))[0])

    def q_axis_current(self, time: float) -> float:
        """Return the part (A, peak, signed) of the inverter's current that makes torque, 0 without one."""
        if not isinstance(self.circuit, ImpressedField):
            return 0.0
        at = np.array([time])
        rotor = self.motion.angle(at) * self.windings.pole_pairs - self.windings.phase_shift
        return float((self.circuit.amplitude(at) * np.sin(self.circuit.field_angle(at) - rotor))[0])

    def nodes_between(self, start: float, end: float) -> tuple[FloatArray, FloatArray]:
        """Return times and weights (s) of a quadrature over a part of the segment.

        Fine near the segment's start, where transients are, and fine enough for the rotor's turning.
        """
        pieces = 2
        if not isinstance(self.motion, RestingShaft):
            first, last = self.motion.angle(np.array([start, end])).tolist()
            turned = abs(last - first) * self.windings.pole_pairs
            pieces = int(min(max(4.0 * turned / math.pi, 1.0), 512.0)) + 1
        elif start == self.start:
            return _quadrature(start + (end - start) * _AT_REST, end)
        edges = start + (end - start) / pieces * np.arange(pieces + 1.0)
        edges[-1] = end
        if not math.isinf(self.start):
            near = self.start + (end - self.start) * _NEAR
            if start > self.start:
                near = near[near > start]
            edges = np.concatenate([edges, near[1:] if len(near) else near])
            edges.sort()
        return _quadrature(edges, end)


def _quadrature(edges: FloatArray, end: float) -> tuple[FloatArray, FloatArray]:
    """Return times and weights (s) of a quadrature over the pieces between edges, the last of which is put at `end` (s)."""
    edges[-1] = end
    begin, stop = edges[:-1], edges[1:]
    half = (0.5 * (stop - begin))[:, np.newaxis]
    times = half * _POINTS
    times += (0.5 * (stop + begin))[:, np.newaxis]
    return times.ravel(), (half * _WEIGHTS).ravel()
