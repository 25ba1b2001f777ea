"""The dynamometer's machine as its drive and its torque transducer see it."""

import math
from collections.abc import Callable
from typing import Literal

import numpy as np

from sim_instruments.clock.virtual_clock import BenchClock
from sim_instruments.disturbances.first_order import lagged_now
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.world.history import Quantity
from sim_instruments.world.machine_data import DynamometerMachine, InverterStage, Leads, SupplyStage
from sim_instruments.world.segment import Segment
from sim_instruments.world.settings import FloatArray
from sim_instruments.world.sources.stuck_output import OutputSwitch
from sim_instruments.world.timeline import Timeline

#: What a sensor is given at times (s): angle (rad) and speed (rad/s) of the shaft.
TurningSignal = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
#: Where in its aperture a mean looks.
_MIDDLES = (np.arange(256) + 0.5) / 256
#: What hangs on the machine's coupling when the motor is off it: nothing that matters.
_NO_LOAD = VirtualMotor(
    connection="wye",
    phase_resistances=(1.0, 1.0, 1.0),
    d_axis_inductance=1.0e-3,
    q_axis_inductance=1.0e-3,
    flux_linkage=1.0e-9,
    pole_pairs=1,
    inertia=1.0e-15,
)


class DynamometerShaft:
    """Set points and true readings of the dynamometer. Positive torque drives the shaft forwards.

    Coupled, it shares the motor's timeline; uncoupled, its own rotor turns on a timeline of its own.
    """

    def __init__(self, timeline: Timeline, machine: DynamometerMachine, clock: BenchClock) -> None:
        self._shared = timeline
        self.machine = machine
        self.stuck_output = OutputSwitch()
        self._alone = Timeline(
            _NO_LOAD,
            clock,
            supply=SupplyStage(),
            dynamometer=machine,
            inverter=InverterStage(),
            leads=Leads(),
            ambient_temperature=25.0,
            initial_angle=0.0,
        )
        with self._alone.changing() as settings:
            settings.shaft.coupled = True

    def enable(self, on: bool) -> None:
        """Switch the drive on or off; off, the shaft coasts."""
        with self._timeline.changing() as settings:
            settings.dynamometer.enabled = self.stuck_output.follows(on, settings.dynamometer.enabled)

    def set_mode(self, mode: Literal["speed", "torque"]) -> None:
        """Choose what is regulated; the command becomes zero where the mode changes."""
        if mode not in ("speed", "torque"):
            raise ValueError(f"dynamometer mode {mode!r} is unknown; allowed are 'speed' and 'torque'")
        with self._timeline.changing() as settings:
            if settings.dynamometer.mode != mode:
                settings.dynamometer.mode = mode
                settings.dynamometer.command = 0.0

    def command(self, value: float) -> None:
        """Set the commanded speed (rad/s) or torque (N·m), after the mode; the machine's limits clamp it."""
        with self._timeline.changing() as settings:
            speed_mode = settings.dynamometer.mode == "speed"
            limit = self.machine.maximum_speed if speed_mode else self.machine.maximum_torque
            settings.dynamometer.command = min(max(float(value), -limit), limit)
            if value:
                settings.dynamometer.way = math.copysign(1.0, value)

    @property
    def alone(self) -> Timeline:
        """The timeline of the machine's own rotor, for when it is uncoupled."""
        return self._alone

    @property
    def enabled(self) -> bool:
        """True if the drive is on."""
        with self._timeline.lock:
            # Nothing that happens by itself switches it.
            return self._timeline.settings.dynamometer.enabled

    @property
    def own_speed(self) -> float:
        """Present speed (rad/s) of the machine's own shaft, coupled or not."""
        with self._timeline.observing():
            return self._timeline.speed

    def speed(self, aperture: float = 0.0) -> float:
        """Return the mean speed (rad/s, signed) of the dynamometer over the last `aperture` s."""
        with self._timeline.observing():
            if aperture <= 0.0:
                return self._timeline.speed
            return self._timeline.turned(aperture) / aperture

    def torque(self, aperture: float = 0.0) -> float:
        """Return the machine's mean air-gap torque (N·m) over the last `aperture` s: its reaction on the housing.

        It holds what accelerates motor and machine, the friction of both, and minus the motor's own torque.
        """
        with self._timeline.observing():
            return self._timeline.mean(
                lambda segment, times: segment.dynamometer_torque(times),
                aperture,
                steady=lambda segment: segment.steady_dynamometer_torque,
            )

    def lagging_speed(self, time_constant: float) -> float:
        """Return the speed (rad/s, signed) behind a first-order filter (time constant in s)."""
        return self._lagging(lambda segment, times: segment.motion.speed(times), time_constant)

    def lagging_torque(self, time_constant: float) -> float:
        """Return the machine's air-gap torque (N·m) behind a first-order filter (time constant in s)."""
        return self._lagging(lambda segment, times: segment.dynamometer_torque(times), time_constant)

    def sensed(self, signal: TurningSignal, time_constant: float, aperture: float) -> float:
        """Return a signal behind a first-order filter (s), or where that is 0 its mean over the last `aperture` s."""

        def quantity(segment: Segment, times: FloatArray) -> FloatArray:
            return signal(times, segment.motion.angle(times), segment.motion.speed(times))

        if time_constant:
            return self._lagging(quantity, time_constant)
        with self._timeline.observing():
            now = self._timeline.now
            return float(self._timeline.sample(quantity, now - aperture * _MIDDLES).mean())

    def _lagging(self, quantity: Quantity, time_constant: float) -> float:
        with self._timeline.observing():
            timeline = self._timeline
            return lagged_now(
                lambda times: timeline.sample(quantity, np.minimum(times, timeline.now)), timeline.now, time_constant
            )

    def follow_coupling(self, coupled: bool) -> None:
        """Take the drive's settings along to the shaft that it now turns; both stand still."""
        if coupled == self._shared.settings.shaft.coupled:
            return
        left, joined = (self._alone, self._shared) if coupled else (self._shared, self._alone)
        with left.changing() as old, joined.changing() as new:
            self._shared.settings.shaft.coupled = coupled
            new.dynamometer.enabled = old.dynamometer.enabled
            new.dynamometer.mode = old.dynamometer.mode
            new.dynamometer.command = old.dynamometer.command
            new.dynamometer.way = old.dynamometer.way
            old.dynamometer.enabled = False

    @property
    def _timeline(self) -> Timeline:
        return self._shared if self._shared.settings.shaft.coupled else self._alone
