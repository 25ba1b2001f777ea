"""The present state by a run's journal: step, connections, readings, energised sources."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from bench.drawings.layout import Layout
from bench.journal.codec import RecordedEvent, UnknownEvent
from bench.journal.events.instruments import (
    Commanding,
    DeEnergised,
    Energised,
    Energising,
    InstrumentCall,
    InstrumentOpened,
    ReadingTaken,
    SettingDone,
    WaveformsTaken,
)
from bench.journal.events.run import ProcedureStarted, RunFinished, RunResumed, RunStarted
from bench.journal.events.safety import MadeSafe, ShutdownStarted
from bench.journal.run_view import RunView
from bench.journal.step_readings import quantities_read, set_points
from drivers.interfaces import Regulated
from drivers.interfaces.text import Text
from procedures.core.actions import Action
from procedures.core.events import (
    ActionDone,
    ActionStarted,
    ReadingCorrected,
    ReadingTyped,
    RepeatsTaken,
    RepeatStarted,
    StepStarted,
    UnknownAction,
)

#: Readings kept for the live plot, per instrument and quantity.
_KEPT = 20_000


@dataclass
class Readings:
    """Readings of one quantity by one instrument: bench times (s) and values, newest last."""

    instrument: str
    quantity: Text
    unit: str
    times: deque[float] = field(default_factory=lambda: deque(maxlen=_KEPT))
    values: deque[float] = field(default_factory=lambda: deque(maxlen=_KEPT))


@dataclass(frozen=True)
class WantedValue:
    """A value that an instrument was asked to bring about at a bench time (s); `pending` until that is done."""

    instrument: str
    quantity: Text
    unit: str
    value: float
    time: float
    pending: bool = True


@dataclass(frozen=True)
class WaveformRecord:
    """A record of waveforms, and the procedure and step in which it was taken."""

    taken: WaveformsTaken
    procedure: str
    step: str


@dataclass(frozen=True)
class TypedPlace:
    """The identity of a typed number: the quantity as it was asked, in English and without its place, and that place."""

    quantity: str
    unit: str
    terminals: str
    number: int


class LiveView:
    """The present state that a journal's events add up to; feed it events in order.

    `run` is the run's own view. `changes` counts what was taken in, so that pages know when to look again.
    """

    def __init__(self) -> None:
        self.run = RunView()
        self.layout = Layout()
        #: What was connected before the present action; None while nothing is to be done.
        self.before: Layout | None = None
        self.action: Action | None = None
        self.procedure = ""
        self.step = ""
        self.step_text = ""
        self.step_values: dict[str, object] = {}
        self.energised: dict[str, float] = {}
        #: What the newest call that sets something asked for, by unit.
        self.set_points: dict[str, WantedValue] = {}
        #: Whether something was switched off since the latest reading: it is no longer so.
        self.outdated = False
        self.readings: dict[tuple[str, str], Readings] = {}
        #: Those whose newest is the newest of all; None where the procedure has read nothing yet.
        self.latest: Readings | None = None
        #: When the newest of all was recorded (ISO 8601, UTC).
        self.latest_wall = ""
        self.waveforms: deque[WaveformRecord] = deque(maxlen=64)
        #: The newest outcome of each item of the shutdown, by instrument and item.
        self.made_safe: dict[tuple[str, str], MadeSafe] = {}
        #: Why the run switches everything off now; None where it does not.
        self.going_down: str | None = None
        #: What was typed in this procedure and taken, oldest first; an entry typed again stands in its place.
        self.typed: dict[TypedPlace, float] = {}
        self._asked: dict[str, TypedPlace] = {}
        self.repeat: RepeatStarted | None = None
        self.instruments: dict[str, InstrumentOpened] = {}
        self.resumed = 0
        self.time = 0.0
        self.ended = False
        self.changes = 0

    def take(self, recorded: RecordedEvent) -> None:
        """Take one event into account."""
        self.changes += 1
        self.time = recorded.time
        event = recorded.event
        if isinstance(event, UnknownEvent):
            return
        self.run.apply(event)
        match event:
            case RunStarted():
                self.ended = False
            case RunResumed():
                self.ended = False
                self.going_down = None
                self.resumed += 1
                self.energised.clear()
            case ProcedureStarted():
                self.procedure, self.step, self.step_text = event.procedure, "", ""
                self.step_values = dict(event.settings if event.values is None else event.values)
                self.readings.clear()
                self.set_points.clear()
                self.latest = None
                self.typed.clear()
                self._asked.clear()
                self.repeat = None
            case StepStarted():
                self.step = event.step
                here = self.run.procedures.get(self.procedure)
                self.step_text = (here.sentences if here else {}).get(self.step, event.text)
            case ActionStarted():
                # The words of another version's are shown, and no drawing.
                self.action = None if isinstance(event.details, UnknownAction) else event.details
                self.before = self.layout
                self.layout = self.layout.after(self.action) if self.action else self.layout
            case ActionDone():
                self.action = self.before = None
            case InstrumentOpened():
                self.instruments[event.instrument] = event
            case ReadingTaken():
                self._reading(event, recorded.wall)
            case WaveformsTaken():
                self.waveforms.append(WaveformRecord(event, self.procedure, self.step))
            case RepeatStarted():
                self.repeat = event
            case RepeatsTaken():
                self.repeat = None
            case ReadingTyped():
                self._typed(event)
            case ReadingCorrected():
                place = self._asked.get(event.quantity)
                # Of two groups of the same words, the later one is shown.
                if place is not None and self.typed[place] == event.was:
                    self.typed[place] = event.value
                for (instrument, _), kept in self.readings.items():
                    if instrument == event.instrument and kept.unit == event.unit and event.was in kept.values:
                        kept.values[kept.values.index(event.was)] = event.value
            case ShutdownStarted():
                self.going_down = event.cause
                self.made_safe.clear()
            case Energising():
                self.energised[event.instrument] = self.time
                self._set(event)
            case Commanding():
                self._set(event)
            case Energised() | SettingDone():
                for unit, point in self.set_points.items():
                    self.set_points[unit] = replace(point, pending=False)
            case DeEnergised():
                self.energised.pop(event.instrument, None)
                self.set_points.clear()
                self.outdated = True
            case MadeSafe():
                self.made_safe[event.instrument, event.item] = event
                if event.outcome == "safe":
                    self.energised.pop(event.instrument, None)
                    self.outdated = True
            case RunFinished():
                self.ended = True
                self.going_down = None
                self.action = self.before = None

    def _set(self, event: InstrumentCall) -> None:
        points = {
            unit: WantedValue(event.instrument, quantity, unit, value, self.time)
            for quantity, unit, value in set_points(event)
        }
        if (event.instrument, event.call) == ("supply", "energised"):
            # The other one of the two is a limit, which is not to be reached.
            by_current = Regulated.CURRENT.value in (*event.arguments[2:], *event.named.values())
            points = {unit: point for unit, point in points.items() if (unit == "A") is by_current}
        if points:
            self.set_points = points

    def _typed(self, event: ReadingTyped) -> None:
        if event.value is None:
            return
        at = self.repeat
        terminals, number = (at.terminals, at.number) if at else ("", 0)
        place = TypedPlace(event.quantity.partition(f", {terminals}")[0], event.unit, terminals, number)
        self.typed[place] = event.value
        self._asked[event.quantity] = place

    def _reading(self, event: ReadingTaken, wall: str) -> None:
        changed = []
        for quantity, unit, value in quantities_read(event):
            kept = self.readings.setdefault(
                (event.instrument, str(quantity)), Readings(event.instrument, quantity, unit)
            )
            kept.times.append(_time_of(event, self.time))
            kept.values.append(value)
            changed.append(kept)
        if changed:
            self.outdated, self.latest_wall = False, wall
            # A bridge gives several at once; the one that it was asked for is what is looked at.
            wanted = event.arguments[0] if event.arguments else ""
            self.latest = next((kept for kept in changed if str(kept.quantity) == wanted), changed[0])


def _time_of(event: ReadingTaken, recorded: float) -> float:
    """Return when a reading was taken (s, bench time), where it says so; else when it was recorded."""
    taken = event.value.get("time") if isinstance(event.value, Mapping) else None
    return float(taken) if isinstance(taken, int | float) else recorded
