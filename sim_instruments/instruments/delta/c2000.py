"""Delta C2000 drive as the dynamometer's controller (C2000 user manual, parameter group 09, communication addresses).

Sources (C2000 and CP2000 user manuals; 00-21 = 2 by its sisters): the frequency of 2001H acts with 00-20 = 1 alone, the word of 2000H
with 00-21 = 2, both with 09-30 = 0, the torque of 11-34 (a share of 11-27) with 11-33 = 1; what has another source is acknowledged and
does nothing. In torque mode the speed is limited by 11-37 and 11-38 (% of 01-00), with 11-36 = 1 by the frequency command in the
direction of the torque. A limit that has been reached is kept until the next command. A request is heard as one after more than 10 ms
of silence on the line.

Framing: 09-00 is the unit, 09-01 the rate in 0.1 kbit/s, 09-04 one of 17 formats (C2000 and CP2000 manuals, 12.1-09; the GS4, which
Delta makes for another brand, has the same formats). The reply to a write of one of them still has the framing before. Whether the new
one acts from then on or once the power has been off, no source tells; the parameters of the GS4 may be set while it runs.

Lost communication (09-02, 09-03, cE10) is as the manuals of its sisters VFD-B and VFD-S tell it: each valid message starts the time
anew, and a drive that has heard none for so long warns and goes on, ramps or coasts to a stop, or does nothing.
"""

import math
from functools import partial
from typing import TYPE_CHECKING, Literal

import numpy as np

from sim_instruments.found_state import drawn
from sim_instruments.instruments.registers import (
    ILLEGAL_ADDRESS,
    ILLEGAL_VALUE,
    RegisterError,
    exists,
    signed,
)
from sim_instruments.instruments.serial_framing import SerialFraming
from sim_instruments.instruments.silence import SilenceWatch

if TYPE_CHECKING:
    from sim_instruments.world.world import World

_IDENTITY, _CONTROL_MODE, _STOP_METHOD = 0x0000, 0x000A, 0x0016
_FREQUENCY_SOURCE, _COMMAND_SOURCE = 0x0014, 0x0015
_ADDRESS, _SPEED, _PROTOCOL, _DECODING = 0x0900, 0x0901, 0x0904, 0x091E
_MAXIMUM_TORQUE = 0x0B1B
_TORQUE_SOURCE, _SPEED_LIMIT_BY, _FORWARD_LIMIT, _REVERSE_LIMIT = 0x0B21, 0x0B24, 0x0B25, 0x0B26
#: 230 V, 1.5 kW.
_CODE = 6
_BY_MODBUS, _RUN_BY_MODBUS, _TORQUE_BY_MODBUS = 1, 2, 1
#: Data bits, parity and stop bits by 09-04, from 1 on; ASCII up to 11, then RTU.
_EIGHT_BITS = ("8N1", "8N2", "8E1", "8O1", "8E2", "8O2")
_FORMATS = ("7N2", "7E1", "7O1", "7E2", "7O2", *_EIGHT_BITS, *_EIGHT_BITS)
_FIRST_RTU = 12
#: What a drive comes with.
_DELIVERED = {_ADDRESS: 1, _SPEED: 96, _PROTOCOL: 1}
#: How often a speed is held against its limit in torque mode (s).
_LOOK = 0.01
_MAXIMUM_FREQUENCY, _ACCELERATION, _DECELERATION = 0x0100, 0x010C, 0x010D
_LOST_TREATMENT, _LOST_TIME = 0x0902, 0x0903
_WARN, _RAMP, _COAST, _NOTHING = 0, 1, 2, 3
#: Warning CE10, in the high byte of the first status register.
_TIME_OUT_WARNING = 5
_TORQUE_COMMAND = 0x0B22
_COMMAND, _FREQUENCY, _RESET = 0x2000, 0x2001, 0x2002
_STATUS = 0x2100
_EXTERNAL_FAULT = 49
_STOPPED_SPEED = 0.05
_STOP, _RUN = 0b01, 0b10
_FORWARD, _REVERSE, _TURN_ROUND = 0b01, 0b10, 0b11

_DEFAULTS = {
    _CONTROL_MODE: 0,
    _STOP_METHOD: 0,
    _MAXIMUM_FREQUENCY: 20_000,
    _ACCELERATION: 1000,
    _DECELERATION: 1000,
    _LOST_TREATMENT: _NOTHING,
    _LOST_TIME: 0,
    _TORQUE_COMMAND: 0,
    _FREQUENCY: 0,
    _FREQUENCY_SOURCE: _BY_MODBUS,
    _COMMAND_SOURCE: _RUN_BY_MODBUS,
    _TORQUE_SOURCE: _TORQUE_BY_MODBUS,
    _SPEED_LIMIT_BY: 0,
    _FORWARD_LIMIT: 100,
    _REVERSE_LIMIT: 100,
    _ADDRESS: 1,
    _SPEED: 96,
    _PROTOCOL: 13,
    _DECODING: 0,
    _MAXIMUM_TORQUE: 100,
}
_LIMITS = {
    _CONTROL_MODE: (0, 2),
    _STOP_METHOD: (0, 1),
    _MAXIMUM_FREQUENCY: (0, 59_900),
    _ACCELERATION: (0, 60_000),
    _DECELERATION: (0, 60_000),
    _LOST_TREATMENT: (_WARN, _NOTHING),
    _LOST_TIME: (0, 1000),
    _FREQUENCY: (0, 59_900),
    _FREQUENCY_SOURCE: (0, 8),
    _COMMAND_SOURCE: (0, 5),
    _TORQUE_SOURCE: (0, 5),
    _SPEED_LIMIT_BY: (0, 1),
    _FORWARD_LIMIT: (0, 120),
    _REVERSE_LIMIT: (0, 120),
    _ADDRESS: (1, 254),
    _SPEED: (48, 1152),
    _PROTOCOL: (1, len(_FORMATS)),
    _DECODING: (0, 1),
    _MAXIMUM_TORQUE: (0, 500),
}


class DeltaDrive:
    """Simulated side of the drive. `pole_pairs` and `rated_torque` (N·m) are those of the machine it drives.

    `framing_acts` says from when on the line is framed as its parameters say: after the reply, or after the next `power_cycle`.
    """

    ranges = (
        (0x0000, 1),
        (0x000A, 1),
        (0x0014, 3),
        (0x0100, 1),
        (0x010C, 2),
        (0x0900, 5),
        (0x091E, 1),
        (0x0B1B, 1),
        (0x0B21, 6),
        (0x2000, 3),
        (0x2100, 12),
    )
    readings = (0x2102, 10, 1)
    #: What a serial line must have been silent for (s) before a request.
    silence = 0.010

    def __init__(
        self,
        world: "World",
        *,
        pole_pairs: int = 2,
        rated_torque: float = 5.0,
        framing_acts: Literal["at once", "after power"] = "at once",
    ) -> None:
        if pole_pairs < 1 or not rated_torque > 0.0:
            raise ValueError(f"a machine of {pole_pairs} pole pairs and {rated_torque} N·m is none; both are positive")
        self._world = world
        self._pole_pairs = pole_pairs
        self._rated_torque = rated_torque
        self._registers = dict(_DEFAULTS)
        self._framing_acts = framing_acts
        self._framed = dict(self._registers)
        #: The frequency (0.01 Hz) of the keypad, which counts where 00-20 is 0.
        self.keypad_frequency = 0
        self._limited = False
        self._looks = 0
        self._running = self._stopping = self._reverse = False
        self._error = self._warning = 0
        self._watch = SilenceWatch(self._lost)

    @property
    def unit(self) -> int:
        """The number that it answers to."""
        return self._framed[_ADDRESS]

    @property
    def framing(self) -> SerialFraming:
        """Framing on its line."""
        protocol = self._framed[_PROTOCOL]
        form = _FORMATS[protocol - 1]
        rate = 100 * self._framed[_SPEED]
        return SerialFraming(rate, int(form[0]), form[1], int(form[2]), protocol < _FIRST_RTU)

    def deliver(self) -> None:
        """Set the framing that a drive comes with: unit 1, 9600 bit/s, 7 data bits, no parity, 2 stop bits, ASCII."""
        self._registers |= _DELIVERED
        self.power_cycle()

    def power_cycle(self) -> None:
        """Be without power for a while: what acts then only acts now."""
        self._framed = dict(self._registers)

    def close(self) -> None:
        """Stop the supervision; may be called again."""
        self._watch.close()

    def read(self, address: int, count: int) -> list[int]:
        """Return registers. Raises RegisterError 2 for one that does not exist."""
        self._watch.heard()
        if not exists(self.ranges, address, count):
            raise RegisterError(ILLEGAL_ADDRESS, f"C2000 has no registers {address:04X}H … {address + count - 1:04X}H")
        with self._world.lock:
            self._finish_stopping()
            monitor = self._monitor() if address + count > _STATUS else []
            return [self._value(number, monitor) for number in range(address, address + count)]

    def write(self, address: int, values: list[int]) -> None:
        """Write registers. Raises RegisterError 2 for one that cannot be written, 3 for a value out of range."""
        self._watch.heard()
        if address == _IDENTITY or not exists(self.ranges[:-1], address, len(values)):
            raise RegisterError(ILLEGAL_ADDRESS, f"C2000 register {address:04X}H cannot be written")
        for number, value in enumerate(values, address):
            low, high = _LIMITS.get(number, (0, 0xFFFF))
            if not low <= value <= high:
                raise RegisterError(ILLEGAL_VALUE, f"C2000 {number:04X}H: {value} is outside {low} … {high}")
        with self._world.lock:
            self._finish_stopping()
            for number, value in enumerate(values, address):
                self._write(number, value)

    def leave(self, generator: np.random.Generator) -> tuple[str, ...]:
        """Be left for the keypad, or half so."""
        left = {
            _CONTROL_MODE: drawn(generator, (0, 2)),
            _STOP_METHOD: drawn(generator, (0, 1)),
            _FREQUENCY_SOURCE: drawn(generator, (0, 1)),
            _COMMAND_SOURCE: drawn(generator, (0, 2)),
            _TORQUE_SOURCE: drawn(generator, (0, 1)),
            _DECODING: drawn(generator, (0, 1)),
            _MAXIMUM_TORQUE: drawn(generator, (50, 100, 200)),
            _SPEED_LIMIT_BY: drawn(generator, (0, 1)),
            _FORWARD_LIMIT: drawn(generator, (10, 100)),
            _REVERSE_LIMIT: drawn(generator, (10, 100)),
            _FREQUENCY: drawn(generator, (0, 1234)),
            _TORQUE_COMMAND: drawn(generator, (0, 100)),
        }
        self._registers.update(left)
        self.keypad_frequency = drawn(generator, (0, 500))
        told = tuple(f"{number:04X}H = {value}" for number, value in left.items())
        return *told, f"keypad {self.keypad_frequency * 0.01:g} Hz"

    def _write(self, number: int, value: int) -> None:
        if self._registers[_DECODING] and number in (_COMMAND, _FREQUENCY, _RESET):
            return
        if number == _COMMAND:
            if self._registers[_COMMAND_SOURCE] == _RUN_BY_MODBUS:
                self._act(value)
        elif number == _RESET:
            if value & 0b10:
                self._error = self._warning = 0
            if value & 0b01:
                self._error = _EXTERNAL_FAULT
                self._off()
        else:
            self._registers[number] = value
            if number in _DELIVERED and self._framing_acts == "at once":
                self._framed[number] = value
            if number == _LOST_TIME:
                self._watch.watch(value * 0.1)
                self._watch.heard()
            if self._running and not self._stopping:
                self._drive()

    def _act(self, word: int) -> None:
        direction = (word >> 4) & 0b11
        if direction == _TURN_ROUND:
            self._reverse = not self._reverse
        elif direction:
            self._reverse = direction == _REVERSE
        action = word & 0b11
        if action == _RUN and not self._error:
            self._running, self._stopping, self._warning = True, False, 0
            self._drive()
        elif action == _STOP and self._running:
            self._stop(coast=self._registers[_STOP_METHOD] == 1)
        elif direction and self._running:
            self._drive()

    def _stop(self, *, coast: bool) -> None:
        if coast or self._torque_mode:
            self._off()
        else:
            self._stopping = True
            self._world.dynamometer.command(0.0)

    def _lost(self) -> None:
        """Do what is set for lost communication."""
        with self._world.lock:
            treatment = self._registers[_LOST_TREATMENT]
            if treatment == _NOTHING:
                return
            self._warning = _TIME_OUT_WARNING
            if treatment != _WARN and self._running:
                self._stop(coast=treatment == _COAST)

    @property
    def _torque_mode(self) -> bool:
        return self._registers[_CONTROL_MODE] == 2

    def _command_frequency(self) -> int:
        by_modbus = self._registers[_FREQUENCY_SOURCE] == _BY_MODBUS
        return min(self._registers[_FREQUENCY] if by_modbus else self.keypad_frequency, self._highest)

    @property
    def _highest(self) -> int:
        return self._registers[_MAXIMUM_FREQUENCY]

    def _radians(self, frequency: float) -> float:
        """Return the machine's speed (rad/s) at a frequency (0.01 Hz)."""
        return frequency * 0.01 * 2.0 * math.pi / self._pole_pairs

    def _limit(self, torque: float, speed: float) -> float:
        """Return the limit (rad/s) of a speed in torque mode."""
        forwards = speed >= 0.0
        if self._registers[_SPEED_LIMIT_BY] == 1 and (torque >= 0.0) == forwards:
            return self._radians(self._command_frequency())
        return self._radians(0.01 * self._registers[_FORWARD_LIMIT if forwards else _REVERSE_LIMIT] * self._highest)

    def _look(self, number: int, torque: float) -> None:
        """Hold the speed against its limit in torque mode; the limit is kept until the next command."""
        with self._world.lock:
            if number != self._looks or not (self._running and self._torque_mode) or self._limited:
                return
            machine = self._world.dynamometer
            speed = machine.own_speed
            limit = self._limit(torque, speed or torque)
            if abs(speed) >= limit:
                self._limited = True
                machine.set_mode("speed")
                machine.command(math.copysign(limit, speed or torque))
                return
        self._world.clock.call_at(self._world.clock.now() + _LOOK, partial(self._look, number, torque))

    def _drive(self) -> None:
        machine = self._world.dynamometer
        sign = -1.0 if self._reverse else 1.0
        self._limited = False
        self._looks += 1
        if self._torque_mode:
            followed = self._registers[_TORQUE_SOURCE] == _TORQUE_BY_MODBUS
            command = signed(self._registers[_TORQUE_COMMAND]) if followed else 0
            share = 0.01 * self._registers[_MAXIMUM_TORQUE]
            torque = sign * command / 1000.0 * share * self._rated_torque
            machine.set_mode("torque")
            machine.command(torque)
            if self._registers[_SPEED_LIMIT_BY] == 1 or self._narrow:
                self._world.clock.call_at(self._world.clock.now(), partial(self._look, self._looks, torque))
        else:
            machine.set_mode("speed")
            machine.command(sign * self._radians(self._command_frequency()))
        if not machine.enabled:
            machine.enable(True)

    @property
    def _narrow(self) -> bool:
        return min(self._registers[_FORWARD_LIMIT], self._registers[_REVERSE_LIMIT]) < 100

    def _off(self) -> None:
        self._looks += 1
        self._running = self._stopping = False
        self._world.dynamometer.enable(False)

    def _finish_stopping(self) -> None:
        if self._stopping and abs(self._world.dynamometer.speed(0.0)) < _STOPPED_SPEED:
            self._off()

    def _value(self, number: int, monitor: list[int]) -> int:
        if number >= _STATUS:
            return monitor[number - _STATUS]
        if number in (_COMMAND, _RESET):
            return 0
        if number == _IDENTITY:
            return _CODE
        return self._registers[number]

    def _monitor(self) -> list[int]:
        """Return 2100H … 210BH: codes, state, frequencies 0.01 Hz, current 0.01 A, voltages 0.1 V, torque 0.1 %."""
        machine = self._world.dynamometer
        running = machine.stuck_output.shown(self._running, machine.enabled)
        # A drive that believes that it is off still measures what it puts out.
        feeding = running or machine.enabled
        speed, torque = machine.speed(0.0), machine.torque(0.01) if feeding else 0.0
        frequency = round(abs(speed) * self._pole_pairs / (2.0 * math.pi) * 100.0) if running else 0
        load = torque / self._rated_torque
        state = 0b01 if self._stopping else 0b11 if running else 0b00
        status = state | (0b11 << 3 if self._reverse else 0) | 1 << 8 | 1 << 10
        current = round(100.0 * 3.0 * math.hypot(0.4, load)) if feeding else 0
        return [
            self._warning << 8 | self._error,
            status,
            self._command_frequency(),
            min(frequency, 0xFFFF),
            min(current, 0xFFFF),
            3100,
            round(min(frequency * 0.044, 2200.0)),
            0,
            round(900.0 * min(1.0, abs(load))),
            0,
            0,
            round(max(-3000.0, min(3000.0, 1000.0 * load))) & 0xFFFF,
        ]
