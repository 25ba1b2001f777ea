"""The insulation tester's output between `insulation_high` and the motor's frame."""

import math
from dataclasses import dataclass

from sim_instruments.faults.damage import Damage
from sim_instruments.world.settings import TERMINALS, WorldSettings
from sim_instruments.world.timeline import Timeline

#: Resistance (Ω) through which the tester charges and discharges its object, and the most that it gives (A).
_SOURCE_RESISTANCE = 1.0e6
_LARGEST_CURRENT = 0.010
#: What an instrument on the winding leaks to earth (Ω) at a test voltage that it is not made for.
_INSTRUMENT_LEAK = 1.0e6
#: Above this voltage (V) between winding and frame, an instrument on the winding comes to harm.
_HARMLESS = 60.0
#: A supply's, bridge's, inverter's or drive's leads stand off no test voltage; probes and the voltmeter's leads do.
_TENDER = ("supply", "lcr", "inverter", "drive")
#: Times (s) nearer than this are one.
_INSTANT = 1e-9


@dataclass(frozen=True)
class _Run:
    """From `start` (s) on the voltage (V) rises for `rise` s; it is there for `hold` s more."""

    start: float
    voltage: float
    rise: float
    hold: float


class InsulationOutput:
    """Switch and true readings. The object is the winding's insulation and its capacitance against the frame."""

    def __init__(self, timeline: Timeline, damage: Damage) -> None:
        self._timeline = timeline
        self._damage = damage
        self._run: _Run | None = None
        self._stopped = -math.inf
        self._left = 0.0

    def start(self, voltage: float, rise: float, hold: float) -> None:
        """Raise the output to a voltage (V) in `rise` s, and hold it for `hold` s unless it is stopped before."""
        with self._timeline.observing():
            self._run = _Run(self._timeline.now, voltage, rise, hold)
            if voltage > _HARMLESS:
                for name in self._tender():
                    self._damage.hurt(f"{name} had {voltage:g} V of the insulation tester on it")

    def stop(self) -> None:
        """Switch the output off; the object discharges."""
        with self._timeline.observing():
            if self._run is not None:
                self._left, self._stopped, self._run = self.voltage(), self._timeline.now, None

    @property
    def on(self) -> bool:
        """True if the tester drives its output."""
        with self._timeline.observing():
            run = self._run
            return run is not None and self._timeline.now < run.start + run.rise + run.hold

    def voltage(self, at: float | None = None) -> float:
        """Return the voltage (V) on the winding, or at the open lead, against the frame at a time (s) of this run, or now."""
        with self._timeline.observing():
            now, run = self._timeline.now if at is None else at, self._run
            if run is None:
                return self._left * self._discharged(now - self._stopped)
            end = run.start + run.rise + run.hold
            share = min(1.0, (min(now, end) - run.start) / run.rise) if run.rise > 0.0 else 1.0
            driven = min(share * run.voltage, _LARGEST_CURRENT * self._resistance())
            return driven if now <= end + _INSTANT else driven * self._discharged(now - end)

    def resistance(self, at: float | None = None) -> float:
        """Return voltage over current (Ω) at the output, what charges the capacitance included, at a time (s) of this run, or now.

        Infinite with nothing there.
        """
        with self._timeline.observing():
            now, run, voltage = self._timeline.now if at is None else at, self._run, self.voltage(at)
            if run is None or voltage <= 0.0:
                return math.inf
            capacitance, passed = self._capacitance(), now - run.start
            if passed > run.rise + run.hold + _INSTANT:
                return math.inf
            current = voltage / self._resistance()
            if passed < run.rise:
                current += capacitance * run.voltage / run.rise
            elif capacitance:
                current += voltage / _SOURCE_RESISTANCE * self._discharged(passed - run.rise)
            return voltage / current if current > 0.0 else math.inf

    def _discharged(self, passed: float) -> float:
        constant = _SOURCE_RESISTANCE * self._capacitance()
        return math.exp(-passed / constant) if constant > 0.0 else 0.0

    def _reached(self) -> bool:
        return "insulation_high" in self._timeline.settings.sockets()

    def _capacitance(self) -> float:
        return self._timeline.constants.motor.frame_capacitance if self._reached() else 0.0

    def _resistance(self) -> float:
        if not self._reached():
            return math.inf
        conductance = 1.0 / self._timeline.constants.motor.insulation_resistance
        return 1.0 / (conductance + len(self._tender()) / _INSTRUMENT_LEAK)

    def _tender(self) -> list[str]:
        """Return the instruments' sockets that are on the winding along with the tester."""
        return _instruments_on(self._timeline.settings) if self._reached() else []


def _instruments_on(settings: WorldSettings) -> list[str]:
    found = settings.sockets()
    return [
        f"{socket} at {terminal}"
        for terminal, socket in zip(TERMINALS, found, strict=True)
        if socket.startswith(_TENDER)
    ]
