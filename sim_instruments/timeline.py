"""Bench time as a chain of segments, carried on lazily whenever somebody looks or changes something."""

import math
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import pairwise

import numpy as np

from sim_instruments.clock import BenchClock
from sim_instruments.parts import Parts
from sim_instruments.physics.field import ImpressedField
from sim_instruments.physics.motor import VirtualMotor
from sim_instruments.physics.windings import FloatArray, Windings
from sim_instruments.planner import plan
from sim_instruments.segment import FieldState, Segment, State
from sim_instruments.settings import Settings
from sim_instruments.six_step_stage import SixStepStage
from sim_instruments.stages import DynamometerMachine, InverterStage, Leads, SupplyStage
from sim_instruments.thermal import temperature_after

#: How long (s of bench time) past segments are kept.
HISTORY = 600.0
#: More segments than this without time moving on means that no law gets hold of the state.
_PATIENCE = 1000


class Timeline:
    """State, settings and past of the bench. Look inside `observing()`, change inside `changing()`."""

    def __init__(
        self,
        motor: VirtualMotor,
        clock: BenchClock,
        *,
        supply: SupplyStage,
        dynamometer: DynamometerMachine,
        inverter: InverterStage,
        leads: Leads,
        ambient_temperature: float,
        initial_angle: float,
        six_step: SixStepStage | None = None,
    ) -> None:
        self.lock = threading.RLock()
        self.parts = Parts(motor, supply, dynamometer, inverter, leads, six_step)
        self.settings = Settings(ambient_temperature=ambient_temperature)
        self._clock = clock
        self.now = clock.now()
        self._state = State(initial_angle, 0.0, np.zeros(3), 0.0, ambient_temperature)
        self._depth = 0
        first = plan(self.parts, self.settings, self._state, self.now)
        # Before the first moment the bench has stood like this for ever.
        self._past: list[Segment] = [replace(first, start=-math.inf, end=self.now)]
        self._begin = self._state
        self.present = first

    @property
    def state(self) -> State:
        """The state at the present time."""
        return self._state

    @contextmanager
    def observing(self) -> Iterator[None]:
        """Hold the lock, with the bench brought to the present."""
        with self.lock:
            self._advance()
            yield

    @contextmanager
    def changing(self) -> Iterator[Settings]:
        """Hold the lock, give the settings to change, and go on from the present with what they make of it."""
        with self.lock:
            self._advance()
            yield self.settings
            self._cut(self.now, self._state)

    def set_winding_temperature(self, temperature: float) -> None:
        """Put the winding at a temperature (°C); to be called while changing."""
        self._state = replace(self._state, temperature=temperature)

    def winding_temperature(self) -> float:
        """Return the winding's temperature (°C) now."""
        return self._state.temperature

    def windings(self) -> Windings:
        """Return the motor's windings at the present temperature."""
        return Windings(self.parts.motor, self._state.temperature)

    # The past

    def sample(self, quantity: Callable[[Segment, FloatArray], FloatArray], times: FloatArray) -> FloatArray:
        """Return a quantity at past times (s, any order). Raises ValueError for times to come or no longer kept."""
        values = np.zeros(len(times))
        if not len(times):
            return values
        self._check_known(float(times.min()), float(times.max()))
        segments = [*self._past, self.present]
        starts = np.array([segment.start for segment in segments])
        index = np.searchsorted(starts, times, side="right") - 1
        for number in np.unique(index):
            chosen = index == number
            segment = segments[number]
            at = np.minimum(times[chosen], self.now)
            values[chosen] = quantity(segment, at)
        return values

    def mean(
        self, quantity: Callable[[Segment, FloatArray], FloatArray], aperture: float, until: float | None = None
    ) -> float:
        """Return the mean of a quantity over the `aperture` s before `until` (s; now), or its value then for 0.

        Raises ValueError where `until` is given and the aperture lies in times to come or no longer kept.
        """
        if until is not None:
            self._check_known(until - aperture, until)
        if aperture <= 0.0:
            if until is not None:
                return float(self.sample(quantity, np.array([until]))[0])
            return float(quantity(self.present, np.array([self.now]))[0])
        total = 0.0
        for segment, start, end in self.stretches(aperture, until):
            times, weights = segment.nodes_between(start, end)
            total += float(weights @ quantity(segment, times))
        return total / aperture

    def angles(self, times: FloatArray) -> FloatArray:
        """Return the shaft's angle (rad) at past times."""
        return self.sample(lambda segment, at: segment.motion.angle(at), times)

    def turned(self, gate: float) -> float:
        """Return by how much (rad, signed) the shaft has turned in the last `gate` s."""
        start, end = self.angles(np.array([self.now - gate, self.now]))
        return float(end - start)

    def travelled(self, gate: float, until: float | None = None) -> float:
        """Return how far (rad) the shaft has turned in the `gate` s before `until` (s; now), either way."""
        return sum(
            abs(float(np.diff(segment.motion.angle(np.array([start, end])))[0]))
            for segment, start, end in self.stretches(gate, until)
        )

    def stretches(self, gate: float, until: float | None = None) -> Iterator[tuple[Segment, float, float]]:
        """Give the parts of segments that fill the `gate` s before `until` (s; now): segment, from, to (s).

        Within each part the shaft turns one way.
        """
        last = self.now if until is None else min(until, self.now)
        begin = last - gate
        for segment in [*self._past, self.present]:
            end = min(segment.end, last)
            start = max(segment.start, begin)
            if end > start:
                inside = [time for time in segment.reversals if start < time < end]
                for first, second in pairwise([start, *inside, end]):
                    yield segment, first, second

    def _check_known(self, first: float, last: float) -> None:
        if last > self.now + 1e-12:
            raise ValueError(f"time {last:.9g} s is still to come; now is {self.now:.9g} s")
        if first < (self._past[0] if self._past else self.present).start:
            raise ValueError(f"time {first:.9g} s is no longer known; the bench remembers {HISTORY:g} s of its past")

    # Going on

    def _advance(self) -> None:
        now = self._clock.now()
        patience = _PATIENCE
        while self.present.end <= now:
            end = self.present.end
            patience = patience - 1 if end <= self.present.start else _PATIENCE
            if patience == 0:
                raise RuntimeError(f"the bench does not get on at {end:.9g} s; supply mode {self.present.supply_mode}")
            state = self._state_at(end, ended=True)
            self._happen()
            self._cut(end, state)
        if now > self.now:
            self.now = now
            self._state = self._state_at(now, ended=False)
            self._past = [segment for segment in self._past if segment.end >= now - HISTORY]

    def _cut(self, time: float, state: State) -> None:
        """End the present segment and begin the next one."""
        if time > self.present.start:
            self._past.append(replace(self.present, end=time))
        self._begin = self._state = state
        self.now = max(self.now, time)
        self.present = plan(self.parts, self.settings, state, time)

    def _happen(self) -> None:
        """Let happen what the present segment's end brings about."""
        outcome, settings = self.present.outcome, self.settings
        if outcome in ("trip voltage", "trip current"):
            settings.supply.tripped = "voltage" if outcome == "trip voltage" else "current"
            settings.supply.on = False
        elif outcome == "let go":
            settings.shaft.holder = "free"

    def _state_at(self, time: float, *, ended: bool) -> State:
        """Return the state at a time of the present segment; `ended` says that it has run its full length."""
        segment, before = self.present, self._begin
        at = np.array([time])
        outcome = segment.outcome if ended else "none"
        circuit = segment.circuit
        field: FieldState | None = None
        if isinstance(circuit, ImpressedField):
            currents = circuit.smooth_currents(at)[:, 0]
            field = FieldState(
                float(circuit.field_angle(at)[0]),
                float(circuit.field_speed(at)[0]),
                segment.in_step and outcome != "lost step",
            )
        else:
            currents = circuit.winding_currents(at)[:, 0]
        since = None
        if segment.supply_mode == "cc":
            since = segment.start if before.constant_current_since is None else before.constant_current_since
        return State(
            angle=float(segment.motion.angle(at)[0]),
            speed=0.0 if outcome in ("standstill", "breakaway") else float(segment.motion.speed(at)[0]),
            winding_currents=currents,
            source_voltage=float(circuit.source_voltage(at)[0]),
            temperature=temperature_after(
                self.parts.motor,
                self.settings.ambient_temperature,
                self.settings.faults.heating,
                before.temperature,
                segment,
                time,
            ),
            constant_current_since=since,
            breaking_away=outcome == "breakaway",
            field=field,
        )
