"""The modes of a simulated moteus: how commands change them, what ends them, and what they have the bridge do."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sim_instruments.instruments.mjbots import commands
from sim_instruments.instruments.mjbots.bridge import MoteusBridge, MoteusReading
from sim_instruments.instruments.mjbots.commands import NOT_COMMANDED, WATCHED, MoteusCommand, MoteusMode
from sim_instruments.instruments.mjbots.configuration import MoteusSettings

if TYPE_CHECKING:
    from sim_instruments.world.world import World

#: From stopped to a mode: the gate driver is enabled, then the currents' offsets are found (s).
_ENABLING, _CALIBRATING = 4.0e-3, 10.0e-3
#: Limits and faults are looked at as often (s) as time goes on, and whenever somebody asks.
_LOOKING = 0.01
_IDLE = (MoteusMode.STOPPED, MoteusMode.FAULT, MoteusMode.ENABLING, MoteusMode.CALIBRATING)


@dataclass(frozen=True)
class MoteusStatus:
    """Mode, fault or limiting code, and what the bridge sees."""

    mode: MoteusMode
    fault: int
    seen: MoteusReading


class MoteusServo:
    """Takes commands, and drives the bridge by them.

    Current mode and the open loop (position mode with a fixed current) are real, and so are faults, limits and the watchdog of every
    mode. In position mode, zero velocity and after a time-out the shaft is brought to the commanded velocity with the largest torque, and
    held there; a position is not gone to. Within its bounds the stay-within mode has the feedforward's torque only. Without the bridge:
    PWM, voltage and inductance modes, and braking.
    """

    def __init__(self, world: "World", settings: MoteusSettings, bridge: MoteusBridge) -> None:
        self._world = world
        self._settings = settings
        self._bridge = bridge
        self._mode = MoteusMode.STOPPED
        self._fault = 0
        #: The last command, with what the configuration has filled in.
        self.command = MoteusCommand()
        self._cancel: list[Callable[[], None]] = []
        self._followed = world.clock.now()
        self._unfollow = world.clock.on_advance(self._advance)

    def close(self) -> None:
        """Follow the time no longer; again is allowed."""
        self._unfollow()
        self._disarm()

    def do(self, command: MoteusCommand) -> None:
        """Take a command. One to a mode that cannot be commanded is ignored, and from fault or time-out only "stopped" is taken."""
        if command.mode in NOT_COMMANDED:
            return
        self.command, fault = command.prepared(self._settings)
        self._disarm()
        if fault:
            self._trip(fault)
        elif command.mode == MoteusMode.STOPPED:
            self._bridge.switch_off()
            self._mode, self._fault = MoteusMode.STOPPED, 0
        elif self._mode == MoteusMode.STOPPED:
            self._mode = MoteusMode.ENABLING
            self._at(_ENABLING, self._calibrate)
        elif self._mode in (MoteusMode.ENABLING, MoteusMode.CALIBRATING):
            self._at(_ENABLING + _CALIBRATING, self._enter)
        elif self._mode not in (MoteusMode.FAULT, MoteusMode.TIMEOUT):
            self._enter()

    def find(self, mode: MoteusMode) -> None:
        """Be in a mode from the beginning, with nothing commanded and no watchdog."""
        self.command = MoteusCommand(mode=mode, timeout=math.nan)
        self._mode = mode
        self._follow()

    def status(self) -> MoteusStatus:
        """Return what there is now."""
        with self._world.lock:
            self._follow()
            seen = self._bridge.reading()
            result = self._fault if self._mode in (MoteusMode.STOPPED, MoteusMode.FAULT) else seen.limit
            return MoteusStatus(self._mode, result, seen)

    def configured(self) -> None:
        """Go by what the configuration says now."""
        with self._world.lock:
            self._follow()

    def _calibrate(self) -> None:
        if self._mode == MoteusMode.ENABLING:
            self._mode = MoteusMode.CALIBRATING
            self._at(_CALIBRATING, self._enter)

    def _enter(self) -> None:
        """Go to the mode that was commanded last."""
        mode, position = MoteusMode(self.command.mode), self._bridge.position
        low, high = self._settings["servopos.position_min"], self._settings["servopos.position_max"]
        if mode in WATCHED and not self.command.ignore_position_bounds and (position < low or position > high):
            self._trip(commands.START_OUTSIDE_LIMIT)
            return
        self._mode = mode
        if mode in WATCHED and math.isfinite(self.command.timeout):
            # A process is watched, which lives in the wall's time.
            self._at(self.command.timeout * getattr(self._world.clock, "speedup", 1.0), self._time_out)
        self._follow()

    def _time_out(self) -> None:
        if self._mode in WATCHED:
            self._mode = MoteusMode.TIMEOUT
            self._follow()

    def _trip(self, fault: int) -> None:
        self._bridge.switch_off()
        self._mode, self._fault = MoteusMode.FAULT, fault

    def _at(self, seconds: float, act: Callable[[], None]) -> None:
        def locked() -> None:
            with self._world.lock:
                act()

        clock = self._world.clock
        self._cancel.append(clock.call_at(clock.now() + seconds, locked))

    def _disarm(self) -> None:
        for cancel in self._cancel:
            cancel()
        self._cancel.clear()

    def _advance(self, time: float) -> None:
        if self._bridge.on and time - self._followed >= _LOOKING:
            with self._world.lock:
                self._follow()

    def _follow(self) -> None:
        """Hold faults and limits against what there is, and have the bridge do what is left of the command."""
        self._followed = self._world.clock.now()
        if self._mode in _IDLE:
            return
        fault = self._bridge.fault()
        if fault:
            self._trip(fault)
            return
        command, free = self.command, bool(self.command.ignore_position_bounds)
        match self._mode:
            case MoteusMode.CURRENT:
                self._bridge.regulate(complex(command.d_current, command.q_current), ignore_bounds=free)
            case MoteusMode.POSITION if not math.isnan(command.fixed_current):
                self._bridge.turn_field(command.fixed_current, _number(command.velocity))
            case MoteusMode.POSITION if command.kp_scale or command.kd_scale:
                self._hold(_number(command.velocity), command.maximum_torque)
            case MoteusMode.POSITION | MoteusMode.STAY_WITHIN:
                self._bridge.regulate(complex(0.0, self._current_of(command.feedforward_torque)), ignore_bounds=free)
            case MoteusMode.ZERO_VELOCITY:
                self._hold(0.0, self._settings["servo.timeout_max_torque_Nm"])
            case MoteusMode.TIMEOUT if self._settings["servo.timeout_mode"] in (
                MoteusMode.ZERO_VELOCITY,
                MoteusMode.POSITION,
            ):
                self._hold(0.0, self._settings["servo.timeout_max_torque_Nm"])
            case _:
                self._bridge.switch_off()

    def _hold(self, velocity: float, torque: float) -> None:
        """Come to a velocity of the output (turns/s) with up to a torque (N·m), NaN being the largest there is."""
        most = self._settings["servo.max_current_A"]
        current = most if math.isnan(torque) else min(abs(self._current_of(torque)), most)
        free = bool(self.command.ignore_position_bounds)
        self._bridge.regulate(complex(0.0, current), ignore_bounds=free, velocity=velocity)

    def _current_of(self, torque: float) -> float:
        """Return the q current (A) of a torque at the output (N·m)."""
        return torque * self._bridge.ratio / self._bridge.torque_constant


def _number(value: float) -> float:
    return 0.0 if math.isnan(value) else value
