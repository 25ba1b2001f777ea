"""Three windings and a rotor: inductance, flux, EMF and torque for any winding currents."""

import math
from collections.abc import Sequence
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.physics.motor.saturation import Saturation

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_CLARKE = np.array([[1.0, -0.5, -0.5], [0.0, math.sqrt(0.75), -math.sqrt(0.75)]])
#: Electrical angle (rad) of each winding's magnetic axis.
AXES = np.arange(3) * (2.0 * math.pi / 3.0)

#: Terminal currents from winding currents: of a wye the same, of a delta (windings AB, BC, CA) their differences.
INCIDENCE = {
    "wye": np.eye(3),
    "delta": np.array([[1.0, 0.0, -1.0], [-1.0, 1.0, 0.0], [0.0, -1.0, 1.0]]),
}


def axis_matrices(ld: float, cross: float, lq: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the three parts (H, 3×3) of what windings in three axes find of the inductances in d and q axis and between them.

    The whole is mean + cos·cos 2θ + sin·sin 2θ, without a zero sequence.
    """
    half, onto = 0.5 * (ld - lq), (2.0 / 3.0) * _CLARKE.T
    direct, mutual = np.diag([1.0, -1.0]), np.array([[0.0, 1.0], [1.0, 0.0]])
    return (
        0.5 * (ld + lq) * onto @ _CLARKE,
        onto @ (half * direct + cross * mutual) @ _CLARKE,
        onto @ (half * mutual - cross * direct) @ _CLARKE,
    )


@lru_cache(maxsize=64)
def _inductances(
    ld: float, lq: float, zero_sequence: float, turns: tuple[float, ...]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return L_mean, L_cos, L_sin of L(θ) = L_mean + L_cos·cos 2θ + L_sin·sin 2θ (H, 3×3 each, read-only)."""
    squares = np.outer(turns, turns)
    mean, half = 0.5 * (ld + lq), 0.5 * (ld - lq)
    # Clarke's transform of the dq values, amplitude-invariant.
    parts = (
        squares * (mean * (2.0 / 3.0) * _CLARKE.T @ _CLARKE + zero_sequence / 3.0),
        squares * (half * (2.0 / 3.0) * _CLARKE.T @ np.diag([1.0, -1.0]) @ _CLARKE),
        squares * (half * (2.0 / 3.0) * _CLARKE.T @ np.array([[0.0, 1.0], [1.0, 0.0]]) @ _CLARKE),
    )
    for shared in parts:
        shared.flags.writeable = False
    return parts


@lru_cache(maxsize=64)
def _emf_shape(
    shares: tuple[float, ...], harmonics: tuple[tuple[int, float, float], ...]
) -> tuple[tuple[int, ...], ComplexArray]:
    """Return the orders of the magnets' EMF, and its phasors per flux linkage (3, orders; read-only)."""
    orders = np.array([order for order, _, _ in harmonics])
    amplitudes = np.array([amplitude for _, amplitude, _ in harmonics])
    phases = np.array([phase for _, _, phase in harmonics])
    shape: ComplexArray = 1j * amplitudes * np.exp(1j * (phases - np.multiply.outer(AXES, orders)))
    shape *= np.array(shares)[:, np.newaxis]
    shape.flags.writeable = False
    return tuple(orders.tolist()), shape


def turned(angles: FloatArray, orders: Sequence[int]) -> ComplexArray:
    """Return exp(j·order·angle), shape (orders, n); orders are positive."""
    # Products of powers: a sine costs many times what a product does.
    powers: dict[int, ComplexArray] = {1: np.exp(1j * angles)}

    def power(order: int) -> ComplexArray:
        if order not in powers:
            powers[order] = power(order // 2) * power(order - order // 2)
        return powers[order]

    return np.array([power(order) for order in orders])


class Windings:
    """A motor's windings at one temperature. Angles are electrical, from winding 0's axis to the d axis.

    The magnets are as warm as the windings, or have a temperature (°C) of their own.
    """

    def __init__(self, motor: VirtualMotor, temperature: float, magnet_temperature: float | None = None) -> None:
        self.motor = motor
        self.temperature = temperature
        self.magnet_temperature = temperature if magnet_temperature is None else magnet_temperature
        self.incidence: FloatArray = INCIDENCE[motor.connection]
        self.resistance: FloatArray = np.array(motor.resistances_at(temperature))
        self.flux_linkage = motor.flux_linkage_at(self.magnet_temperature)
        self.inductance_mean, self.inductance_cos, self.inductance_sin = _inductances(
            motor.d_axis_inductance,
            motor.q_axis_inductance,
            motor.winding_zero_sequence_inductance,
            tuple(motor.turn_shares),
        )
        #: Orders of the magnets' EMF, and its phasors per electrical speed (V·s/rad, shape (3, orders)), turning with
        #: exp(j·order·θ).
        shares = tuple(emf * turns for emf, turns in zip(motor.emf_shares, motor.turn_shares, strict=True))
        self.emf_orders, shape = _emf_shape(shares, ((1, 1.0, 0.0), *motor.flux_harmonics))
        self.emf_phasors: ComplexArray = self.flux_linkage * shape

    @cached_property
    def saturation(self) -> Saturation | None:
        """Saturation in the windings' own inductances and currents, None where there is none."""
        return self.motor.winding_saturation

    @property
    def pole_pairs(self) -> int:
        """Pole pairs."""
        return self.motor.pole_pairs

    @property
    def phase_shift(self) -> float:
        """Electrical angle (rad) by which terminal A's axis, of the Y-equivalent, lies ahead of winding 0's."""
        return math.pi / 6.0 if self.motor.connection == "delta" else 0.0

    @property
    def flux_linkage_y(self) -> float:
        """Peak phase flux linkage (V·s/rad) of the Y-equivalent at this temperature."""
        return self.flux_linkage / math.sqrt(3.0) if self.motor.connection == "delta" else self.flux_linkage

    @property
    def resistance_y(self) -> float:
        """Mean phase resistance (Ω) of the Y-equivalent at this temperature."""
        ratio = float(self.resistance[0]) / self.motor.phase_resistances[0]
        return self.motor.stator_resistance_y * ratio

    def flux_linkages_y(self, currents: ComplexArray, speeds: FloatArray) -> ComplexArray:
        """Return the flux linkages (V·s, d + j·q) of the Y-equivalent at currents (A, d + j·q, peak) and electrical speeds (rad/s)."""
        motor = self.motor
        along = self.flux_linkage_y + motor.d_axis_inductance_y * currents.real
        return along + 1j * motor.q_axis_inductance_y * currents.imag

    def inductance(self, angle: float) -> FloatArray:
        """Return the inductance matrix (H, 3×3) at an electrical angle (rad)."""
        return (
            self.inductance_mean + self.inductance_cos * math.cos(2 * angle) + self.inductance_sin * math.sin(2 * angle)
        )

    def axes(self, angle: float) -> FloatArray:
        """Return the windings' shares (2, 3) in d and q axis at an electrical angle (rad): i_dq = ⅔·axes·i."""
        shifted = angle - AXES
        shares: FloatArray = np.array([np.cos(shifted), -np.sin(shifted)]) * np.array(self.motor.turn_shares)
        return shares

    def axis_inductances(self, angle: float) -> tuple[FloatArray, ...]:
        """Return Z (H), D and Q (3×3 each) of L(θ) = Z + Ld·D + Lq·Q at an electrical angle (rad)."""
        direct, quadrature = self.axes(angle)
        turns = self.motor.turn_shares
        zero = np.outer(turns, turns) * (self.motor.winding_zero_sequence_inductance / 3.0)
        return zero, np.outer(direct, direct) * (2.0 / 3.0), np.outer(quadrature, quadrature) * (2.0 / 3.0)

    def inductance_slope(self, angle: float) -> FloatArray:
        """Return dL/dθ (H/rad, 3×3) at an electrical angle (rad)."""
        return 2.0 * (self.inductance_sin * math.cos(2 * angle) - self.inductance_cos * math.sin(2 * angle))

    def inductance_times(self, angles: FloatArray, currents: FloatArray) -> FloatArray:
        """Return L(θ)·i for n angles and currents of shape (3, n)."""
        return (
            self.inductance_mean @ currents
            + np.cos(2 * angles) * (self.inductance_cos @ currents)
            + np.sin(2 * angles) * (self.inductance_sin @ currents)
        )

    def inductance_slope_times(self, angles: FloatArray, currents: FloatArray) -> FloatArray:
        """Return dL/dθ·i for n angles and currents of shape (3, n)."""
        return 2.0 * (
            np.cos(2 * angles) * (self.inductance_sin @ currents)
            - np.sin(2 * angles) * (self.inductance_cos @ currents)
        )

    def emf_per_speed(self, angles: FloatArray) -> FloatArray:
        """Return EMF over electrical speed (V·s/rad, shape (3, n)) at n electrical angles: dψ/dθ of the magnets."""
        return (self.emf_phasors @ turned(angles, self.emf_orders)).real

    def drops(self, angles: FloatArray, speeds: FloatArray, currents: FloatArray, slopes: FloatArray) -> FloatArray:
        """Return the voltage drops (V, shape (3, n)) along the windings.

        At n angles and electrical speeds (rad/s), with winding currents (A) and their derivatives (A/s) of shape (3, n).
        """
        return (
            self.resistance[:, np.newaxis] * currents
            + self.inductance_times(angles, slopes)
            + speeds * self.inductance_slope_times(angles, currents)
            + speeds * self.emf_per_speed(angles)
        )

    def torque(self, angles: FloatArray, currents: FloatArray, speeds: FloatArray | None = None) -> FloatArray:
        """Return the torque (N·m, shape (n,)) of currents (3, n) on the rotor, from the coenergy, at angles (n,).

        Electrical `speeds` (rad/s, (n,)) matter where iron brakes; without them the rotor stands.
        """
        reluctance = 0.5 * np.sum(currents * self.inductance_slope_times(angles, currents), axis=0)
        magnets = np.sum(currents * self.emf_per_speed(angles), axis=0)
        result: FloatArray = self.pole_pairs * (reluctance + magnets)
        return result

    def cogging(self, shaft_angle: FloatArray) -> FloatArray:
        """Return the cogging torque (N·m) at mechanical angles (rad); without a phase, zero is one of its rest positions."""
        motor = self.motor
        return -motor.cogging_torque * np.sin(motor.cogging_order * shaft_angle + motor.cogging_phase)
