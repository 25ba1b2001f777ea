"""DYN-200 torque and speed transducer between dynamometer and motor.

Its Modbus register table holds a double word an entry, high word first.
"""

import math
from typing import TYPE_CHECKING

import numpy as np

from sim_instruments.instruments.errors import DynamometerErrors
from sim_instruments.instruments.registers import ILLEGAL_ADDRESS, ILLEGAL_VALUE, RegisterError, double_word, exists

if TYPE_CHECKING:
    from sim_instruments.world.world import World

_TORQUE, _SPEED, _POWER, _TORQUE_FILTER, _TORQUE_DECIMALS = 0x00, 0x02, 0x04, 0x06, 0x08
_DIRECTION, _SPEED_FILTER, _SPEED_DECIMALS = 0x12, 0x1E, 0x20
_FILTER_STEP = 0.01
_TORQUE_NOISE = 2.0e-5


class Dyn200:
    """Simulated side of the transducer. Torque is the dynamometer's on the shaft, positive forwards; `rated_torque` N·m."""

    ranges = ((0x00, 0x24),)
    readings = (_TORQUE, 6, 2)

    def __init__(
        self,
        world: "World",
        generator: np.random.Generator,
        errors: DynamometerErrors | None = None,
        *,
        unit: int = 2,
        rated_torque: float = 5.0,
        torque_decimals: int = 4,
        speed_decimals: int = 2,
    ) -> None:
        self.unit = unit
        self._world = world
        self._random = generator
        self._errors = errors or DynamometerErrors()
        self._noise = _TORQUE_NOISE * rated_torque
        self._zero = 0.0
        self._settings: dict[int, int] = {}
        self._registers = [0] * (self.ranges[0][0] + self.ranges[0][1])
        for number, value in (
            (_TORQUE_FILTER, 2),
            (_TORQUE_DECIMALS, torque_decimals),
            (_SPEED_FILTER, 2),
            (_SPEED_DECIMALS, speed_decimals),
        ):
            self._set(number, value)

    def read(self, address: int, count: int) -> list[int]:
        """Return registers, torque, speed and power of one instant. Raises RegisterError 2."""
        if not exists(self.ranges, address, count):
            raise RegisterError(
                ILLEGAL_ADDRESS, f"DYN-200 has no registers {address:#04x} … {address + count - 1:#04x}"
            )
        block = self._registers.copy()
        torque, speed = self._sense()
        dropouts = self._world.disturbances.sensors.dropouts
        if dropouts and float(self._random.uniform()) < dropouts:
            torque = speed = 0.0
        speed_rpm = speed * 60.0 / (2.0 * math.pi)
        block[_TORQUE : _TORQUE + 2] = double_word(round(torque * 10.0 ** self._settings[_TORQUE_DECIMALS]))
        block[_SPEED : _SPEED + 2] = double_word(round(abs(speed_rpm) * 10.0 ** self._settings[_SPEED_DECIMALS]))
        block[_POWER : _POWER + 2] = double_word(round(torque * speed * 10.0))
        block[_DIRECTION : _DIRECTION + 2] = double_word(int(speed < 0.0))
        return block[address : address + count]

    def write(self, address: int, values: list[int]) -> None:
        """Zero the torque by writing 0 to it, or set a filter. Raises RegisterError."""
        if address == _TORQUE and len(values) <= 2:
            if any(values):
                raise RegisterError(ILLEGAL_VALUE, "DYN-200 torque takes no value but 0, which zeroes it")
            self._zero += self._sense()[0]
        elif address in (_TORQUE_FILTER, _SPEED_FILTER) and len(values) == 2:
            level = values[0] << 16 | values[1]
            if not 0 <= level <= 99:
                raise RegisterError(ILLEGAL_VALUE, f"DYN-200 filter {level} is outside 0 … 99")
            self._set(address, level)
        else:
            raise RegisterError(ILLEGAL_ADDRESS, f"DYN-200 register {address:#04x} cannot be written")

    def _disturbed(self, torque: float, speed: float, gate: float) -> tuple[float, float]:
        """Return torque (N·m) and speed (rad/s) as the disturbed sensors give them; a speed is counted over `gate` s."""
        sensors, now, angle = self._world.disturbances.sensors, self._world.clock.now(), self._world.dynamometer.angle
        torque += sensors.torque_runout * math.sin(angle) + sensors.torque_drift * now
        torque += sensors.vibration * math.sin(2.0 * math.pi * sensors.vibration_frequency * now)
        speed *= 1.0 + sensors.speed_runout * math.sin(angle)
        if sensors.pulses:
            pulse = 2.0 * math.pi / (sensors.pulses * gate)
            # Where the gate falls among the pulses is chance.
            speed = math.copysign(math.floor(abs(speed) / pulse + float(self._random.uniform())) * pulse, speed)
        return torque, speed

    def _set(self, number: int, value: int) -> None:
        self._settings[number] = value
        self._registers[number : number + 2] = double_word(value)

    def _sense(self) -> tuple[float, float]:
        """Return torque (N·m) and speed (rad/s), each over its filter."""
        errors = self._errors
        torque_time = _FILTER_STEP * max(1, self._settings[_TORQUE_FILTER])
        speed_time = _FILTER_STEP * max(1, self._settings[_SPEED_FILTER])
        sensors, machine = self._world.disturbances.sensors, self._world.dynamometer
        with self._world.lock:
            slow_torque, slow_speed = sensors.torque_filter, sensors.speed_filter
            torque = machine.lagging_torque(slow_torque) if slow_torque else machine.torque(torque_time)
            speed = machine.lagging_speed(slow_speed) if slow_speed else machine.speed(speed_time)
            if not sensors.clear:
                torque, speed = self._disturbed(torque, speed, speed_time)
        noise = float(self._random.normal(0.0, self._noise * math.sqrt(2.0 * _FILTER_STEP / torque_time)))
        return torque * (1.0 + errors.torque_gain) + errors.torque_offset + noise - self._zero, speed * (
            1.0 + errors.speed_gain
        )
