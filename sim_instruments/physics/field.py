"""Currents that an inverter impresses: a field that rotates in the motor's coordinates, or stands still in the rotor's."""

import math
from collections.abc import Callable

import numpy as np

from sim_instruments.physics.circuits.network import Network
from sim_instruments.physics.circuits.rotor_frame import RotorFrame
from sim_instruments.physics.circuits.source import VoltageSource
from sim_instruments.physics.circuits.windings import ComplexArray, FloatArray
from sim_instruments.physics.circulating import CirculatingCurrent
from sim_instruments.physics.motion.motion import Motion

_PHASES = np.arange(3)[:, np.newaxis] * (2.0 * math.pi / 3.0)


class ImpressedField:
    """Terminal currents I·cos(ψ − k·120°), with ψ the electrical angle of the field and I its amplitude (A, peak).

    The ripple at the switching frequency is seen in the currents; voltages are the mean over a switching period.
    What circulates in a delta is the steady state's (`CirculatingCurrent`).
    """

    def __init__(
        self,
        network: Network,
        motion: Motion,
        field: Motion | None,
        amplitude: Callable[[FloatArray], FloatArray],
        *,
        ripple: float,
        switching_frequency: float,
        source: VoltageSource,
    ) -> None:
        self.network = network
        self.motion = motion
        self.field = field
        self.amplitude = amplitude
        self._ripple = ripple
        self._source = source
        self._switching = 2.0 * math.pi * switching_frequency
        # Of all winding currents that give the terminals theirs, those without a circulating part.
        self._to_windings: FloatArray = np.asarray(np.linalg.pinv(network.windings.incidence), dtype=np.float64)
        self._circulating = CirculatingCurrent.of(network.windings, self._to_windings)

    def field_angle(self, times: FloatArray) -> FloatArray:
        """Return the field's electrical angle (rad) from terminal A's axis."""
        if self.field is not None:
            return self.field.angle(times)
        windings = self.network.windings
        return self.motion.angle(times) * windings.pole_pairs - windings.phase_shift + 0.5 * math.pi

    def field_speed(self, times: FloatArray) -> FloatArray:
        """Return the field's electrical speed (rad/s)."""
        if self.field is not None:
            return self.field.speed(times)
        return self.motion.speed(times) * self.network.windings.pole_pairs

    def winding_currents(self, times: FloatArray) -> FloatArray:
        """Return the winding currents (A, shape (3, n)), switching ripple included."""
        amplitude = self.amplitude(times)
        terminals = amplitude * np.cos(self.field_angle(times) - _PHASES)
        terminals += self._ripple * amplitude * np.cos(self._switching * times - _PHASES)
        result: FloatArray = self._to_windings @ terminals
        return result if self._circulating is None else result + self._round(times)[0]

    def smooth_currents(self, times: FloatArray) -> FloatArray:
        """Return the winding currents (A, shape (3, n)) without the ripple."""
        result: FloatArray = self._to_windings @ (self.amplitude(times) * np.cos(self.field_angle(times) - _PHASES))
        return result if self._circulating is None else result + self._round(times)[0]

    def drops(self, times: FloatArray) -> FloatArray:
        """Return the voltage drops (V, shape (3, n)) along the windings."""
        windings = self.network.windings
        angles = self.motion.angle(times) * windings.pole_pairs
        speeds = self.motion.speed(times) * windings.pole_pairs
        currents, slopes = self.smooth_currents(times), self._to_windings @ self._turning(times)
        if self._circulating is not None:
            slopes = slopes + self._round(times)[1]
        return windings.drops(angles, speeds, currents, slopes)

    def source_voltage(self, times: FloatArray) -> FloatArray:
        """Return the output voltage (V) of a supply that is no part of this circuit: its terminals are open."""
        return self._source.at(times)

    def _round(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return what circulates in a delta (A) and how it changes (A/s), shapes (n,)."""
        if self._circulating is None:
            raise ValueError("ImpressedField: nothing circulates in these windings")
        pairs = self.network.windings.pole_pairs
        turned = np.exp(1j * (self.field_angle(times) - _PHASES))
        terminals = np.asarray(self.amplitude(times) * turned, dtype=np.complex128)
        return self._circulating.at(
            self.motion.angle(times) * pairs, self.motion.speed(times) * pairs, terminals, self.field_speed(times)
        )

    def _turning(self, times: FloatArray) -> FloatArray:
        """Return how the terminal currents change (A/s, shape (3, n))."""
        return -self.amplitude(times) * np.sin(self.field_angle(times) - _PHASES) * self.field_speed(times)


class RotorField(ImpressedField):
    """Terminal currents that stand still in the rotor's coordinates: `currents` (A, d + j·q, shape (n,)) at times (s).

    `offset` (A, complex: along terminal A's axis, and across it) stands still in the stator: what sensors do not see of a current. The
    voltages are `frame`'s, of which `limited` tells where (1.0) they bound the currents; `slopes` (A/s) is how these change, None where
    they do not.
    """

    def __init__(
        self,
        network: Network,
        motion: Motion,
        currents: Callable[[FloatArray], ComplexArray],
        frame: RotorFrame,
        *,
        limited: Callable[[FloatArray], FloatArray],
        slopes: Callable[[FloatArray], ComplexArray] | None = None,
        offset: complex = 0j,
        ripple: float,
        switching_frequency: float,
        source: VoltageSource,
    ) -> None:
        super().__init__(
            network,
            motion,
            None,
            lambda times: np.abs(self.dq_currents(times)),
            ripple=ripple,
            switching_frequency=switching_frequency,
            source=source,
        )
        self._currents, self._frame, self._offset, self._slopes = currents, frame, offset, slopes
        self.limited = limited

    def rotor_angle(self, times: FloatArray) -> FloatArray:
        """Return the d axis' electrical angle (rad) from terminal A's axis."""
        windings = self.network.windings
        return self.motion.angle(times) * windings.pole_pairs - windings.phase_shift

    def regulated_currents(self, times: FloatArray) -> ComplexArray:
        """Return the currents (A, d + j·q) that stand still in the rotor's coordinates."""
        return self._currents(times)

    def dq_currents(self, times: FloatArray) -> ComplexArray:
        """Return the actual currents (A, d + j·q), the offset included."""
        result: ComplexArray = self._currents(times)
        if self._offset:
            result = result + self._offset * np.exp(-1j * self.rotor_angle(times))
        return result

    def dq_voltages(self, times: FloatArray) -> ComplexArray:
        """Return the voltages (V, d + j·q, in the true rotor's coordinates) that the bridge is commanded, dead time included.

        Of a rotor that turns they are means over an electrical turn: a regulator does not follow the harmonics. One that stands has
        its momentary ones, of each phase's own resistance and leg.
        """
        speed = self.motion.speed(times) * self.network.windings.pole_pairs
        standing = np.all(speed == 0.0)
        if not standing:
            needed = self._frame.voltage(self._currents(times), speed)
            if self._slopes is not None:
                needed = needed + self._frame.induced(self._currents(times), self._slopes(times), speed)
            return needed
        windings, wires = self.network.windings, self.network.wire_resistances[:, np.newaxis]
        turned_back = np.exp(-1j * self.rotor_angle(times))
        terminals = np.real(self.dq_currents(times) / turned_back * np.exp(-1j * _PHASES))
        drops = self.drops(times)
        if windings.motor.connection == "delta":
            drops = np.array([drops[0] - drops[2], drops[1] - drops[0], drops[2] - drops[1]]) / 3.0
        legs = drops + wires * terminals + self._frame.bridge.of_legs(terminals)
        result: ComplexArray = (2.0 / 3.0) * np.sum(legs * np.exp(1j * _PHASES), axis=0) * turned_back
        return result

    def field_angle(self, times: FloatArray) -> FloatArray:
        """Return the electrical angle (rad) of the currents from terminal A's axis."""
        return self.rotor_angle(times) + np.angle(self.dq_currents(times))

    def _turning(self, times: FloatArray) -> FloatArray:
        """Return how the terminal currents change (A/s, shape (3, n)): they turn with the rotor, but for the offset."""
        changing = 1j * self.field_speed(times) * self._currents(times)
        if self._slopes is not None:
            changing = changing + self._slopes(times)
        return np.real(changing * np.exp(1j * self.rotor_angle(times)) * np.exp(-1j * _PHASES))


class Synchronous:
    """The capability of a rotating field of given amplitude: pull-out torque, load angle, and the voltage that it requires.

    All for the Y-equivalent; `resistance` Ω, inductances H, `flux_linkage` V·s/rad, `amplitude` A peak.
    """

    def __init__(
        self, resistance: float, ld: float, lq: float, flux_linkage: float, pole_pairs: int, amplitude: float
    ) -> None:
        self._resistance = resistance
        self._ld, self._lq, self._flux = ld, lq, flux_linkage
        self._p = pole_pairs
        self._amplitude = amplitude
        self._angles = np.linspace(0.0, math.pi, 1441)
        torque = self._torque(self._angles)
        self._peak = int(np.argmax(torque))
        self._torques = torque[: self._peak + 1]
        self.pull_out_torque = float(torque[self._peak])

    def _torque(self, load_angle: FloatArray) -> FloatArray:
        along, across = self._amplitude * np.cos(load_angle), self._amplitude * np.sin(load_angle)
        return 1.5 * self._p * (self._flux * across + (self._ld - self._lq) * along * across)

    def load_angle(self, torque: float) -> float:
        """Return the angle (rad, 0…π) by which the field leads the d axis at a torque (N·m); π/2-like at pull-out."""
        size = min(abs(torque), self.pull_out_torque)
        angle = float(np.interp(size, np.maximum.accumulate(self._torques), self._angles[: self._peak + 1]))
        return math.copysign(angle, torque)

    def voltage(self, electrical_speed: float, torque: float) -> float:
        """Return the phase voltage (V, peak) that the current takes at an electrical speed (rad/s) and torque (N·m)."""
        angle = self.load_angle(abs(torque))
        speed = abs(electrical_speed)
        along, across = self._amplitude * math.cos(angle), self._amplitude * math.sin(angle)
        direct = self._resistance * along - speed * self._lq * across
        quadrature = self._resistance * across + speed * (self._flux + self._ld * along)
        return math.hypot(direct, quadrature)


def q_current_within(
    wanted: float,
    electrical_speed: FloatArray,
    *,
    voltage: float,
    resistance: float,
    inductance: float,
    flux_linkage: float,
) -> FloatArray:
    """Return the q-axis current (A) nearest to the one wanted that a phase voltage (V, peak) allows at given speeds.

    Zero where not even the best current would bring the EMF within the voltage.
    """
    emf = electrical_speed * flux_linkage
    a = resistance**2 + (electrical_speed * inductance) ** 2
    half_b = resistance * emf
    discriminant = half_b**2 - a * (emf**2 - voltage**2)
    root = np.sqrt(np.maximum(discriminant, 0.0))
    return np.where(discriminant > 0.0, np.clip(wanted, (-half_b - root) / a, (-half_b + root) / a), 0.0)
