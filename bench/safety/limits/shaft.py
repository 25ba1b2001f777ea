"""Limits in front of what turns the shaft or watches it turn."""

import math
from contextlib import AbstractContextManager

from bench.safety.limits.bounds import Quantity, check_reading
from bench.safety.limits.limited import Limited
from drivers.interfaces import Dynamometer, DynamometerReading, Reading, RotorActuator, Tachometer


class LimitedDynamometer(Limited):
    """A dynamometer: speeds, torques, and the speed it may reach by itself."""

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
        reading: DynamometerReading = self._instrument.measure()
        check_reading(self._name, "speed", reading.speed, "rad/s", self._reading_bounds[Quantity.SPEED])
        check_reading(self._name, "torque", reading.torque, "N·m", self._reading_bounds[Quantity.TORQUE])
        return reading


class LimitedTachometer(Limited):
    """A tachometer: the speed it sees."""

    _instrument: Tachometer

    def measure_speed(self) -> Reading:
        """Return the speed (rad/s); raises LimitError where it is beyond a limit."""
        return self._held("speed", self._instrument.measure_speed(), Quantity.SPEED)


class LimitedRotorActuator(Limited):
    """A rotor actuator: the speed at which it turns the shaft."""

    _instrument: RotorActuator

    @property
    def maximum_speed(self) -> float:
        """Largest speed (rad/s): the least of the actuator's, the motor's and the station's."""
        return min(self._instrument.maximum_speed, self._bound(Quantity.SPEED).value)

    def turn(self, speed: float) -> None:
        """Turn the shaft evenly at a speed (rad/s) until stopped."""
        self._check("turn", "speed", speed, "rad/s", self._bound(Quantity.SPEED), signed=True)
        self._instrument.turn(speed)
