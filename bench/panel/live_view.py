"""What a run's journal says of this moment: step, connections, readings, what is energised."""

from collections import deque
from dataclasses import dataclass, field

from bench.drawings.layout import Layout
from bench.journal.codec import RecordedEvent, UnknownEvent
from bench.journal.events.instruments import DeEnergised, Energising, InstrumentOpened, ReadingTaken, WaveformsTaken
from bench.journal.events.run import ProcedureStarted, RunFinished, RunResumed, RunStarted
from bench.journal.events.safety import MadeSafe, ShutdownStarted
from bench.journal.run_view import RunView
from bench.journal.step_readings import quantities_read
from drivers.interfaces.text import Text
from procedures.core.actions import Action
from procedures.core.events import (
    ActionDone,
    ActionStarted,
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
class WaveformRecord:
    """A record of waveforms, and the procedure and step in which it was taken."""

    taken: WaveformsTaken
    procedure: str
    step: str


@dataclass(frozen=True)
class TypedPlace:
    """What a typed number is: the quantity as it was asked, in English and without its place, and that place."""

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
        self.readings: dict[tuple[str, str], Readings] = {}
        #: Those whose newest is the newest of all; None where the procedure has read nothing yet.
        self.latest: Readings | None = None
        self.waveforms: deque[WaveformRecord] = deque(maxlen=64)
        #: The newest outcome of each item of the shutdown, by instrument and item.
        self.made_safe: dict[tuple[str, str], MadeSafe] = {}
        #: Why the run switches everything off now; None where it does not.
        self.going_down: str | None = None
        #: What was typed in this procedure and taken, oldest first; an entry typed again stands in its place.
        self.typed: dict[TypedPlace, float] = {}
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
                self.latest = None
                self.typed.clear()
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
                self._reading(event)
            case WaveformsTaken():
                self.waveforms.append(WaveformRecord(event, self.procedure, self.step))
            case RepeatStarted():
                self.repeat = event
            case RepeatsTaken():
                self.repeat = None
            case ReadingTyped():
                self._typed(event)
            case ShutdownStarted():
                self.going_down = event.cause
                self.made_safe.clear()
            case Energising():
                self.energised[event.instrument] = self.time
            case DeEnergised():
                self.energised.pop(event.instrument, None)
            case MadeSafe():
                self.made_safe[event.instrument, event.item] = event
                if event.outcome == "safe":
                    self.energised.pop(event.instrument, None)
            case RunFinished():
                self.ended = True
                self.going_down = None
                self.action = self.before = None

    def _typed(self, event: ReadingTyped) -> None:
        if event.value is None:
            return
        at = self.repeat
        terminals, number = (at.terminals, at.number) if at else ("", 0)
        self.typed[TypedPlace(event.quantity.partition(f", {terminals}")[0], event.unit, terminals, number)] = (
            event.value
        )

    def _reading(self, event: ReadingTaken) -> None:
        changed = []
        for quantity, unit, value in quantities_read(event):
            kept = self.readings.setdefault(
                (event.instrument, str(quantity)), Readings(event.instrument, quantity, unit)
            )
            kept.times.append(self.time)
            kept.values.append(value)
            changed.append(kept)
        if changed:
            # A bridge gives several at once; the one that it was asked for is what is looked at.
            wanted = event.arguments[0] if event.arguments else ""
            self.latest = next((kept for kept in changed if str(kept.quantity) == wanted), changed[0])
