"""One measurement of the bridge: what it senses, what its leads and its own errors make of it."""

import cmath
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sim_instruments.instruments.errors import LcrErrors
from sim_instruments.instruments.keysight.e4980a.accuracy import (
    Aperture,
    basic_accuracy,
    integration_time,
    measurement_time,
    noise,
    open_offset,
    short_offset,
)

if TYPE_CHECKING:
    from sim_instruments.world.world import World

#: Resistance (Ω) behind which the test level is set.
SOURCE_RESISTANCE = 100.0
_OVERLOAD = 1.0e9
_SHORTED = 20.0
_HIGHEST_SOURCE = 2.0
_DC_LEVEL = 1.0
_OVERLOADED, _UNREGULATED = 1, 4
# The short is learnt where lead inductance and lead resistance both show.
_SHORT_FREQUENCIES = (1.0e3, 100.0e3)


@dataclass(frozen=True)
class Conditions:
    """The conditions of a measurement: Hz, V rms at the open terminals, s."""

    frequency: float
    level_rms: float
    aperture: Aperture
    averages: int
    delay: float
    short_corrected: bool
    regulated: bool
    with_dc: bool

    @property
    def duration(self) -> float:
        """Time (s) from the trigger to the result."""
        single = measurement_time(self.aperture, self.frequency)
        return self.delay + single * self.averages * (2.0 if self.with_dc else 1.0)


@dataclass(frozen=True)
class BridgeResult:
    """A result: impedance (Ω, None on overload), status, DC resistance (Ω), levels at the terminals (V, A rms)."""

    time: float
    impedance: complex | None
    status: int
    dc_resistance: float = 0.0
    voltage: float = 0.0
    current: float = 0.0


class BridgeMeasurement:
    """Reads the world's impedance as this unit of the bridge does, corrections included."""

    def __init__(self, world: "World", generator: np.random.Generator, errors: LcrErrors) -> None:
        self._world = world
        self._random = generator
        self._errors = errors
        self._short: tuple[float, float] | None = None

    def learn_short(self) -> bool:
        """Measure what is clipped together as the residual of the leads; false where it is no short."""
        low, high = (self._world.impedance(frequency, 1.0, 0.1) for frequency in _SHORT_FREQUENCIES)
        if not max(abs(low), abs(high)) < _SHORTED:
            return False
        self._short = (low.real, high.imag / (2.0 * math.pi * _SHORT_FREQUENCIES[1]))
        return True

    def learnt(self, resistance: float, inductance: float) -> None:
        """Store the short correction of other leads (Ω, H)."""
        self._short = (resistance, inductance)

    def learn_open(self) -> bool:
        """Measure the open leads; false where something is connected. The virtual leads have no stray capacitance."""
        seen = abs(self._world.impedance(1.0e3, 1.0, 0.1))
        return not (math.isnan(seen) or seen < _OVERLOAD)

    def read(self, conditions: Conditions, time: float) -> BridgeResult:
        """Return the reading of a measurement that ends now and is dated `time`."""
        level = conditions.level_rms
        if level <= 0.0:
            return BridgeResult(time, None, _OVERLOADED)
        aperture = integration_time(conditions.aperture, conditions.frequency) * conditions.averages
        true = self._world.impedance(conditions.frequency, level, aperture)
        if not (cmath.isfinite(true) and abs(true) < _OVERLOAD):
            return BridgeResult(time, None, _OVERLOADED)
        current = level / abs(SOURCE_RESISTANCE + true)
        status = 0
        if conditions.regulated and level * abs(SOURCE_RESISTANCE + true) > _HIGHEST_SOURCE * abs(true):
            status = _UNREGULATED
        impedance = self._as_seen(true, conditions)
        resistance = self._dc_resistance(conditions, aperture) if conditions.with_dc else 0.0
        return BridgeResult(time, impedance, status, resistance, current * abs(true), current)

    def _as_seen(self, true: complex, conditions: Conditions) -> complex:
        errors = self._errors
        frequency, level, aperture = conditions.frequency, conditions.level_rms, conditions.aperture
        omega = 2.0 * math.pi * frequency
        seen = true * (1.0 + errors.gain) * cmath.exp(1j * errors.phase)
        if conditions.short_corrected and self._short is not None:
            seen -= complex(self._short[0], omega * self._short[1])
            seen += complex(errors.residual_resistance, omega * errors.residual_inductance)
        magnitude = abs(seen)
        proportional, shorted, opened = errors.share
        seen += seen * proportional * basic_accuracy(aperture, frequency, level)
        seen += shorted * short_offset(aperture, frequency, level, magnitude)
        seen += opened * open_offset(aperture, frequency, level) * magnitude**2
        deviation = noise(aperture, conditions.averages, frequency, level, magnitude)
        real, imaginary = self._random.normal(0.0, deviation, 2)
        return seen + complex(real, imaginary)

    def _dc_resistance(self, conditions: Conditions, aperture: float) -> float:
        # A winding's series resistance does not depend on frequency, so the lowest one stands for DC.
        true = self._world.impedance(20.0, _DC_LEVEL, aperture).real
        if self._short is not None and conditions.short_corrected:
            true -= self._short[0]
        deviation = 1.0e-4 * abs(true) + (1.0e-3 if conditions.aperture == "SHOR" else 2.0e-4)
        return true * (1.0 + self._errors.gain) + float(self._random.normal(0.0, deviation))
