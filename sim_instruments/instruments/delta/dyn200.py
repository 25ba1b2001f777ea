"""DYN-200 torque and speed transducer between dynamometer and motor.

Its Modbus register table holds a double word an entry, high word first. Registers 06H, 08H, 12H, 1EH, 20H as settings of torque filter,
decimals, direction (0 default, 1 inverted), speed filter and decimals: v0lker/dyn200-python, samuelknowles923/DYN200 and
savakrstovic/dyn200-logger. Where these, who each have a sensor or the maker's text before them, say different things, it is a `Dyn200Make`.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from sim_instruments.found_state import drawn
from sim_instruments.instruments.errors import DynamometerErrors
from sim_instruments.instruments.registers import (
    ILLEGAL_ADDRESS,
    ILLEGAL_FUNCTION,
    ILLEGAL_VALUE,
    NoAnswerError,
    RegisterError,
    double_word,
    exists,
)
from sim_instruments.instruments.serial_framing import SerialFraming

if TYPE_CHECKING:
    from sim_instruments.world.world import World

_TORQUE, _SPEED, _POWER, _TORQUE_FILTER, _TORQUE_DECIMALS, _ZERO_AT_START = 0x00, 0x02, 0x04, 0x06, 0x08, 0x0A
_DIRECTION, _SPEED_FILTER, _SPEED_DECIMALS = 0x12, 0x1E, 0x20
_LIMITS = {
    _TORQUE_FILTER: (0, 99),
    _TORQUE_DECIMALS: (0, 4),
    _ZERO_AT_START: (0, 1),
    _DIRECTION: (0, 1),
    _SPEED_FILTER: (0, 99),
    _SPEED_DECIMALS: (0, 3),
}
_ZERO_COIL, _FACTORY_COIL = 0, 2
#: What zeroes by a write at 00H: the value of v0lker/dyn200-python, or that of samuelknowles923/DYN200.
_ZEROING = (0, 0xFF00)
_FILTER_STEP = 0.01
_TORQUE_NOISE = 2.0e-5


@dataclass(frozen=True)
class Dyn200Make:
    """Properties that differ between sensors.

    `power_unit` (W) of the power register: 0.1 by the maker's text, 1 as read on a real sensor's display. `speed_unit` (rpm) of the
    speed register: 0.1 on that sensor, 1 by the maker's text, whatever 20H says; None follows 20H. `power_sign` says whether power
    turns its sign with the direction of rotation, or only with torque's. It is `zeroed` by coil 0 (a write at 00H is acknowledged
    and does nothing), or by a write at 00H alone. `modbus` is its parameter 09: where that is 0 it answers nobody. `rate` (bit/s) is
    its parameter 08, set at the sensor alone: 8 data bits, no parity, two stop bits.
    """

    power_unit: float = 0.1
    speed_unit: float | None = None
    power_sign: bool = True
    zeroed: Literal["coil", "write"] = "coil"
    modbus: bool = True
    rate: int = 9600

    def __post_init__(self) -> None:
        if self.power_unit <= 0.0 or (self.speed_unit is not None and self.speed_unit <= 0.0):
            raise ValueError(f"a DYN-200 of {self.power_unit} W and {self.speed_unit} rpm a digit; both are positive")


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
        make: Dyn200Make | None = None,
    ) -> None:
        self.unit = unit
        self.make = make or Dyn200Make()
        self._world = world
        self._random = generator
        self._errors = errors or DynamometerErrors()
        self._noise = _TORQUE_NOISE * rated_torque
        self._factory = {
            _TORQUE_FILTER: 2,
            _TORQUE_DECIMALS: torque_decimals,
            _ZERO_AT_START: 0,
            _DIRECTION: 0,
            _SPEED_FILTER: 2,
            _SPEED_DECIMALS: speed_decimals,
        }
        self._zero = 0.0
        self._settings = dict(self._factory)

    @property
    def framing(self) -> SerialFraming:
        """Framing on its line."""
        return SerialFraming(self.make.rate)

    def read(self, address: int, count: int) -> list[int]:
        """Return registers, torque, speed and power of one instant. Raises RegisterError 2, NoAnswerError."""
        self._listen()
        if not exists(self.ranges, address, count):
            raise RegisterError(
                ILLEGAL_ADDRESS, f"DYN-200 has no registers {address:#04x} … {address + count - 1:#04x}"
            )
        block = [0] * (self.ranges[0][0] + self.ranges[0][1])
        for number, value in self._settings.items():
            if address - 2 < number < address + count:
                block[number : number + 2] = double_word(value)
        torque, speed = self._sense()
        dropouts = self._world.disturbances.sensors.dropouts
        if dropouts and float(self._random.uniform()) < dropouts:
            torque = speed = 0.0
        torque *= self._sign
        speed_rpm = abs(speed) * 60.0 / (2.0 * math.pi)
        power = torque * (speed if self.make.power_sign else abs(speed))
        block[_TORQUE : _TORQUE + 2] = double_word(round(torque * 10.0 ** self._settings[_TORQUE_DECIMALS]))
        block[_SPEED : _SPEED + 2] = double_word(round(speed_rpm / self._speed_unit))
        block[_POWER : _POWER + 2] = double_word(round(power / self.make.power_unit))
        return block[address : address + count]

    def write(self, address: int, values: list[int]) -> None:
        """Set a setting, or zero the torque where a write at 00H does so. Raises RegisterError, NoAnswerError."""
        self._listen()
        value = values[0] << 16 | values[1] if len(values) == 2 else values[0]
        if address == _TORQUE and len(values) <= 2:
            if value not in _ZEROING:
                raise RegisterError(ILLEGAL_VALUE, "DYN-200 torque takes no value but 0 and FF00H, which zero it")
            if self.make.zeroed == "write":
                self._zero_torque()
        elif address in _LIMITS and len(values) == 2:
            low, high = _LIMITS[address]
            if not low <= value <= high:
                raise RegisterError(ILLEGAL_VALUE, f"DYN-200 {address:02X}H: {value} is outside {low} … {high}")
            self._settings[address] = value
        else:
            raise RegisterError(ILLEGAL_ADDRESS, f"DYN-200 register {address:#04x} cannot be written")

    def write_bit(self, address: int, on: bool) -> None:
        """Zero the torque by coil 0, return to the factory's settings by coil 2. Raises RegisterError, NoAnswerError."""
        self._listen()
        if self.make.zeroed != "coil":
            raise RegisterError(ILLEGAL_FUNCTION, "this DYN-200 has no coils")
        if address not in (_ZERO_COIL, _FACTORY_COIL):
            raise RegisterError(ILLEGAL_ADDRESS, f"DYN-200 has no coil {address}")
        if not on:
            return
        if address == _ZERO_COIL:
            self._zero_torque()
        else:
            self._settings, self._zero = dict(self._factory), 0.0

    def leave(self, generator: np.random.Generator) -> tuple[str, ...]:
        """Be another sensor, with other settings; it speaks Modbus all the same."""
        self.make = Dyn200Make(
            power_unit=drawn(generator, (0.1, 1.0)),
            speed_unit=drawn(generator, (None, 0.1, 1.0)),
            power_sign=drawn(generator, (True, False)),
            zeroed=drawn(generator, ("coil", "write")),
            rate=self.make.rate,
        )
        for number, choices in (
            (_TORQUE_FILTER, (1, 2, 10, 50)),
            (_TORQUE_DECIMALS, (3, 4)),
            (_ZERO_AT_START, (0, 1)),
            (_DIRECTION, (0, 1)),
            (_SPEED_FILTER, (1, 2, 10)),
            (_SPEED_DECIMALS, (0, 1, 2)),
        ):
            self._settings[number] = drawn(generator, choices)
        return str(self.make), *(f"{number:02X}H = {value}" for number, value in self._settings.items())

    def _listen(self) -> None:
        if not self.make.modbus:
            raise NoAnswerError

    @property
    def _sign(self) -> float:
        return -1.0 if self._settings[_DIRECTION] else 1.0

    @property
    def _speed_unit(self) -> float:
        fixed = self.make.speed_unit
        return 10.0 ** -self._settings[_SPEED_DECIMALS] if fixed is None else fixed

    def _zero_torque(self) -> None:
        self._zero += self._sense()[0]

    def _disturbed(self, torque: float, speed: float, torque_gate: float, gate: float) -> tuple[float, float]:
        """Return torque (N·m) and speed (rad/s) as the disturbed sensors give them, means over `torque_gate` and `gate` s or filtered."""
        sensors, machine = self._world.disturbances.sensors, self._world.dynamometer
        torque += sensors.torque_drift * self._world.clock.now()
        if sensors.torque_runout or sensors.vibration:
            shaking = 2.0 * math.pi * sensors.vibration_frequency
            torque += machine.sensed(
                lambda times, angle, _: (
                    sensors.torque_runout * np.sin(angle) + sensors.vibration * np.sin(shaking * times)
                ),
                sensors.torque_filter,
                torque_gate,
            )
        if sensors.speed_runout:
            speed += sensors.speed_runout * machine.sensed(
                lambda _, angle, turning: turning * np.sin(angle), sensors.speed_filter, gate
            )
        if sensors.pulses:
            pulse = 2.0 * math.pi / (sensors.pulses * gate)
            # Where the gate falls among the pulses is chance.
            speed = math.copysign(math.floor(abs(speed) / pulse + float(self._random.uniform())) * pulse, speed)
        return torque, speed

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
                torque, speed = self._disturbed(torque, speed, torque_time, speed_time)
        noise = float(self._random.normal(0.0, self._noise * math.sqrt(2.0 * _FILTER_STEP / torque_time)))
        return torque * (1.0 + errors.torque_gain) + errors.torque_offset + noise - self._zero, speed * (
            1.0 + errors.speed_gain
        )
