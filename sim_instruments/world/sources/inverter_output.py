"""The inverter as its field bus sees it."""

import math
from typing import Literal

from sim_instruments.world.machine_data import InverterStage
from sim_instruments.world.sources.stuck_output import OutputSwitch
from sim_instruments.world.timeline import Timeline


class InverterOutput:
    """Set points and true readings of the inverter. Frequencies are electrical, currents peak."""

    def __init__(self, timeline: Timeline, stage: InverterStage) -> None:
        self._timeline = timeline
        self.stage = stage
        self.stuck_output = OutputSwitch()

    def enable(self, on: bool) -> None:
        """Switch the bridge on or off; off, the rotor coasts. Switching on clears a fault."""
        with self._timeline.changing() as settings:
            if on and not settings.inverter.enabled:
                settings.inverter.fault = None
            settings.inverter.enabled = self.stuck_output.follows(on, settings.inverter.enabled)

    def set_mode(self, mode: Literal["frequency", "current"]) -> None:
        """Choose between the open-loop rotating field and the regulated q-axis current."""
        if mode not in ("frequency", "current"):
            raise ValueError(f"inverter mode {mode!r} is unknown; allowed are 'frequency' and 'current'")
        with self._timeline.changing() as settings:
            settings.inverter.mode = mode

    def command_frequency(self, frequency: float) -> None:
        """Set the electrical frequency (Hz, the sign is the direction); the stage's maximum clamps it."""
        limit = self.stage.maximum_frequency
        with self._timeline.changing() as settings:
            settings.inverter.frequency = min(max(float(frequency), -limit), limit)
            if frequency:
                settings.inverter.way = math.copysign(1.0, frequency)

    def command_amplitude(self, current: float) -> None:
        """Set the rotating field's phase current (A, peak); the stage's maximum clamps it."""
        with self._timeline.changing() as settings:
            settings.inverter.amplitude = min(max(float(current), 0.0), self.stage.maximum_current)

    def command_q_current(self, current: float) -> None:
        """Set the q-axis current (A, peak, positive drives forwards); the stage's maximum clamps it."""
        limit = self.stage.maximum_current
        with self._timeline.changing() as settings:
            settings.inverter.q_current = min(max(float(current), -limit), limit)

    @property
    def enabled(self) -> bool:
        """Whether the bridge is on."""
        inverter = self._timeline.settings.inverter
        with self._timeline.lock:
            # Nothing but `enable` puts it on.
            if not inverter.enabled:
                return False
        with self._timeline.observing():
            return inverter.enabled

    @property
    def fault(self) -> str | None:
        """What has switched the bridge off by itself, or None."""
        inverter = self._timeline.settings.inverter
        with self._timeline.lock:
            # Only a bridge that is on switches itself off.
            if not inverter.enabled:
                return inverter.fault
        with self._timeline.observing():
            return inverter.fault

    def output_frequency(self) -> float:
        """Return the electrical frequency (Hz, signed) the bridge puts out now, in the order of its own outputs."""
        with self._timeline.observing():
            return self._own(self._timeline.present.field_frequency(self._timeline.now))

    def q_current(self) -> float:
        """Return the torque-producing current (A, peak) that flows now; in frequency mode the amplitude's q part.

        Its sign is the bridge's own: with two wires in each other's place a positive one drives backwards.
        """
        with self._timeline.observing():
            return self._own(self._timeline.present.q_axis_current(self._timeline.now))

    def current_amplitude(self) -> float:
        """Return the amplitude (A, peak) of the phase currents that flow now."""
        with self._timeline.observing():
            return self._timeline.present.current_amplitude(self._timeline.now)

    def _own(self, value: float) -> float:
        """Return a signed figure of the motor's as the bridge sees it, whose outputs may meet the phases in the other order."""
        return value * (self._timeline.constants.inverter_direction(self._timeline.settings) or 1)
