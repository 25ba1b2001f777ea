"""The dynamometer's machine as its drive and its torque transducer see it."""

from typing import Literal

from sim_instruments.stages import DynamometerMachine
from sim_instruments.timeline import Timeline


class DynamometerShaft:
    """Set points and true readings of the dynamometer. Positive torque drives the shaft forwards."""

    def __init__(self, timeline: Timeline, machine: DynamometerMachine) -> None:
        self._timeline = timeline
        self.machine = machine

    def enable(self, on: bool) -> None:
        """Switch the drive on or off; off, the shaft coasts."""
        with self._timeline.changing() as settings:
            settings.dynamometer.enabled = on

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

    @property
    def enabled(self) -> bool:
        """Whether the drive is on."""
        with self._timeline.observing():
            return self._timeline.settings.dynamometer.enabled

    def speed(self, aperture: float = 0.0) -> float:
        """Return the mean speed (rad/s, signed) of the dynamometer over the last `aperture` s; 0 uncoupled."""
        with self._timeline.observing():
            if not self._timeline.settings.shaft.coupled:
                return 0.0
            if aperture <= 0.0:
                return self._timeline.state.speed
            return self._timeline.turned(aperture) / aperture

    def torque(self, aperture: float = 0.0) -> float:
        """Return the machine's mean air-gap torque (N·m) over the last `aperture` s: its reaction on the housing.

        It holds what accelerates motor and machine, the friction of both, and minus the motor's own torque.
        """
        with self._timeline.observing():
            return self._timeline.mean(lambda segment, times: segment.dynamometer_torque(times), aperture)
