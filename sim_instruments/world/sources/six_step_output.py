"""The six-step drive as its field bus and its Hall sensors see it."""

import math

import numpy as np

from sim_instruments.physics.commutated import Commutated
from sim_instruments.world.settings import SixStepFault
from sim_instruments.world.sources.six_step_stage import STATE_ANGLE, SixStepStage
from sim_instruments.world.sources.stuck_output import OutputSwitch
from sim_instruments.world.timeline import Timeline

#: The speed is told from the last electrical turn, or what of it fits in here (s).
_LONGEST_GATE = 0.5


class SixStepOutput:
    """Switch and true readings of the six-step drive. Off, its bridge counts as open: no diode conducts."""

    def __init__(self, timeline: Timeline, stage: SixStepStage) -> None:
        self._timeline = timeline
        self.stage = stage
        self.stuck_output = OutputSwitch()

    def enable(self, on: bool) -> None:
        """Switch the bridge on, at full voltage, or off; off, the rotor coasts. Switching on clears a fault."""
        with self._timeline.changing() as settings:
            if on and not settings.six_step.enabled:
                settings.six_step.fault = None
            settings.six_step.enabled = self.stuck_output.follows(on, settings.six_step.enabled)

    @property
    def enabled(self) -> bool:
        """True if the bridge is on."""
        with self._timeline.observing():
            return self._timeline.settings.six_step.enabled

    @property
    def fault(self) -> SixStepFault | None:
        """The reason why the bridge has switched itself off, or None."""
        with self._timeline.observing():
            return self._timeline.settings.six_step.fault

    def bus_voltage(self, aperture: float) -> float:
        """Return the mean voltage (V) between the bridge's rails over the last `aperture` s; 0 is the present value."""
        return float(self._bus(aperture)[0])

    def bus_current(self, aperture: float) -> float:
        """Return the mean current (A) out of the source over the last `aperture` s; 0 is the present value."""
        return float(self._bus(aperture)[1])

    def hall_state(self) -> tuple[bool, bool, bool]:
        """Return the Hall signals H1, H2, H3 now, each high for half an electrical turn.

        H1 alone is high in T1T2, H1 and H2 in T2T3, and so on: H1 rises with T1's turn and falls 60° after it, whatever is
        switched on.
        """
        with self._timeline.observing():
            angle = self._timeline.state.angle * self.stage.drive.pole_pairs
        state = math.floor(self.stage.state_angle(angle) / STATE_ANGLE) % 6
        return state in (5, 0, 1), state in (1, 2, 3), state in (3, 4, 5)

    def electrical_frequency(self) -> float:
        """Return the electrical frequency (Hz, signed) over the last electrical turn, as six Hall edges tell it."""
        with self._timeline.observing():
            electrical = abs(self._timeline.state.speed) * self.stage.drive.pole_pairs
            gate = min(2.0 * math.pi / electrical, _LONGEST_GATE) if electrical > 0.0 else _LONGEST_GATE
            return self._timeline.turned(gate) * self.stage.drive.pole_pairs / (2.0 * math.pi * gate)

    def _bus(self, aperture: float) -> np.ndarray:
        idle = np.array([self.stage.drive.source_voltage, 0.0])
        with self._timeline.observing():
            if aperture <= 0.0:
                circuit = self._timeline.present.circuit
                now = np.array([self._timeline.now])
                return circuit.bus(now)[:, 0] if isinstance(circuit, Commutated) else idle
            total = np.zeros(2)
            for segment, start, end in self._timeline.stretches(aperture):
                circuit = segment.circuit
                total += circuit.bus_integrals(start, end) if isinstance(circuit, Commutated) else idle * (end - start)
            return total / aperture
