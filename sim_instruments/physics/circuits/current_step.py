"""Currents that a regulator brings from one value to another: as fast as the voltage allows, and exponentially at the end.

The exponential is that of a loop whose zero lies on the winding's pole.
"""

import math
from dataclasses import dataclass

import numpy as np

from sim_instruments.physics.circuits.rotor_frame import RotorFrame
from sim_instruments.physics.circuits.windings import ComplexArray, FloatArray

#: The step is over once this share of its exponential is left.
_LEFT = 1.0e-7
#: Share of the largest voltage that is made use of, and what is left for a change of current where speed and resistance take the rest.
_IN_RESERVE, _LEAST = 0.95, 0.05
#: Places along the step at which the inductance is looked at.
_PLACES = 17


@dataclass(frozen=True)
class CurrentStep:
    """Currents (A, d + j·q) from `begin` at the time `start` (s) to `wanted`, at a `rate` (1/s) but no faster than `slope` (A/s)."""

    start: float
    begin: complex
    wanted: complex
    rate: float
    slope: float

    @classmethod
    def within(
        cls,
        frame: RotorFrame,
        start: float,
        begin: complex,
        wanted: complex,
        *,
        bandwidth: float,
        speed: float,
        limit: float,
    ) -> "CurrentStep":
        """Return the step of a loop of a bandwidth (Hz) within a phase voltage (V) at an electrical speed (rad/s)."""
        change = wanted - begin
        along: ComplexArray = np.asarray(begin + change * np.linspace(0.0, 1.0, _PLACES), dtype=np.complex128)
        speeds = np.full(_PLACES, speed)
        taken = float(np.max(np.abs(frame.voltage(along, speeds))))
        way = np.full(_PLACES, change / abs(change), dtype=np.complex128)
        inductance = float(np.max(np.abs(frame.induced(along, way, speeds))))
        room = max(_IN_RESERVE * limit - taken, _LEAST * limit)
        return cls(start, begin, wanted, 2.0 * math.pi * bandwidth, room / inductance)

    @property
    def end(self) -> float:
        """The time (s) at which the step has become negligible."""
        return self.start + self._slewing - math.log(_LEFT) / self.rate

    def currents(self, times: FloatArray) -> ComplexArray:
        """Return the currents (A) at times (s)."""
        return np.asarray(self.wanted - self._left(times) * self._way)

    def slopes(self, times: FloatArray) -> ComplexArray:
        """Return how they change (A/s)."""
        return np.asarray(np.minimum(self.rate * self._left(times), self.slope) * self._way)

    @property
    def _way(self) -> complex:
        return (self.wanted - self.begin) / abs(self.wanted - self.begin)

    @property
    def _slewing(self) -> float:
        """Time (s) for which the voltage limits the current's rise."""
        return max(abs(self.wanted - self.begin) / self.slope - 1.0 / self.rate, 0.0)

    def _left(self, times: FloatArray) -> FloatArray:
        """Return what (A) is left to go."""
        passed, whole = times - self.start, abs(self.wanted - self.begin)
        slewing = self._slewing
        last = whole - self.slope * slewing
        return np.asarray(
            np.where(
                passed < slewing,
                whole - self.slope * passed,
                last * np.exp(-self.rate * np.maximum(passed - slewing, 0.0)),
            )
        )
