"""One stretch of time between events: the circuit's exact solution, its values and its integrals."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim_instruments.six_step.circuit import Complex, ConductionCircuit, LinearForm, Real


@dataclass(frozen=True)
class ConductionSegment:
    """Solution of one circuit from a local time 0 on, at constant speed.

    Every quantity is Re Σ coefficient·exp(exponent·t); `modes` holds the coefficients of the modal currents,
    shape (n, n + 1 + H), over the exponents −rates, 0 and j·orders·electrical_speed. `emf_phase` is
    exp(j·orders·θ) at the local time 0. Times in s, speed in mechanical rad/s.
    """

    circuit: ConductionCircuit
    start: float
    duration: float
    speed: float
    exponents: Complex
    emf_phase: Complex
    modes: Complex

    def coefficients(self, form: LinearForm) -> Complex:
        """Coefficients over the exponents of the quantities in `form`, shape (m, n + 1 + H)."""
        n = len(self.circuit.rates)
        result: Complex = form.modal @ self.modes
        result[:, n] += form.constant
        result[:, n + 1 :] += self.speed * form.emf * self.emf_phase
        return result

    def values(self, form: LinearForm, local_times: Real) -> Real:
        """Values of the quantities in `form` at times since the segment's start, shape (m, len(times))."""
        waves = np.exp(self.exponents[:, None] * local_times[None, :])
        return np.asarray((self.coefficients(form) @ waves).real)

    def end_currents(self, duration: float) -> Real:
        """Winding currents after `duration` s, in A, shape (3,)."""
        return np.asarray(self.circuit.shapes @ (self.modes @ np.exp(self.exponents * duration)).real)

    def transition(self, duration: float) -> Real:
        """Sensitivity of the winding currents after `duration` s to those at the start, shape (3, 3)."""
        circuit = self.circuit
        return (circuit.shapes * np.exp(-circuit.rates * duration)) @ circuit.weights

    def integrals(self, form: LinearForm) -> Real:
        """Integrals over the segment of the quantities in `form`, shape (m,)."""
        return np.asarray((self.coefficients(form) @ _integral(self.exponents, self.duration)).real)

    def product_integrals(self, form: LinearForm) -> Real:
        """Integrals over the segment of all products of two quantities in `form`, shape (m, m)."""
        c = self.coefficients(form)
        mu = self.exponents
        plain = _integral(mu[:, None] + mu[None, :], self.duration)
        mixed = _integral(mu[:, None] + mu.conj()[None, :], self.duration)
        return np.asarray(0.5 * (c @ plain @ c.T + c @ mixed @ c.conj().T).real)

    def torque_impulse(self) -> float:
        """Integral over the segment of the currents' torque on the magnets, in N·m·s; holds at standstill too."""
        observables = self.circuit.observables
        currents = self.coefficients(observables.head(3))
        swings = observables.emf[3:6] * self.emf_phase
        mu, swing_mu = self.exponents, self.exponents[len(self.circuit.rates) + 1 :]
        plain = _integral(mu[:, None] + swing_mu[None, :], self.duration)
        mixed = _integral(mu[:, None] + swing_mu.conj()[None, :], self.duration)
        together = (currents @ plain) * swings + (currents @ mixed) * swings.conj()
        return 0.5 * float(together.real.sum())


def make_segment(
    circuit: ConductionCircuit,
    orders: Real,
    pole_pairs: int,
    speed: float,
    angle: float,
    start: float,
    currents: Real,
) -> ConductionSegment:
    """Solve `circuit` from winding `currents` in A at the electrical `angle` in rad, at mechanical `speed` in rad/s."""
    n = len(circuit.rates)
    swing = 1j * pole_pairs * speed * orders
    phase = np.exp(1j * orders * angle)
    forced = (-speed * circuit.emf * phase) / (circuit.rates[:, None] + swing)
    steady = circuit.drive / circuit.rates
    modes = np.zeros((n, n + 1 + len(orders)), dtype=np.complex128)
    modes[range(n), range(n)] = circuit.weights @ currents - steady - forced.real.sum(axis=1)
    modes[:, n] = steady
    modes[:, n + 1 :] = forced
    exponents = np.concatenate([-circuit.rates, [0.0], swing])
    return ConductionSegment(circuit, start, math.inf, speed, exponents, phase, modes)


def _integral(exponents: Complex, duration: float) -> NDArray[np.complex128]:
    """∫₀ᵀ exp(µ·t) dt for each µ, without cancellation as µ·T goes to 0."""
    scaled = exponents * duration
    small = np.abs(scaled) < 1e-8
    safe = np.where(small, 1.0, scaled)
    return np.asarray(duration * np.where(small, 1.0 + 0.5 * scaled, np.expm1(safe) / safe))
