"""The power stage of a simulated moteus: its measurements of motor and bus, and the bridge within its limits."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sim_instruments.disturbances.current_loop import CurrentLoop
from sim_instruments.instruments.mjbots import commands, limits
from sim_instruments.instruments.mjbots.configuration import MoteusSettings

if TYPE_CHECKING:
    from sim_instruments.world.sources.inverter_output import RotorState
    from sim_instruments.world.world import World

#: Below it the bus is too low (V).
_LEAST_VOLTAGE = 4.0
#: The board is warmer than the room (K), and the more so by its transistors' loss (K/A²); one for larger currents is cooled for them,
#: and rises by no more (K) at the largest.
_BOARD_WARMTH, _BOARD_RISE, _BOARD_LARGEST = 8.0, 4.0e-3, 16.0
_TURN = 2.0 * math.pi
#: How often the currents of a limited power are gone over, and the relative change at which they are found.
_PASSES, _SETTLED = 30, 1.0e-9
#: 1.5·p·λ = this / Kv (`UpdateConfig` in `fw/bldc_servo.cc`).
TORQUE_FACTOR = 1.5 / math.sqrt(3.0) * 60.0 / _TURN
#: N·m/A of a motor whose Kv is not configured.
_UNKNOWN_TORQUE_CONSTANT = 0.1


@dataclass(frozen=True)
class MoteusReading:
    """The drive's measurements at one time; SI but for `position` (turns) and `velocity` (turns/s), both of the output."""

    limit: int
    position: float
    velocity: float
    current: complex
    voltage: complex
    commanded_current: complex
    electrical_angle: float
    bus_voltage: float
    board_temperature: float
    motor_temperature: float
    torque: float
    power: float


class MoteusBridge:
    """The world's inverter as a moteus uses it; its own errors and noise are between the actual values and those it reports."""

    def __init__(
        self, world: "World", settings: MoteusSettings, loop: CurrentLoop, generator: np.random.Generator
    ) -> None:
        self._world = world
        self._settings = settings
        self._loop = loop
        self._random = generator
        self._effective = 0j
        self._limit = 0
        self._voltage = 0j
        #: What was commanded last of the currents (A), and the speed (rad/s) that is held.
        self._regulated: tuple[complex, float | None] | None = None
        self._on = False

    @property
    def on(self) -> bool:
        """True if it is switched on."""
        return self._on

    @property
    def poles(self) -> int:
        """Poles of the motor, as configured."""
        return int(self._settings["motor.poles"])

    @property
    def position(self) -> float:
        """The position of the output (turns)."""
        return self._position(self._world.inverter.rotor_state())

    def switch_off(self) -> None:
        """Switch it off; again is allowed."""
        self._effective, self._limit, self._voltage, self._regulated = 0j, 0, 0j, None
        self._switch(on=False)

    def regulate(self, wanted: complex, *, ignore_bounds: bool, velocity: float | None = None) -> None:
        """Regulate a current (A, d + j·q) as far as the limits allow it, or with its q part as the most come to a velocity (turns/s)."""
        state = self._world.inverter.rotor_state()
        held = None if velocity is None else velocity * _TURN / self.ratio
        if held is not None and held < state.speed:
            wanted = wanted.conjugate()
        if self._on and state.voltage:
            self._voltage = self._loop.commanded(state.voltage, state.electrical_speed)
        for _ in range(_PASSES):
            left, self._limit = limits.limited(
                wanted, self._around(state), self._settings.__getitem__, ignore_bounds=ignore_bounds
            )
            if self._limit == commands.LIMIT_MAX_POWER and self._effective:
                # The firmware comes to it step by step, each by the last one's voltage.
                left *= math.sqrt(abs(self._effective / left))
            if self._on and (left, held) == self._regulated and self._world.inverter.enabled:
                return
            settled = self._on and abs(left - self._effective) <= _SETTLED * abs(left)
            self._effective, self._regulated = left, (left, held)
            self._world.inverter.command_dq_current(
                self._loop.flowing(left), self._loop.offset, held, self._settings["servo.pid_dq_hz"]
            )
            self._world.inverter.set_mode("dq")
            self._switch(on=True)
            state = self._world.inverter.rotor_state()
            self._voltage = self._loop.commanded(state.voltage, state.electrical_speed)
            if settled or self._limit != commands.LIMIT_MAX_POWER:
                break

    def turn_field(self, current: float, velocity: float) -> None:
        """Turn a field of a current (A) in open loop, at a velocity of the output (turns/s)."""
        inverter = self._world.inverter
        self._effective, self._limit, self._regulated = complex(current), 0, None
        inverter.command_amplitude(abs(current) * (1.0 + self._loop.current_gain))
        inverter.command_frequency(velocity / self.ratio * 0.5 * self.poles)
        inverter.set_mode("frequency")
        self._switch(on=True)

    def fault(self) -> int:
        """Return the fault that what there is amounts to, 0 for none."""
        settings, bus = self._settings, self._bus_voltage
        if bus > settings["servo.max_voltage"]:
            return commands.OVER_VOLTAGE
        if bus < _LEAST_VOLTAGE:
            return commands.UNDER_VOLTAGE
        if self._board_temperature() > settings["servo.fault_temperature"]:
            return commands.OVER_TEMPERATURE
        if self._motor_temperature() > settings["servo.motor_fault_temperature"]:
            return commands.OVER_TEMPERATURE
        return 0 if self.poles else commands.MOTOR_NOT_CONFIGURED

    def reading(self) -> MoteusReading:
        """Return what there is now."""
        state, loop, inverter = self._world.inverter.rotor_state(), self._loop, self._world.inverter
        around = self._around(state)
        flowing = loop.shown(state.current)
        current = flowing + self._noise(loop.current_noise)
        # Nobody looks whether a phase is open: the loop's integrators run up to the largest voltage.
        runs_up = self._on and self._effective != 0j and inverter.fault is not None
        voltage = 0j
        if runs_up:
            voltage = inverter.stage.maximum_phase_voltage * self._effective / abs(self._effective)
        elif state.voltage:
            voltage = loop.commanded(state.voltage, state.electrical_speed) + self._noise(loop.voltage_noise)
        return MoteusReading(
            limit=commands.LIMIT_MAX_VOLTAGE if state.limited or runs_up else self._limit,
            position=around.position,
            velocity=around.velocity,
            current=current,
            voltage=voltage,
            commanded_current=self._effective if state.limited or runs_up or not self._on else flowing,
            electrical_angle=(state.electrical_angle + loop.angle_error) % _TURN,
            bus_voltage=around.bus_voltage,
            board_temperature=around.board_temperature,
            motor_temperature=around.motor_temperature,
            torque=self.torque_constant * current.imag / self.ratio,
            power=1.5 * (voltage.real * current.real + voltage.imag * current.imag),
        )

    @property
    def ratio(self) -> float:
        """Turns of the output in one of the rotor."""
        return self._settings["motor_position.rotor_to_output_ratio"]

    @property
    def torque_constant(self) -> float:
        """Torque (N·m/A) that it takes a q current for."""
        kv = self._settings["motor.Kv"]
        return TORQUE_FACTOR / kv if kv else _UNKNOWN_TORQUE_CONSTANT

    def _switch(self, *, on: bool) -> None:
        if on != self._on or (on and not self._world.inverter.enabled):
            self._world.inverter.enable(on)
            self._on = on

    def _around(self, state: "RotorState") -> limits.Surrounding:
        return limits.Surrounding(
            self._position(state),
            state.speed / _TURN * self.ratio,
            self._board_temperature(),
            self._motor_temperature(),
            self._bus_voltage,
            self._voltage,
        )

    @property
    def _bus_voltage(self) -> float:
        return self._world.inverter.stage.dc_voltage * (1.0 + self._loop.voltage_gain)

    def _position(self, state: "RotorState") -> float:
        return state.angle / _TURN * self.ratio + self._settings["motor_position.output.offset"]

    def _board_temperature(self) -> float:
        rise = min(_BOARD_RISE, _BOARD_LARGEST / self._world.inverter.stage.maximum_current**2)
        return self._world.ambient_temperature + _BOARD_WARMTH + rise * abs(self._effective) ** 2

    def _motor_temperature(self) -> float:
        return self._world.winding_temperature() if self._settings["servo.enable_motor_temperature"] else 0.0

    def _noise(self, deviation: float) -> complex:
        if not deviation:
            return 0j
        d_part, q_part = self._random.normal(0.0, deviation, 2).tolist()
        return complex(d_part, q_part)
