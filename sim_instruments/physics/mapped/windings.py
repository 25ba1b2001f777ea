"""Windings whose fluxes follow a law of both currents: a flux map, or constants with a loss in the iron."""

import math
from functools import cached_property

import numpy as np

from sim_instruments.physics.circuits.windings import AXES, ComplexArray, FloatArray, Windings, axis_matrices, turned
from sim_instruments.physics.motor.flux_law import LinearFlux, MappedFlux, WindingFlux, magnetising, magnetising_flux
from sim_instruments.physics.motor.motor import VirtualMotor


class MappedWindings(Windings):
    """Windings that link ψ(θ, i) = Sᵀ·ψ_dq(m) + Z·i + rest(θ), with S their shares in the axes and S·i·⅔ = m + g·jψ_dq(m).

    `law` is ψ_dq of a winding; g is what the iron's loss takes at a speed. The rest is what the magnets make beside the law's own
    share: harmonics, and windings of unlike EMF.
    """

    def __init__(self, motor: VirtualMotor, temperature: float, magnet_temperature: float | None = None) -> None:
        super().__init__(motor, temperature, magnet_temperature)
        delta = motor.connection == "delta"
        self.law: WindingFlux
        if motor.flux_map is None:
            self.law = LinearFlux(self.flux_linkage, motor.d_axis_inductance, motor.q_axis_inductance)
        else:
            self.law = MappedFlux(motor.flux_map, self.flux_linkage, delta=delta)
        self._turns = np.array(motor.turn_shares)
        #: By how much a delta's winding takes less loss current for its flux than the Y-equivalent.
        self.loss_scale = 1.0 / 3.0 if delta else 1.0
        _, _, dd, dq, qd, qq = self.law.at(0.0, 0.0)
        squares = np.outer(self._turns, self._turns)
        mean, cos, sin = axis_matrices(dd, 0.5 * (dq + qd), qq)
        #: Z (H): what a zero sequence finds.
        self.zero_sequence: FloatArray = squares * (motor.winding_zero_sequence_inductance / 3.0)
        # Small signals about no current: what a bridge finds.
        self.inductance_mean = squares * mean + self.zero_sequence
        self.inductance_cos, self.inductance_sin = squares * cos, squares * sin

    @cached_property
    def rest_phasors(self) -> ComplexArray:
        """The EMF's phasors per electrical speed (V·s/rad, (3, orders)) without the law's share."""
        rest = self.emf_phasors.copy()
        rest[:, self.emf_orders.index(1)] -= 1j * self.flux_linkage * self._turns * np.exp(-1j * AXES)
        rest[np.abs(rest) < 1e-14 * abs(self.flux_linkage)] = 0.0
        return rest

    def rest_per_speed(self, angles: FloatArray) -> FloatArray:
        """Return the rest's EMF over electrical speed (V·s/rad, (3, n)) at n angles."""
        return (self.rest_phasors @ turned(angles, self.emf_orders)).real

    def rest_flux(self, angles: FloatArray) -> FloatArray:
        """Return the rest's flux linkages (V·s, (3, n)) at n angles."""
        per_order = self.rest_phasors / (1j * np.array(self.emf_orders))
        return (per_order @ turned(angles, self.emf_orders)).real

    def shares(self, angles: FloatArray) -> FloatArray:
        """Return S (2, 3, n), the windings' shares in d and q axis at n angles."""
        shifted = angles - AXES[:, np.newaxis]
        result: FloatArray = np.array([np.cos(shifted), -np.sin(shifted)]) * self._turns[:, np.newaxis]
        return result

    def lost_share(self, speeds: FloatArray) -> FloatArray:
        """Return g (A/(V·s), a winding's) at electrical speeds (rad/s)."""
        return self.loss_scale * self.motor.iron.lost_share(speeds)

    def axis_fluxes(
        self, shares: FloatArray, speeds: FloatArray, currents: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the magnetising currents (A, (2, n)) and what the law gives there (6, n), of winding currents (3, n)."""
        d, q = (2.0 / 3.0) * np.einsum("akn,kn->an", shares, currents)
        return magnetising(self.law, d, q, self.lost_share(speeds))

    def drops(self, angles: FloatArray, speeds: FloatArray, currents: FloatArray, slopes: FloatArray) -> FloatArray:
        """Return the voltage drops (V, shape (3, n)) along the windings; how the iron's loss changes with the speed is left out."""
        shares = self.shares(angles)
        _, found = self.axis_fluxes(shares, speeds, currents)
        d_flux, q_flux = found[:2]
        direct, quadrature = shares
        d, q = (2.0 / 3.0) * np.einsum("akn,kn->an", shares, currents)
        d_slope, q_slope = (2.0 / 3.0) * np.einsum("akn,kn->an", shares, slopes)
        follow = slopes_behind_loss(found, self.lost_share(speeds))
        flux_slopes = np.einsum("abn,bn->an", follow, np.array([d_slope + speeds * q, q_slope - speeds * d]))
        result: FloatArray = (
            self.resistance[:, np.newaxis] * currents
            + direct * (flux_slopes[0] - speeds * q_flux)
            + quadrature * (flux_slopes[1] + speeds * d_flux)
            + self.zero_sequence @ slopes
            + speeds * self.rest_per_speed(angles)
        )
        return result

    def torque(self, angles: FloatArray, currents: FloatArray, speeds: FloatArray | None = None) -> FloatArray:
        """Return the torque (N·m, shape (n,)) of currents (3, n) on the rotor, what the iron brakes taken off."""
        still = np.zeros_like(angles) if speeds is None else speeds
        (d, q), found = self.axis_fluxes(self.shares(angles), still, currents)
        rest = np.sum(currents * self.rest_per_speed(angles), axis=0)
        result: FloatArray = self.pole_pairs * (1.5 * (found[0] * q - found[1] * d) + rest)
        return result

    def iron_loss(self, angles: FloatArray, currents: FloatArray, speeds: FloatArray) -> FloatArray:
        """Return the iron's loss (W, shape (n,)) at winding currents (3, n)."""
        _, found = self.axis_fluxes(self.shares(angles), speeds, currents)
        result: FloatArray = 1.5 * speeds * self.lost_share(speeds) * (found[0] ** 2 + found[1] ** 2)
        return result

    def flux_linkages_y(self, currents: ComplexArray, speeds: FloatArray) -> ComplexArray:
        """Return the flux linkages (V·s, d + j·q) of the Y-equivalent at currents (A, d + j·q, peak) and electrical speeds (rad/s)."""
        if currents.size == 1 == speeds.size:
            # What an inverter's samples ask for, thousands of times: arrays of one number cost a hundred times as much.
            one = self.flux_linkage_of(complex(currents.flat[0]), float(speeds.flat[0]))
            return np.array([one], dtype=np.complex128)
        scale = math.sqrt(self.loss_scale)
        d, q = (scale * np.atleast_1d(part).astype(np.float64) for part in (currents.real, currents.imag))
        _, found = magnetising(self.law, d, q, np.broadcast_to(self.lost_share(speeds), d.shape))
        result: ComplexArray = scale * (found[0] + 1j * found[1])
        return result

    def axis_inductances(self, angle: float) -> tuple[FloatArray, ...]:
        """Return Z and the parts (3×3 each) of L(θ) that ∂ψd/∂id, ∂ψd/∂iq, ∂ψq/∂id and ∂ψq/∂iq make."""
        direct, quadrature = self.axes(angle)
        pairs = ((direct, direct), (direct, quadrature), (quadrature, direct), (quadrature, quadrature))
        return self.zero_sequence, *((2.0 / 3.0) * np.outer(row, column) for row, column in pairs)

    def flux_linkage_of(self, current: complex, speed: float) -> complex:
        """Return the same of one current (A, d + j·q, peak) at one electrical speed (rad/s)."""
        scale, iron = math.sqrt(self.loss_scale), self.motor.iron
        lost = math.copysign(iron.hysteresis_loss, speed) if speed else 0.0
        return scale * magnetising_flux(self.law, scale * current, self.loss_scale * (lost + iron.eddy_loss * speed))

    def flux(self, angle: float, currents: FloatArray) -> FloatArray:
        """Return the flux linkages (V·s, (3,)) of the windings at an angle and winding currents (A, (3,)), the rotor standing."""
        direct, quadrature = self.axes(angle)
        d, q = (2.0 / 3.0) * (self.axes(angle) @ currents)
        d_flux, q_flux, *_ = self.law.at(float(d), float(q))
        result: FloatArray = direct * d_flux + quadrature * q_flux + self.zero_sequence @ currents
        return result + self.rest_flux(np.array([angle]))[:, 0]


def slopes_behind_loss(found: FloatArray, lost: FloatArray) -> FloatArray:
    """Return how the axes' fluxes follow the currents that hold the loss's share: J·(1 + g·jJ)⁻¹ (H, (2, 2, n)).

    J are the differential inductances that the law has `found`.
    """
    _, _, dd, dq, qd, qq = found
    inductances = np.array([[dd, dq], [qd, qq]])
    if not lost.any():
        return inductances
    a, b, c, d = 1.0 - lost * qd, -lost * qq, lost * dd, 1.0 + lost * dq
    inverse = np.array([[d, -b], [-c, a]]) / (a * d - b * c)
    result: FloatArray = np.einsum("abn,bcn->acn", inductances, inverse)
    return result


def windings_of(motor: VirtualMotor, temperature: float, magnet_temperature: float | None = None) -> Windings:
    """Return a motor's windings at a temperature (°C), the magnets' the same or their own, by the law that it follows."""
    kind = MappedWindings if motor.follows_flux else Windings
    return kind(motor, temperature, magnet_temperature)
