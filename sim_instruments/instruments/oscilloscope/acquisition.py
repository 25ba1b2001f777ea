"""Acquisition of the oscilloscope: armed, triggered, recorded, in the order of virtual time."""

from collections.abc import Callable
from dataclasses import replace
from typing import Literal, Protocol

import numpy as np

from sim_instruments.disturbances.channel import CLEAR, ChannelPath
from sim_instruments.instruments.oscilloscope.arming import Setup
from sim_instruments.instruments.oscilloscope.edge import Edge, EdgeFinder
from sim_instruments.instruments.oscilloscope.record import FloatArray, Record, Signal, Vertical

#: Corner (Hz) of the input's own AC coupling.
AC_CORNER = 10.0
_AUTO_WAIT = 0.05
_REMEMBERED = 100.0
_BACKLOG = 0.25
#: Samples in which a trigger is looked for at a time, where others wait meanwhile.
_PIECE = 1 << 13


class HeldSignals(Protocol):
    """The signals of the probes over a stretch of time."""

    def signal(self, channel: int, times: FloatArray) -> FloatArray:
        """Return the true signal of a channel at times of the stretch."""


#: Keeps what the probes have sensed from one time (s) to another.
Hold = Callable[[float, float], HeldSignals]


class Acquisition:
    """The state of the acquisition; `update` carries it to the present."""

    def __init__(
        self,
        now: Callable[[], float],
        signal: Signal,
        hold: Hold,
        generator: np.random.Generator,
        time_base_error: float,
        path: Callable[[int], ChannelPath] = lambda _: CLEAR,
    ) -> None:
        self._now = now
        self._path = path
        self._signal = signal
        self._hold = hold
        self._random = generator
        self._time_base_error = time_base_error
        self._state: Literal["STOP", "SING", "RUN"] = "STOP"
        self._setup: Setup | None = None
        self._armed_at = 0.0
        self._finder: EdgeFinder | None = None
        self._triggers: list[float] = []
        self._forced = False
        self._triggered = False
        self._record: Record | None = None
        self._in_pieces = False
        self._seen: float | None = None

    @property
    def state(self) -> Literal["STOP", "SING", "RUN"]:
        """STOP, SING or RUN, now."""
        self.update()
        return self._state

    def single(self, setup: Setup) -> None:
        """Arm for one acquisition."""
        self._arm("SING", setup)

    def run(self, setup: Setup) -> None:
        """Acquire again and again."""
        self._arm("RUN", setup)

    def stop(self) -> None:
        """Stop; what a running acquisition has got last is kept."""
        self.update()
        if self._state == "RUN":
            self._latest()
        self._state, self._finder = "STOP", None

    def force(self) -> None:
        """Trigger now, whatever the signal does."""
        self._forced = True
        self.update()

    def take_trigger_event(self) -> bool:
        """Return whether there was a trigger since this was last asked."""
        self.update()
        if self._state == "RUN":
            self._latest()
        triggered, self._triggered = self._triggered, False
        return triggered

    def waiting(self) -> bool:
        """Return whether a trigger is being waited for."""
        self.update()
        if self._setup is None or self._state == "STOP":
            return False
        return len(self._triggers) < self._setup.averages and self.eligible()

    def eligible(self) -> bool:
        """Return whether the part of the record before the trigger is filled."""
        return self._setup is not None and self._now() >= self._armed_at + self._setup.before

    def next_look(self) -> float | None:
        """Return when to look again whether a single acquisition is done; None: it is."""
        self.update()
        if self._state != "SING" or self._setup is None:
            return None
        setup, now = self._setup, self._now()
        if len(self._triggers) >= setup.averages:
            return self._triggers[-1] + setup.after
        return max(self._eligible(), now + min(max(setup.after / 8.0, 2.0e-4), 0.02))

    def record(self) -> Record | None:
        """Return the last complete record."""
        self.update()
        if self._state == "RUN":
            self._latest()
        return self._record

    def on_advance(self, time: float) -> None:
        """Keep up with time, so that nothing is looked for in a past that is forgotten."""
        looked = self._armed_at if self._finder is None else self._finder.searched
        in_pieces = self._in_pieces and self._finder is not None
        if self._state == "SING" and not in_pieces and time - looked > _BACKLOG:
            self.update()

    def catch_up(self) -> bool:
        """Look for triggers a little further; return whether there is more to look through.

        What goes on so need not be done all at once when time goes on. A past that is forgotten before it is reached is left out.
        """
        self._in_pieces = True
        setup, finder = self._setup, self._finder
        if setup is None or finder is None:
            return False
        if self._state == "RUN" and not setup.automatic:
            end = self._now() - setup.after
        elif self._state == "SING" and len(self._triggers) < setup.averages:
            end = self._now()
        else:
            return False
        if end - finder.searched > _REMEMBERED:
            self._finder = self._new_finder(setup, end)
            return False
        reached = finder.searched + _PIECE * setup.search_step
        if reached >= end:
            return False
        if self._state == "RUN":
            self._look_back(reached)
        else:
            self._look(reached)
        return True

    def update(self) -> None:
        """Look for triggers up to now and finish a single acquisition that has ended."""
        self._look(self._now())

    def _look(self, now: float) -> None:
        setup = self._setup
        if self._state != "SING" or setup is None:
            return
        while len(self._triggers) < setup.averages:
            trigger = self._find(setup, now)
            if trigger is None:
                return
            self._triggers.append(trigger)
            self._triggered = True
        if now >= self._triggers[-1] + setup.after:
            self._record = self._make(setup, tuple(self._triggers))
            self._state, self._finder = "STOP", None

    def _arm(self, state: Literal["SING", "RUN"], setup: Setup) -> None:
        self._state, self._setup = state, setup
        self._armed_at = self._now()
        self._triggers, self._forced, self._triggered, self._seen = [], False, False, None
        self._finder = self._new_finder(setup, self._armed_at)

    def _new_finder(self, setup: Setup, start: float) -> EdgeFinder | None:
        source, channel = setup.source, setup.source_channel
        if source is None:
            return None
        noise = float(self._random.normal(0.0, source.noise))
        path = self._path(channel)

        def seen(times: FloatArray) -> FloatArray:
            signal = self._signal(channel, times)
            return source.displayed(signal if path.clear else path.triggering(signal, times))

        filtered = setup.trigger_path

        def passed(times: FloatArray) -> FloatArray:
            return filtered.shown(seen, times)

        edge = Edge(setup.edge.level + noise, setup.edge.slope, setup.edge.hysteresis)
        return EdgeFinder(seen if filtered.clear else passed, edge, start, setup.search_step)

    def _eligible(self) -> float:
        setup = self._setup
        assert setup is not None  # noqa: S101  (only asked while armed)
        if self._triggers:
            return self._triggers[-1] + max(setup.after + setup.before, setup.holdoff)
        return self._armed_at + setup.before

    def _find(self, setup: Setup, now: float) -> float | None:
        eligible = self._eligible()
        if self._forced and now >= eligible:
            self._forced = False
            return now
        limit = min(now, eligible + _AUTO_WAIT) if setup.automatic else now
        if self._finder is not None:
            if now - self._finder.searched > _REMEMBERED:
                self._finder = self._new_finder(setup, now - _REMEMBERED)
            assert self._finder is not None  # noqa: S101  (a source that was there stays there)
            result = self._finder.first(limit, eligible)
            if result is not None:
                return result
        if setup.automatic and now >= eligible + _AUTO_WAIT:
            return eligible + _AUTO_WAIT
        return None

    def _latest(self) -> None:
        """Find the last complete record of a running acquisition."""
        setup, now = self._setup, self._now()
        if setup is None:
            return
        end, start = now - setup.after, self._armed_at + setup.before
        if end < start:
            return
        if self._in_pieces and not setup.automatic:
            self._look_back(end)
            if self._seen is not None and self._seen >= start:
                self._record, self._seen = self._make(setup, (self._seen,)), None
                self._triggered = True
            return
        window = max(2.0 * setup.span, 2.0 * _AUTO_WAIT)
        while True:
            begin = max(start, end - window)
            finder = self._new_finder(setup, begin)
            trigger = None if finder is None else finder.last(end)
            if trigger is not None or begin <= start or setup.automatic or window > _REMEMBERED:
                break
            window = min(8.0 * window, 2.0 * _REMEMBERED)
        if trigger is None and setup.automatic and end >= start + _AUTO_WAIT:
            trigger = end
        if trigger is not None:
            self._record = self._make(setup, (trigger,))
            self._triggered = True

    def _look_back(self, end: float) -> None:
        """Keep the last trigger of a running acquisition up to a time (s), from where it was looked for last."""
        if self._finder is not None and (found := self._finder.last(end)) is not None:
            self._seen = found

    def _make(self, setup: Setup, triggers: tuple[float, ...]) -> Record:
        seed = (int(self._random.integers(1 << 62)),)
        stretch = 1.0 + self._time_base_error
        begin = min(triggers) + setup.origin * stretch
        end = max(triggers) + (setup.origin + setup.span) * stretch
        paths = {channel: self._input(channel, vertical) for channel, vertical in setup.verticals.items()}
        earlier = max(path.memory for path in paths.values())
        held = self._hold(min(begin - earlier, self._now()), min(end, self._now()))

        def signal(channel: int, times: FloatArray) -> FloatArray:
            path = paths[channel]
            if path.clear:
                return held.signal(channel, times)
            return path.shown(lambda at: held.signal(channel, at), times)

        return Record(
            triggers,
            setup.origin,
            setup.span,
            setup.available,
            setup.verticals,
            seed,
            self._time_base_error,
            signal,
            not all(path.clear for path in paths.values()),
        )

    def _input(self, channel: int, vertical: Vertical) -> ChannelPath:
        """Return what lies before the converter, the input's own coupling with it."""
        path = self._path(channel)
        if vertical.skew:
            path = replace(path, skew=path.skew + vertical.skew)
        if not vertical.ac_coupled:
            return path
        return replace(path, coupling_corner=max(path.coupling_corner, AC_CORNER))
