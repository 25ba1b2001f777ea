"""Limits in front of what feeds the winding."""

import math
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager

from bench.safety.limits.bounds import Limit, Quantity
from bench.safety.limits.limited import Limited, as_frequency
from drivers.interfaces import (
    Aperture,
    BldcDrive,
    InsulationReading,
    InsulationTester,
    Inverter,
    LcrMeter,
    Reading,
    Regulated,
    Supply,
)


class LimitedSupply(Limited):
    """A DC supply: voltage and current limit."""

    _instrument: Supply

    @property
    def maximum_voltage(self) -> float:
        """Largest voltage (V): the least of the instrument's, the motor's and the station's."""
        return min(self._instrument.maximum_voltage, self._bound(Quantity.VOLTAGE).value)

    @property
    def maximum_current(self) -> float:
        """Largest current limit (A): the least of the instrument's, the motor's and the station's."""
        return min(self._instrument.maximum_current, self._bound(Quantity.CURRENT).value)

    def configure(self, voltage: float, current_limit: float, regulated: Regulated = Regulated.VOLTAGE) -> None:
        """Set voltage (V) and current limit (A)."""
        self._check_levels("configure", voltage, current_limit)
        self._instrument.configure(voltage, current_limit, regulated)

    def energised(
        self, voltage: float, current_limit: float, regulated: Regulated = Regulated.VOLTAGE
    ) -> AbstractContextManager[None]:
        """Configure and switch on for the length of the block."""
        self._check_levels("energised", voltage, current_limit)
        return self._instrument.energised(voltage, current_limit, regulated)

    def measure_voltage(self) -> Reading:
        """Return the output voltage (V); raises LimitError where it is beyond a limit."""
        return self._held("voltage", self._instrument.measure_voltage(), Quantity.VOLTAGE)

    def measure_current(self) -> Reading:
        """Return the output current (A); raises LimitError where it is beyond a limit."""
        return self._held("current", self._instrument.measure_current(), Quantity.CURRENT)

    def _check_levels(self, call: str, voltage: float, current_limit: float) -> None:
        self._check(call, "voltage", voltage, "V", self._bound(Quantity.VOLTAGE))
        self._check(call, "current limit", current_limit, "A", self._bound(Quantity.CURRENT))


class LimitedLcrMeter(Limited):
    """An LCR meter: test level and frequency."""

    _instrument: LcrMeter

    def configure(self, frequency: float, level: float = 1.0, aperture: Aperture = Aperture.MEDIUM) -> None:
        """Set test frequency (Hz), level (V rms) and measurement time."""
        self._check("configure", "frequency", frequency, "Hz", self._bound(Quantity.FREQUENCY))
        self._check("configure", "level", level, "V rms", self._level_bound())
        self._instrument.configure(frequency, level, aperture)

    def _level_bound(self) -> Limit:
        """Return the least of the station's level and what the motor's peak voltage and peak current leave of it."""
        voltage, current = self._bound(Quantity.VOLTAGE), self._bound(Quantity.CURRENT)
        candidates = [
            self._bound(Quantity.LEVEL),
            Limit(voltage.value / math.sqrt(2.0), voltage.owner),
            Limit(current.value / math.sqrt(2.0) * self._instrument.source_impedance, current.owner),
        ]
        return min(candidates, key=lambda limit: limit.value)


class LimitedInverter(Limited):
    """An inverter: phase current and the field's frequency."""

    _instrument: Inverter

    @property
    def maximum_current(self) -> float:
        """Largest phase current (A, peak): the least of the drive's, the motor's and the station's."""
        return min(self._instrument.maximum_current, self._bound(Quantity.CURRENT).value)

    @property
    def maximum_frequency(self) -> float:
        """Largest electrical frequency (Hz): the least of the drive's, the motor's and the station's."""
        return min(self._instrument.maximum_frequency, self._frequency_bound().value)

    def driving_frequency(self, frequency: float, current: float) -> AbstractContextManager[None]:
        """Turn the field at a frequency (Hz) with a phase current (A, peak)."""
        call = "driving_frequency"
        self._check(call, "frequency", frequency, "Hz", self._frequency_bound(), signed=True)
        self._check(call, "current", current, "A", self._bound(Quantity.CURRENT))
        return self._instrument.driving_frequency(frequency, current)

    def driving_current(self, current: float) -> AbstractContextManager[None]:
        """Regulate the q-axis current (A, peak)."""
        self._check("driving_current", "current", current, "A", self._bound(Quantity.CURRENT), signed=True)
        return self._instrument.driving_current(current)

    def set_current(self, current: float) -> None:
        """Change the q-axis current (A, peak)."""
        self._check("set_current", "current", current, "A", self._bound(Quantity.CURRENT), signed=True)
        self._instrument.set_current(current)

    def measure_frequency(self) -> Reading:
        """Return the electrical frequency (Hz); raises LimitError where it is beyond a limit."""
        return self._held_frequency(self._instrument.measure_frequency())

    def measure_current(self) -> Reading:
        """Return the q-axis current (A, peak); raises LimitError where it is beyond a limit."""
        return self._held("current", self._instrument.measure_current(), Quantity.CURRENT)

    def _frequency_bound(self) -> Limit:
        by_motor = as_frequency(self._bound(Quantity.SPEED), self._pole_pairs())
        return min(self._bound(Quantity.FREQUENCY), by_motor, key=lambda limit: limit.value)


class LimitedDrive(Limited):
    """A drive at full voltage has no set point: its source's voltage is judged before it runs, its readings while it does."""

    _instrument: BldcDrive

    @contextmanager
    def running(self) -> Iterator[None]:
        """Commutate for the length of the block; raises SetpointError before that where the DC link's voltage is beyond a limit."""
        limit = self._reading_bounds[Quantity.VOLTAGE]
        if not math.isinf(limit.value):
            voltage = self._instrument.measure_bus_voltage()
            self._check("running", "DC link voltage", voltage.value, voltage.unit, limit)
        with self._instrument.running():
            yield

    def measure_bus_voltage(self) -> Reading:
        """Return the DC link's voltage (V); raises LimitError where it is beyond a limit."""
        return self._held("DC link voltage", self._instrument.measure_bus_voltage(), Quantity.VOLTAGE)

    def measure_bus_current(self) -> Reading:
        """Return the current (A) out of the DC source; raises LimitError where it is beyond a limit."""
        return self._held("DC link current", self._instrument.measure_bus_current(), Quantity.CURRENT)

    def measure_frequency(self) -> Reading:
        """Return the electrical frequency (Hz); raises LimitError where it, or the speed it means, is beyond a limit."""
        return self._held_frequency(self._instrument.measure_frequency())


class LimitedInsulationTester(Limited):
    """An insulation tester: the voltage between winding and frame."""

    _instrument: InsulationTester

    @property
    def maximum_voltage(self) -> float:
        """Largest test voltage (V): the least of the instrument's, the motor's and the station's."""
        return min(self._instrument.maximum_voltage, self._bound(Quantity.VOLTAGE).value)

    def measure(self, voltage: float, duration: float) -> InsulationReading:
        """Apply a voltage (V DC) for a time (s)."""
        self._check("measure", "voltage", voltage, "V", self._bound(Quantity.VOLTAGE))
        return self._instrument.measure(voltage, duration)
