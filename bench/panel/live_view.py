"""What a run's journal says of this moment: step, connections, readings, what is energised."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from bench.drawings.layout import Layout
from bench.journal.journal import Event
from bench.journal.run_view import RunView
from bench.journal.step_readings import quantities_read
from bench.journal.stored_action import restore_action
from drivers.interfaces.text import Text
from procedures.core.actions import Action

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


class LiveView:
    """The present state that a journal's events add up to; feed it events in order.

    `run` is the run's own view. `changes` counts what was taken in, so that pages know when to look again.
    """

    def __init__(self) -> None:
        self.run = RunView()
        self.layout = Layout()
        self.action: Action | None = None
        self.action_event: Mapping[str, Any] = {}
        self.procedure = ""
        self.step = ""
        self.step_text = ""
        self.step_values: dict[str, object] = {}
        self.energised: dict[str, float] = {}
        self.readings: dict[tuple[str, str], Readings] = {}
        #: Those whose newest is the newest of all; None where the procedure has read nothing yet.
        self.latest: Readings | None = None
        self.waveforms: deque[Mapping[str, Any]] = deque(maxlen=64)
        self.made_safe: list[Mapping[str, Any]] = []
        self.instruments: dict[str, Mapping[str, Any]] = {}
        self.resumed = 0
        self.time = 0.0
        self.ended = False
        self.changes = 0

    def take(self, event: Event) -> None:
        """Take one event into account."""
        self.changes += 1
        self.time = event.time
        self.run.apply(event.kind, event.data)
        take = getattr(self, f"_{event.kind}", None)
        if take is not None:
            take(event)

    def _run_started(self, _event: Event) -> None:
        self.ended = False

    def _run_resumed(self, _event: Event) -> None:
        self.ended = False
        self.resumed += 1
        self.energised.clear()

    def _procedure_started(self, event: Event) -> None:
        self.procedure = event.data["procedure"]
        self.step, self.step_text = "", ""
        self.step_values = dict(event.data.get("values", event.data["settings"]))
        self.readings.clear()
        self.latest = None

    def _step_started(self, event: Event) -> None:
        self.step = event.data["step"]
        here = self.run.procedures.get(self.procedure)
        self.step_text = (here.sentences if here else {}).get(self.step, event.data["text"])

    def _action(self, event: Event) -> None:
        self.action_event = event.data
        try:
            self.action = restore_action(event.data)
        except ValueError:
            # Written by another version: its words are shown, and no drawing.
            self.action = None
            return
        self.layout = self.layout.after(self.action)

    def _action_done(self, _event: Event) -> None:
        self.action = None

    def _instrument_opened(self, event: Event) -> None:
        self.instruments[event.data["instrument"]] = event.data

    def _reading(self, event: Event) -> None:
        instrument, wanted = event.data["instrument"], event.data.get("arguments") or [""]
        found = []
        for quantity, unit, value in quantities_read(event.data):
            kept = self.readings.setdefault((instrument, str(quantity)), Readings(instrument, quantity, unit))
            kept.times.append(event.time)
            kept.values.append(value)
            found.append(kept)
        if found:
            # A bridge gives several at once; the one that it was asked for is what is looked at.
            self.latest = next((kept for kept in found if str(kept.quantity) == wanted[0]), found[0])

    def _waveforms(self, event: Event) -> None:
        self.waveforms.append({**event.data, "procedure": self.procedure, "step": self.step})

    def _energising(self, event: Event) -> None:
        self.energised[event.data["instrument"]] = event.time

    def _de_energised(self, event: Event) -> None:
        self.energised.pop(event.data["instrument"], None)

    def _made_safe(self, event: Event) -> None:
        self.made_safe.append(event.data)
        if event.data.get("outcome") == "safe":
            self.energised.pop(event.data.get("instrument", ""), None)

    def _run_finished(self, _event: Event) -> None:
        self.ended = True
        self.action = None
