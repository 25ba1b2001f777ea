"""Damage on the bench besides that of the wires: outputs that do not obey, and a winding that overheats."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from sim_instruments.world.settings import Heating
from sim_instruments.world.sources.stuck_output import OutputSwitch, Reports
from sim_instruments.world.timeline import Timeline


@dataclass(frozen=True)
class Switched:
    """An output: whether it is stuck, and how it is switched."""

    stuck_output: OutputSwitch
    switch: Callable[[bool], None]


class Damage:
    """Breaks and mends things; every method takes None or False for mending.

    `timelines` are the motor's and, where the dynamometer turns alone, its own; `outputs` are the switched ones by role.
    """

    def __init__(self, timelines: tuple[Timeline, ...], outputs: Mapping[str, Switched]) -> None:
        self._timelines = timelines
        self._outputs = outputs
        #: What has come to harm in words, each with the bench time (s) at which it first did.
        self.harm: dict[str, float] = {}

    def hurt(self, what: str) -> None:
        """Record that something has come to harm; nothing mends it."""
        self.harm.setdefault(what, self._timelines[0].now)

    @property
    def stuck_outputs(self) -> dict[str, Reports]:
        """By role, the outputs that no longer switch off and what their instruments say of that."""
        return {
            role: output.stuck_output.stuck
            for role, output in self._outputs.items()
            if output.stuck_output.stuck is not None
        }

    def check_output(self, role: str) -> None:
        """Raise ValueError for a role that has no output."""
        if role not in self._outputs:
            raise ValueError(f"role {role!r} has no output that could stick; there are {', '.join(self._outputs)}")

    def stick(self, role: str, reports: Reports | None) -> None:
        """Make an output stay on once it is, and its instrument report it on or off. Raises ValueError for an unknown role."""
        self.check_output(role)
        output = self._outputs[role]
        output.stuck_output.stuck = reports
        if reports is None and not output.stuck_output.wanted:
            output.switch(False)

    def unplug(self, unplugged: bool) -> None:
        """Tear all of the motor's wires off, or put them back."""
        with self._timelines[0].changing() as settings:
            settings.faults.unplugged = unplugged

    def limit_supply(self, current: float | None) -> None:
        """Restrict the supply to a current (A) below its limit. Raises ValueError if it is not positive."""
        with self._timelines[0].changing() as settings:
            settings.faults.supply_current = _positive("current", current, "A")

    def run_dynamometer_away(self, speed: float | None) -> None:
        """Make the dynamometer run away to a speed (rad/s, at most its maximum) while it is on, independent of its commands."""
        checked = _positive("speed", speed, "rad/s")
        for timeline in self._timelines:
            with timeline.changing() as settings:
                most = timeline.constants.dynamometer.maximum_speed
                settings.faults.dynamometer_runaway = None if checked is None else min(checked, most)

    def run_inverter_away(self, speed: float | None) -> None:
        """Make the inverter's field go to a speed (rad/s, mechanical), or its regulated current to three times the command."""
        checked = _positive("speed", speed, "rad/s")
        timeline = self._timelines[0]
        with timeline.changing() as settings:
            parts = timeline.constants
            frequency = None if checked is None else checked * parts.motor.pole_pairs / (2.0 * math.pi)
            most = parts.inverter.maximum_frequency
            settings.faults.inverter_runaway = None if frequency is None else min(frequency, most)

    def overheat(self, heating: Heating | None) -> None:
        """Make the winding overheat by itself."""
        with self._timelines[0].changing() as settings:
            settings.faults.heating = heating


def _positive(what: str, value: float | None, unit: str) -> float | None:
    if value is not None and not 0.0 < value < math.inf:
        raise ValueError(f"{what} {value} {unit} must be positive and finite")
    return value
