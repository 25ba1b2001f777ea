"""What stands in front of every instrument that can energise or move: no set point passes that is beyond a limit."""

import math
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any

from bench.safety.limits import (
    Limit,
    Limits,
    Observer,
    Quantity,
    check_reading,
    check_set_point,
    nobody,
)
from drivers.interfaces import (
    Aperture,
    BldcDrive,
    Dynamometer,
    DynamometerReading,
    Instrument,
    Inverter,
    LcrMeter,
    Reading,
    Regulated,
    Supply,
    Tachometer,
)
from procedures.bench import Role

#: Gives the number of pole pairs, None where nobody knows it yet.
PolePairs = Callable[[], int | None]


def _unknown() -> None:
    return None


def guarded(
    role: Role,
    instrument: Instrument,
    name: str,
    limits: Limits,
    *,
    pole_pairs: PolePairs = _unknown,
    observe: Observer = nobody,
) -> Instrument:
    """Return the instrument with limits in front; one that puts nothing out is returned as it is.

    `name` stands for it in messages, `observe` hears every set point before it is judged. A guard adds no method and takes none
    away: what it does not check it passes on.
    """
    guards: dict[Role, type[_Guard]] = {
        Role.SUPPLY: _GuardedSupply,
        Role.LCR_METER: _GuardedLcrMeter,
        Role.INVERTER: _GuardedInverter,
        Role.DYNAMOMETER: _GuardedDynamometer,
        Role.DRIVE: _GuardedDrive,
        Role.TACHOMETER: _GuardedTachometer,
    }
    guard = guards.get(role)
    return guard(instrument, name, limits, pole_pairs, observe) if guard else instrument


class _Guard:
    def __init__(self, instrument: Any, name: str, limits: Limits, pole_pairs: PolePairs, observe: Observer) -> None:
        self._instrument = instrument
        self._name = name
        self._bounds = {quantity: limits.bound(quantity) for quantity in Quantity}
        self._reading_bounds = {quantity: limits.reading_bound(quantity) for quantity in Quantity}
        self._pole_pairs = pole_pairs
        self._observe = observe

    def __getattr__(self, attribute: str) -> Any:
        return getattr(self._instrument, attribute)

    def _bound(self, quantity: Quantity) -> Limit:
        return self._bounds[quantity]

    def _check(self, call: str, parameter: str, value: float, unit: str, limit: Limit, *, signed: bool = False) -> None:
        check_set_point(self._name, call, parameter, value, unit, limit, signed=signed, observe=self._observe)

    def _held(self, parameter: str, reading: Reading, quantity: Quantity) -> Reading:
        check_reading(self._name, parameter, reading.value, reading.unit, self._reading_bounds[quantity])
        return reading

    def _held_frequency(self, reading: Reading) -> Reading:
        """Hold an electrical frequency against its own limit and, where the pole pairs are known, against the speed's."""
        pairs = self._pole_pairs()
        if pairs is not None:
            limit = _as_frequency(self._reading_bounds[Quantity.SPEED], pairs)
            check_reading(self._name, "frequency", reading.value, reading.unit, limit)
        return self._held("frequency", reading, Quantity.FREQUENCY)


class _GuardedSupply(_Guard):
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


class _GuardedLcrMeter(_Guard):
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


class _GuardedInverter(_Guard):
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
        by_motor = _as_frequency(self._bound(Quantity.SPEED), self._pole_pairs())
        return min(self._bound(Quantity.FREQUENCY), by_motor, key=lambda limit: limit.value)


class _GuardedDynamometer(_Guard):
    _instrument: Dynamometer

    @property
    def maximum_speed(self) -> float:
        """Largest speed (rad/s): the least of the machine's, the motor's and the station's."""
        return min(self._instrument.maximum_speed, self._bound(Quantity.SPEED).value)

    @property
    def maximum_torque(self) -> float:
        """Largest torque (N·m): the lesser of the machine's and the station's."""
        return min(self._instrument.maximum_torque, self._bound(Quantity.TORQUE).value)

    def driving_speed(self, speed: float) -> AbstractContextManager[None]:
        """Hold a speed (rad/s) for the length of the block."""
        self._check("driving_speed", "speed", speed, "rad/s", self._bound(Quantity.SPEED), signed=True)
        return self._instrument.driving_speed(speed)

    def set_speed(self, speed: float) -> None:
        """Change the commanded speed (rad/s)."""
        self._check("set_speed", "speed", speed, "rad/s", self._bound(Quantity.SPEED), signed=True)
        self._instrument.set_speed(speed)

    def driving_torque(self, torque: float, speed_limit: float | None = None) -> AbstractContextManager[None]:
        """Put a torque (N·m) on the shaft; the drive keeps below the motor's and the station's highest speed (rad/s)."""
        self._check("driving_torque", "torque", torque, "N·m", self._bound(Quantity.TORQUE), signed=True)
        highest = self._reading_bounds[Quantity.SPEED]
        if speed_limit is not None:
            self._check("driving_torque", "speed limit", speed_limit, "rad/s", highest)
        elif not math.isinf(highest.value):
            speed_limit = min(highest.value, self._instrument.maximum_speed)
        return self._instrument.driving_torque(torque, speed_limit)

    def measure(self) -> DynamometerReading:
        """Return one reading; raises LimitError where its speed or its torque is beyond a limit."""
        reading = self._instrument.measure()
        for parameter, value, unit, quantity in (
            ("speed", reading.speed, "rad/s", Quantity.SPEED),
            ("torque", reading.torque, "N·m", Quantity.TORQUE),
        ):
            check_reading(self._name, parameter, value, unit, self._reading_bounds[quantity])
        return reading


class _GuardedDrive(_Guard):
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


class _GuardedTachometer(_Guard):
    _instrument: Tachometer

    def measure_speed(self) -> Reading:
        """Return the speed (rad/s); raises LimitError where it is beyond a limit."""
        return self._held("speed", self._instrument.measure_speed(), Quantity.SPEED)


def _as_frequency(speed: Limit, pole_pairs: int | None) -> Limit:
    """Return a limit of mechanical speed (rad/s) as one of electrical frequency (Hz).

    With a single pole pair a frequency means the highest speed that it can, so that is taken where the number is not known.
    """
    words = "pole pairs unknown: 1 taken" if pole_pairs is None else f"{pole_pairs} pole pairs"
    return Limit(speed.value / (2.0 * math.pi) * (pole_pairs or 1), f"{speed.owner}, {words}")
