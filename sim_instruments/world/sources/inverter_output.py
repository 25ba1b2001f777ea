"""The inverter as its field bus sees it."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sim_instruments.physics.field import RotorField
from sim_instruments.world.machine_data import InverterStage
from sim_instruments.world.segment import Segment
from sim_instruments.world.sources.stuck_output import OutputSwitch
from sim_instruments.world.timeline import Timeline


@dataclass(frozen=True)
class RotorState:
    """Shaft `angle` (rad) and `speed` (rad/s), the d axis' `electrical_angle` (rad) from terminal A's and its `electrical_speed` (rad/s).

    `current` (A, without an offset) and `voltage` (V, before dead time) are d + j·q, peak; `limited` says that the voltage bounds the
    current.
    """

    angle: float
    speed: float
    electrical_angle: float
    electrical_speed: float
    current: complex
    voltage: complex
    limited: bool


class InverterOutput:
    """Set points and true readings of the inverter. Frequencies are electrical, currents peak."""

    def __init__(self, timeline: Timeline, stage: InverterStage) -> None:
        self._timeline = timeline
        self.stage = stage
        self.stuck_output = OutputSwitch()
        #: What there was of the rotor when somebody last looked: a drive looks several times at once.
        self._seen: tuple[float, Segment, RotorState] | None = None

    def enable(self, on: bool) -> None:
        """Switch the bridge on or off; off, the rotor coasts. Switching on clears a fault."""
        with self._timeline.changing() as settings:
            if on and not settings.inverter.enabled:
                settings.inverter.fault = None
            settings.inverter.enabled = self.stuck_output.follows(on, settings.inverter.enabled)

    def set_mode(self, mode: Literal["frequency", "current", "dq"]) -> None:
        """Choose between the open-loop rotating field, the regulated q-axis current, and both currents at the rotor's own angle."""
        if mode not in ("frequency", "current", "dq"):
            raise ValueError(f"inverter mode {mode!r} is unknown; allowed are 'frequency', 'current' and 'dq'")
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

    def command_dq_current(
        self,
        current: complex,
        offset: complex = 0j,
        held_speed: float | None = None,
        bandwidth: float | None = None,
    ) -> None:
        """Set the currents (A, d + j·q, peak, in the true rotor's coordinates); the stage's maximum clamps their length.

        `offset` (A, along terminal A's axis + j·across) flows beside them unseen, standing still in the stator. With a `held_speed`
        (rad/s, mechanical) the q current is the most that is used to come to it. `bandwidth` (Hz) is that of the loop that regulates them.
        """
        limit = self.stage.maximum_current
        with self._timeline.changing() as settings:
            settings.inverter.dq_current = current * (limit / abs(current) if abs(current) > limit else 1.0)
            settings.inverter.current_offset = offset
            settings.inverter.held_speed = held_speed
            settings.inverter.bandwidth = bandwidth

    @property
    def enabled(self) -> bool:
        """True if the bridge is on."""
        inverter = self._timeline.settings.inverter
        with self._timeline.lock:
            # Nothing but `enable` puts it on.
            if not inverter.enabled:
                return False
        with self._timeline.observing():
            return inverter.enabled

    @property
    def fault(self) -> str | None:
        """The reason why the bridge has switched itself off, or None."""
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

    def rotor_state(self) -> "RotorState":
        """Return what there is now of the rotor and, in its coordinates, of currents and the bridge's commanded voltages.

        Without a regulated current in the rotor's coordinates both are zero.
        """
        with self._timeline.observing():
            now, segment = self._timeline.now, self._timeline.present
            if self._seen is None or self._seen[0] != now or self._seen[1] is not segment:
                self._seen = now, segment, self._rotor_state(now, segment)
            return self._seen[2]

    def _rotor_state(self, now: float, segment: Segment) -> "RotorState":
        timeline, windings, circuit = self._timeline, segment.windings, segment.circuit
        way = timeline.constants.inverter_direction(timeline.settings) or 1
        angle, speed = timeline.angle, timeline.speed
        current = voltage = 0j
        limited = False
        if isinstance(circuit, RotorField):
            at = np.array([now])
            current, voltage = complex(circuit.regulated_currents(at)[0]), complex(circuit.dq_voltages(at)[0])
            limited = bool(circuit.limited(at)[0])
        return RotorState(
            angle,
            speed,
            angle * windings.pole_pairs - windings.phase_shift,
            speed * windings.pole_pairs,
            complex(current.real, way * current.imag),
            complex(voltage.real, way * voltage.imag),
            limited,
        )

    def _own(self, value: float) -> float:
        """Return a signed figure of the motor's as the bridge sees it, whose outputs may meet the phases in the other order."""
        return value * (self._timeline.constants.inverter_direction(self._timeline.settings) or 1)
