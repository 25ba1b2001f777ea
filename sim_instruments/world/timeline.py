"""Bench time as a chain of segments, extended only when a value is read or changed."""

import math
import threading
from bisect import bisect_right
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import replace
from itertools import pairwise

import numpy as np

from sim_instruments.clock.virtual_clock import BenchClock
from sim_instruments.disturbances.bench import Contacts
from sim_instruments.physics.circuits.transient import LinearTransient
from sim_instruments.physics.circuits.windings import FloatArray, Windings
from sim_instruments.physics.field import ImpressedField
from sim_instruments.physics.mapped.windings import windings_of
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.world.clamps import warmth_after
from sim_instruments.world.constants import Constants
from sim_instruments.world.history import History, Quantity
from sim_instruments.world.machine_data import DynamometerMachine, InverterStage, Leads, SupplyStage
from sim_instruments.world.segment import FieldState, Segment, State
from sim_instruments.world.segment_choice import plan
from sim_instruments.world.settings import Snapshot, WorldSettings
from sim_instruments.world.sources.six_step_stage import SixStepStage
from sim_instruments.world.thermal import magnets_after, temperature_after
from sim_instruments.world.unmodelled import unmodelled

#: How long (s of bench time) past segments are kept.
HISTORY = 600.0
#: More segments than this without time moving on means that no law gets hold of the state.
_PATIENCE = 1000

#: The state and the settings as they were before a change.
Before = tuple[State, Snapshot]


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
        contacts: Contacts | None = None,
        clamps: tuple[float, ...] = (0.0, 0.0, 0.0),
    ) -> None:
        self.lock = threading.RLock()
        self.constants = Constants(motor, supply, dynamometer, inverter, leads, six_step, contacts or Contacts())
        self.settings = WorldSettings(ambient_temperature=ambient_temperature, exchanged=motor.exchanged, clamps=clamps)
        self._clock = clock
        self.now = clock.now()
        #: The state at the present time, None where nobody has asked for it yet.
        self._state: State | None = State(
            initial_angle,
            0.0,
            np.zeros(3),
            0.0,
            ambient_temperature,
            magnet_temperature=None if motor.magnets.time_constant is None else ambient_temperature,
        )
        self._begin = self._state
        first = plan(self.constants, self.settings, self._begin, self.now)
        # Before the first moment the bench has stood like this for ever.
        self._past: list[Segment] = [replace(first, start=-math.inf, end=self.now)]
        self._starts = [-math.inf]
        #: The present segment, None where its laws are yet to be found.
        self._present: Segment | None = first
        #: What has happened that no law follows, and when (s) it last began.
        self.unmodelled: dict[str, float] = {}
        self._observing = _Observing(self.lock, self._advance)

    @property
    def state(self) -> State:
        """The state at the present time."""
        if self._state is None:
            self._state = self._state_at(self.now, ended=False)
        return self._state

    @property
    def angle(self) -> float:
        """The shaft's angle (rad) at the present time."""
        if self._state is None:
            return float(self.present.motion.angle(np.array([self.now]))[0])
        return self._state.angle

    @property
    def speed(self) -> float:
        """The shaft's speed (rad/s) at the present time."""
        if self._state is None:
            return float(self.present.motion.speed(np.array([self.now]))[0])
        return self._state.speed

    @property
    def present(self) -> Segment:
        """The segment that lasts now."""
        if self._present is None:
            self._present = plan(self.constants, self.settings, self._begin, self.now)
            what = unmodelled(self.constants, self.settings, self._begin, self._present)
            if what is not None:
                self.unmodelled[what] = self.now
        return self._present

    def observing(self) -> AbstractContextManager[None]:
        """Hold the lock, with the bench brought to the present."""
        return self._observing

    def changing(self) -> AbstractContextManager[WorldSettings]:
        """Hold the lock, give the settings to change, and go on from the present with what they make of it.

        What is changed at one and the same time takes effect together, once somebody looks or time goes on. What is set as
        it was changes nothing.
        """
        return _Changing(self.lock, self.settings, self._before_change, self._after_change)

    def set_winding_temperature(self, temperature: float) -> None:
        """Put the winding at a temperature (°C); to be called while changing."""
        self._state = replace(self.state, temperature=temperature)

    def winding_temperature(self) -> float:
        """Return the winding's temperature (°C) now."""
        return self.state.temperature

    def windings(self) -> Windings:
        """Return the motor's windings at the present temperature."""
        state = self.state
        return windings_of(self.constants.motor, state.temperature, state.magnet_temperature)

    # The past

    def hold(self, first: float, last: float) -> History:
        """Return the past from one time (s) to another, to keep. Raises ValueError for times to come or no longer kept."""
        self._check_known(first, last)
        numbers = range(max(self._number(first), 0), self._number(last) + 1)
        return History([self._segment(number) for number in numbers], self.now)

    def sample(self, quantity: Quantity, times: FloatArray) -> FloatArray:
        """Return a quantity (shape (…, n)) at n past times (s, any order).

        Raises ValueError for times to come or no longer kept.
        """
        if not len(times):
            return np.zeros(0)
        first, last = float(times.min()), float(times.max())
        self._check_known(first, last)
        number = max(self._number(first), 0)
        if number == self._number(last):
            return quantity(self._segment(number), np.minimum(times, self.now))
        return self.hold(first, last).sample(quantity, times)

    def mean(
        self,
        quantity: Quantity,
        aperture: float,
        until: float | None = None,
        steady: Callable[[Segment], float | None] = lambda _: None,
    ) -> float:
        """Return the mean of a quantity over the `aperture` s before `until` (s; now), or its value then for 0.

        `steady` gives its value in a segment where it does not change. Raises ValueError where `until` is given and the
        aperture lies in times to come or no longer kept.
        """
        if until is not None:
            self._check_known(until - aperture, until)
        if aperture <= 0.0:
            if until is not None:
                return float(self.sample(quantity, np.array([until]))[0])
            return float(quantity(self.present, np.array([self.now]))[0])
        total = 0.0
        for segment, start, end in self.stretches(aperture, until):
            value = steady(segment)
            if value is not None:
                total += value * (end - start)
                continue
            times, weights = segment.nodes_between(start, end)
            total += float(weights @ quantity(segment, times))
        return total / aperture

    def angles(self, times: FloatArray) -> FloatArray:
        """Return the shaft's angle (rad) at past times."""
        return self.sample(lambda segment, at: segment.motion.angle(at), times)

    def turned(self, gate: float) -> float:
        """Return by how much (rad, signed) the shaft has turned in the last `gate` s."""
        begin, end = self.now - gate, self.now
        self._check_known(begin, end)
        present, earlier = self.present.motion, self._segment(max(self._number(begin), 0)).motion
        if earlier is present:
            start, stop = present.angle(np.array([begin, end])).tolist()
        else:
            start, stop = float(earlier.angle(np.array([begin]))[0]), float(present.angle(np.array([end]))[0])
        return float(stop - start)

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
        for number in range(max(self._number(begin), 0), len(self._past) + 1):
            segment = self._segment(number)
            end = min(segment.end, last)
            start = max(segment.start, begin)
            if end > start and not segment.reversals:
                yield segment, start, end
            elif end > start:
                inside = [time for time in segment.reversals if start < time < end]
                for first, second in pairwise([start, *inside, end]):
                    yield segment, first, second

    def _number(self, time: float) -> int:
        """Return the place of the segment at a time (s): from the oldest that is kept to the present one."""
        return len(self._past) if time >= self.present.start else bisect_right(self._starts, time) - 1

    def _segment(self, number: int) -> Segment:
        return self.present if number == len(self._past) else self._past[number]

    def _check_known(self, first: float, last: float) -> None:
        if last > self.now + 1e-12:
            raise ValueError(f"time {last:.9g} s is still to come; now is {self.now:.9g} s")
        if first < (self._past[0] if self._past else self.present).start:
            raise ValueError(f"time {first:.9g} s is no longer known; the bench remembers {HISTORY:g} s of its past")

    # Going on

    def _before_change(self) -> Before:
        if self._present is not None or self._clock.now() > self.now:
            self._advance()
        # The state that the old settings have led to: taken before they change.
        return self.state, self.settings.snapshot()

    def _after_change(self, before: Before) -> None:
        state, settings = before
        if self._state is not state or self.settings.snapshot() != settings:
            self._cut(self.now, self.state)

    def _advance(self) -> None:
        now, present = self._clock.now(), self._present
        if present is not None and now == self.now < present.end:
            return
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
            self.now, self._state = now, None
            old = 0
            while old < len(self._past) and self._past[old].end < now - HISTORY:
                old += 1
            if old:
                del self._past[:old], self._starts[:old]

    def _cut(self, time: float, state: State) -> None:
        """End the present segment; the next one begins."""
        ended = self._present
        if ended is not None and time > ended.start:
            self._past.append(ended if ended.end == time else replace(ended, end=time))
            self._starts.append(ended.start)
        self._begin = self._state = state
        self.now = max(self.now, time)
        self._present = None

    def _happen(self) -> None:
        """Let happen what the present segment's end brings about."""
        outcome, settings = self.present.outcome, self.settings
        if outcome in ("trip voltage", "trip current"):
            settings.supply.tripped = "voltage" if outcome == "trip voltage" else "current"
            settings.supply.on = False
        elif outcome == "let go":
            settings.shaft.holder = settings.shaft.pull_then

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
        temperature = temperature_after(
            self.constants.motor,
            self.settings.ambient_temperature,
            self.settings.faults.heating,
            before.temperature,
            segment,
            time,
        )
        return State(
            angle=float(segment.motion.angle(at)[0]),
            speed=0.0 if outcome in ("standstill", "breakaway") else float(segment.motion.speed(at)[0]),
            winding_currents=currents,
            source_voltage=float(circuit.source_voltage(at)[0]),
            temperature=temperature,
            constant_current_since=since,
            breaking_away=outcome == "breakaway",
            field=field,
            eddy_currents=circuit.eddy_currents(time) if isinstance(circuit, LinearTransient) else None,
            magnet_temperature=magnets_after(
                self.constants.motor,
                self.settings.ambient_temperature,
                (before.temperature, temperature),
                before.magnet_temperature,
                segment,
                time,
            ),
            contact_warmth=warmth_after(self.constants.contacts, before.contact_warmth, segment, time),
        )


class _Observing(AbstractContextManager[None]):
    """Holds a timeline's lock with the bench brought to the present; to be entered as often as one likes."""

    def __init__(self, lock: threading.RLock, advance: Callable[[], None]) -> None:
        self._lock = lock
        self._advance = advance

    def __enter__(self) -> None:
        self._lock.acquire()
        try:
            self._advance()
        except BaseException:
            self._lock.release()
            raise

    def __exit__(self, *_: object) -> None:
        self._lock.release()


class _Changing(AbstractContextManager[WorldSettings]):
    """Holds a timeline's lock for one change of the settings; an error in the block leaves the laws as they are."""

    def __init__(
        self, lock: threading.RLock, settings: WorldSettings, begin: Callable[[], Before], end: Callable[[Before], None]
    ) -> None:
        self._lock = lock
        self._settings = settings
        self._begin = begin
        self._end = end

    def __enter__(self) -> WorldSettings:
        self._lock.acquire()
        try:
            self._before = self._begin()
        except BaseException:
            self._lock.release()
            raise
        return self._settings

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        try:
            if kind is None:
                self._end(self._before)
        finally:
            self._lock.release()
