"""The motor in its rotor's coordinates: what voltage a current takes, and what current a voltage allows.

Currents, voltages and flux linkages are complex, d + j·q, peak, of a phase of the Y-equivalent.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from sim_instruments.physics.circuits.bridge_error import BridgeError
from sim_instruments.physics.circuits.windings import ComplexArray, FloatArray

#: Halvings of an interval of currents: a part in 10¹⁵ of it.
_HALVINGS = 50
_GOLDEN = 0.5 * (5.0**0.5 - 1.0)
_NEWTON_STEPS, _SMALL = 12, 1e-4
#: The slope of flux linkages over time is taken across twice this (s).
_SHORT = 1e-7

#: Flux linkages (V·s) at currents (A) and electrical speeds (rad/s).
FluxLaw = Callable[[ComplexArray, FloatArray], ComplexArray]


@dataclass(frozen=True)
class RotorFrame:
    """u = R·i + jω·ψ(i, ω), and what the bridge loses on top.

    `resistance` (Ω) is the phase's with its lead, `flux` the flux linkages' law, `bridge` what a bridge is to be commanded beyond that.
    """

    resistance: float
    flux: FluxLaw
    bridge: BridgeError = field(default_factory=BridgeError)

    def voltage(self, current: ComplexArray, speed: FloatArray) -> ComplexArray:
        """Return the voltage (V, mean over an electrical turn) that the bridge is to be commanded at electrical speeds (rad/s)."""
        needed = self.resistance * current + 1j * speed * self.flux(current, speed)
        if self.bridge.none:
            return needed
        size = np.abs(current)
        direction = current / np.where(size > 0.0, size, 1.0)
        return needed + self.bridge.fundamental(size) * direction

    def induced(self, current: ComplexArray, slope: ComplexArray, speed: FloatArray) -> ComplexArray:
        """Return the voltage (V) that currents (A) take to change by a slope (A/s): ∂ψ/∂t along it."""
        ahead = slope * _SHORT
        return (self.flux(current + ahead, speed) - self.flux(current - ahead, speed)) / (2.0 * _SHORT)

    def within(self, wanted: complex, speed: FloatArray, limit: float, most: float) -> tuple[ComplexArray, FloatArray]:
        """Return the currents (A) that flow where `wanted` is regulated within a voltage (V), and where (1.0) that limits them.

        The d current is held as long as any q current allows it (of a size up to `most`, A), and the q current gives way. Beyond
        that both are what the largest voltage drives, in the direction of the one that would be needed.
        """
        currents = np.full(len(speed), wanted, dtype=np.complex128)
        over = np.abs(self.voltage(currents, speed)) > limit * (1.0 + 1e-12)
        if np.any(over):
            currents[over] = self._limited(wanted, speed[over], limit, most)
        return currents, over.astype(np.float64)

    def _limited(self, wanted: complex, speed: FloatArray, limit: float, most: float) -> ComplexArray:
        def size(q_current: FloatArray) -> FloatArray:
            currents: ComplexArray = np.asarray(wanted.real + 1j * q_current, dtype=np.complex128)
            return np.abs(self.voltage(currents, speed))

        # |u| over the q current is a bowl.
        low, high = np.full(len(speed), -most), np.full(len(speed), most)
        for _ in range(_HALVINGS):
            span = _GOLDEN * (high - low)
            left, right = high - span, low + span
            falling = size(left) > size(right)
            low, high = np.where(falling, left, low), np.where(falling, high, right)
        best = 0.5 * (low + high)
        near, far = best, np.full(len(speed), wanted.imag)
        for _ in range(_HALVINGS):
            middle = 0.5 * (near + far)
            fits = size(middle) <= limit
            near, far = np.where(fits, middle, near), np.where(fits, far, middle)
        currents = wanted.real + 1j * near
        beyond = size(best) > limit
        if np.any(beyond):
            start = (wanted.real + 1j * best)[beyond]
            needed = self.voltage(start, speed[beyond])
            currents[beyond] = self._driven(limit * needed / np.abs(needed), start, speed[beyond])
        result: ComplexArray = currents
        return result

    def _driven(self, voltage: ComplexArray, start: ComplexArray, speed: FloatArray) -> ComplexArray:
        """Return the currents (A) that given voltages (V) drive, by Newton's method from `start`."""
        current = start
        for _ in range(_NEWTON_STEPS):
            left = voltage - self.voltage(current, speed)
            step = _SMALL * np.maximum(np.abs(current), 1.0)
            along = (self.voltage(current + step, speed) - self.voltage(current - step, speed)) / (2.0 * step)
            across = (self.voltage(current + 1j * step, speed) - self.voltage(current - 1j * step, speed)) / (
                2.0 * step
            )
            determinant = along.real * across.imag - along.imag * across.real
            d_change = (left.real * across.imag - left.imag * across.real) / determinant
            q_change = (along.real * left.imag - along.imag * left.real) / determinant
            current = current + d_change + 1j * q_change
        return current
