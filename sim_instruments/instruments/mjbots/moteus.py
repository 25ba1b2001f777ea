"""Simulated moteus: a field-oriented drive on CAN FD."""

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from sim_instruments.disturbances.current_loop import CurrentLoop
from sim_instruments.found_state import drawn
from sim_instruments.instruments.errors import InverterErrors
from sim_instruments.instruments.mjbots.bridge import TORQUE_FACTOR, MoteusBridge
from sim_instruments.instruments.mjbots.channels import Channels, Identification
from sim_instruments.instruments.mjbots.commands import COMMAND_WORDS, MoteusCommand, MoteusMode, command_of
from sim_instruments.instruments.mjbots.configuration import MoteusSettings
from sim_instruments.instruments.mjbots.console import MoteusConsole
from sim_instruments.instruments.mjbots.multiplex import (
    INT32,
    NOT_WRITABLE,
    UNKNOWN_REGISTER,
    DiscardedFrameError,
    MultiplexServer,
    RefusedWriteError,
    told,
)
from sim_instruments.instruments.mjbots.registers import READINGS, REGISTERS, UNREADABLE, counted, number_of_modes
from sim_instruments.instruments.mjbots.servo import MoteusServo, MoteusStatus

if TYPE_CHECKING:
    from sim_instruments.catalogue import Options
    from sim_instruments.world.world import World

#: Changes a reading on its way out, by its name.
Alter = Callable[[str, float], float]
BROADCAST = 0x7F
#: The system's counter of milliseconds begins shortly before it overflows, as the firmware has it.
_COUNTER_START = (1 << 31) - 300_000
_IDLE_STREAMS = (2, 3)
#: The bus (V) up to which the usual over-voltage fault of 56 V leaves room.
_LARGEST_BUS = 50.0


class SimulatedMoteus:
    """A moteus-n1 that was set up for the motor: poles, resistance, inductances and Kv as its calibration has found them.

    `node` is its identifier. What `write_frame` is given and returns are the bytes of CAN FD frames; see `multiplex`, `registers`,
    `console`. Left out: PWM, voltage and inductance modes, braking, aux ports, flow control of the stream.
    """

    def __init__(
        self,
        world: "World",
        generator: np.random.Generator,
        errors: InverterErrors | None = None,
        *,
        node: int = 1,
        options: "Options" = MappingProxyType({}),
    ) -> None:
        self._world = world
        loop: CurrentLoop = (errors or InverterErrors()).loop.with_more(world.disturbances.inverter)
        self._identification = Identification.of(generator)
        set_up = {
            **_set_up(world, generator),
            **{key: float(value) for key, value in (options.get("conf") or {}).items()},
        }
        uuid = {f"uuid.uuid.{place}": byte for place, byte in enumerate(self._identification.uuid)}
        self.configuration = MoteusSettings({**set_up, **uuid, "id.id": node})
        bridge = MoteusBridge(world, self.configuration, loop, generator)
        self.servo = MoteusServo(world, self.configuration, bridge)
        channels = Channels(self._status, self._command_told, self._identification, self._milliseconds, self._altered)
        self._channels = channels.by_name
        self._console = MoteusConsole(
            self.configuration, self._channels, self._directly, self.servo.configured, world.clock.now
        )
        idle = {number: _Silent() for number in _IDLE_STREAMS}
        self._server = MultiplexServer(self, {1: self._console, **idle})
        self._command = MoteusCommand()
        self._commanded = False
        self._snapshot: MoteusStatus | None = None
        self._alter: Alter | None = None
        self._trim = 0

    # As a node of a bus sees it

    @property
    def node(self) -> int:
        """Its identifier on the bus; one that cannot be is 1."""
        number = int(self.configuration["id.id"])
        return number if 1 <= number < BROADCAST else 1

    @property
    def prefix(self) -> int:
        """The upper 13 bits of the identifiers that it listens to and answers with."""
        return int(self.configuration["can.prefix"])

    @staticmethod
    def told(frame: bytes) -> str:
        """Return what a frame asks, in words, for faults to find it."""
        return told(frame)

    def understands(self) -> list[str]:
        """Return registers, channels of telemetry and items of the configuration, a line each."""
        return [
            *(f"{entry.number:03X}H {entry.access} {entry.name}" for _, entry in sorted(REGISTERS.items())),
            *(f"tel get {name}" for name in self._channels),
            *(f"conf get {line.partition(' ')[0]}" for line in self.configuration.lines()),
            *(f"d {word}" for word in COMMAND_WORDS),
        ]

    def serve(self, frame: bytes, *, respond: bool, alter: Alter | None = None) -> bytes | None:
        """Do what a frame asks and return the answer, None where there is none; `alter` changes readings on their way out."""
        with self._world.lock:
            self._alter, self._snapshot = alter, None
            try:
                return self._server.serve(frame, respond=respond)
            finally:
                self._alter = None

    def leave(self, generator: np.random.Generator) -> tuple[str, ...]:
        """Be as a last user may have left it: limits, the watchdog and the loop's settings, in memory; in a mode."""
        items = {
            "servo.max_current_A": drawn(generator, (100.0, 3.0, 0.5)),
            "servo.max_velocity": drawn(generator, (500.0, 2.0)),
            "servo.max_power_W": drawn(generator, (math.nan, 20.0)),
            "servo.default_timeout_s": drawn(generator, (0.1, math.nan, 0.01)),
            "servo.fw.enable": drawn(generator, (False, True)),
            "servopos.position_min": drawn(generator, (math.nan, -0.01)),
            "servopos.position_max": drawn(generator, (math.nan, 0.01)),
            "motor_position.rotor_to_output_ratio": drawn(generator, (1.0, 0.1)),
        }
        for name, value in items.items():
            self.configuration.put(name, value)
        mode = drawn(generator, (MoteusMode.STOPPED, MoteusMode.CURRENT, MoteusMode.TIMEOUT))
        self.servo.find(mode)
        self._console.take(drawn(generator, (b"", b"tel text\n")))
        return (*(f"{name} = {value:g}" for name, value in items.items()), f"mode {int(mode)}")

    def close(self) -> None:
        """Follow the time no longer; again is allowed."""
        self.servo.close()

    # As its registers' server

    def begin_frame(self) -> None:
        """Take it that a frame begins: nothing is commanded yet."""
        self._commanded = False

    def end_frame(self) -> None:
        """Do what the frame commands, if it has set the mode."""
        if self._commanded:
            self._commanded = False
            self._snapshot = None
            self.servo.do(self._command)

    def write(self, register: int, kind: int, value: float) -> None:
        """Write a register. Raises RefusedWriteError and, for another device's UUID, DiscardedFrameError."""
        entry = REGISTERS.get(register)
        if entry is None and register not in UNREADABLE:
            raise RefusedWriteError(UNKNOWN_REGISTER)
        if entry is None or entry.access == "ro":
            raise RefusedWriteError(NOT_WRITABLE)
        meant = entry.scale.value(value, kind)
        if entry.field == "mode":
            if not 0 <= meant < number_of_modes():
                raise RefusedWriteError(UNKNOWN_REGISTER)
            self._command, self._commanded = MoteusCommand(mode=int(meant)), True
        elif entry.origin == "command":
            setattr(self._command, entry.field, meant)
        elif entry.field.startswith("mask_"):
            if meant != self._identification.words[int(entry.field[-1])]:
                raise DiscardedFrameError
        elif entry.field == "exact":
            offset = "motor_position.output.offset"
            self.configuration.put(offset, self.configuration[offset] + meant - self._status().seen.position)
            self._snapshot = None
        elif entry.field == "nearest":
            offset = "motor_position.output.offset"
            left = meant - self._status().seen.position
            self.configuration.put(offset, self.configuration[offset] + round(left))
            self._snapshot = None
        elif entry.field == "clock_trim":
            self._trim = int(meant)

    def read(self, register: int, kind: int) -> float | None:
        """Return a register as it goes out in a type, None for one that cannot be read so."""
        entry = REGISTERS.get(register)
        if entry is None or entry.access == "wo" or (entry.only_int32 and kind != INT32):
            return None
        if entry.origin == "constant":
            return counted(entry, self._identification.constants[entry.field], kind)
        value = float(getattr(self._command, entry.field)) if entry.origin == "command" else self._shown(entry.field)
        if register in READINGS:
            value = self._altered(f"{register:03X}", value)
        return counted(entry, value, kind)

    def _shown(self, field: str) -> float:
        """Return what a register of what there is shows."""
        status, seen = self._status(), self._status().seen
        found: Mapping[str, float] = {
            "mode": status.mode,
            "fault": status.fault,
            "zero": 0.0,
            "none": math.nan,
            "homed": 1.0,
            "encoder_validity": 3.0,
            "encoder_position": seen.position % 1.0,
            "q_current": seen.current.imag,
            "d_current": seen.current.real,
            "control_torque": 0.0,
            "feedforward_torque": self._command.feedforward_torque,
            "milliseconds": self._milliseconds(),
            "clock_trim": self._trim,
        }
        return float(found[field] if field in found else getattr(seen, field))

    # What it is made of

    def _status(self) -> MoteusStatus:
        """Return what there is, the same for all of one frame."""
        if self._snapshot is None:
            self._snapshot = self.servo.status()
        return self._snapshot

    def _command_told(self) -> Mapping[str, float]:
        return asdict(self.servo.command)

    def _altered(self, name: str, value: float) -> float:
        return value if self._alter is None else self._alter(name, value)

    def _directly(self, words: list[str]) -> str:
        if words[:1] == ["nearest"] or words[:1] == ["exact"]:
            number = {"nearest": 0x130, "exact": 0x131}[words[0]]
            try:
                self.write(number, 3, float(words[1]) if len(words) > 1 else 0.0)
            except ValueError:
                return "ERR missing index value"
            return "OK"
        command = command_of(words)
        if isinstance(command, str):
            return command
        self._snapshot = None
        self.servo.do(command)
        return "OK"

    def _milliseconds(self) -> int:
        return _COUNTER_START + int(self._world.clock.now() * 1e3)


class _Silent:
    """A stream of an aux port that nothing is connected to."""

    def take(self, data: bytes) -> None:
        """Take bytes that go nowhere."""

    def give(self, most: int) -> bytes:
        """Return nothing."""
        return b""


def _set_up(world: "World", generator: np.random.Generator) -> dict[str, float]:
    """Return what the drive's calibration has found of the motor, and what is set with it."""
    motor = world.motor
    resistance, inductance, kv = (1.0 + generator.normal(0.0, share) for share in (0.02, 0.05, 0.01))
    return {
        "motor.poles": 2 * motor.pole_pairs,
        "motor.resistance_ohm": motor.stator_resistance_y * resistance,
        "motor.inductance_d_H": motor.d_axis_inductance_y * inductance,
        "motor.inductance_q_H": motor.q_axis_inductance_y * inductance,
        "motor.Kv": TORQUE_FACTOR / motor.torque_constant * kv,
        "servo.max_current_A": world.inverter.stage.maximum_current,
        # Of a board for more than 50 V, which a moteus-n1 is not.
        **({"servo.max_voltage": 1.2 * bus} if (bus := world.inverter.stage.dc_voltage) > _LARGEST_BUS else {}),
        "servopos.position_min": math.nan,
        "servopos.position_max": math.nan,
    }
