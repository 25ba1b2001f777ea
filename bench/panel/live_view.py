"""What a run's journal says of this moment: step, connections, readings, what is energised."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from bench.drawings.layout import Layout
from bench.record.journal import Event
from bench.record.run_view import RunView
from bench.record.stored_action import restore_action
from procedures.actions import Action

#: Readings kept for the live plot, per instrument and call.
_KEPT = 20_000


@dataclass
class Readings:
    """What one call of one instrument gave: bench times (s) and values, newest last."""

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

    @property
    def latest(self) -> tuple[tuple[str, str], float, str] | None:
        """The newest reading: instrument and call, value, unit."""
        if not self.readings:
            return None
        key = max(self.readings, key=lambda k: self.readings[k].times[-1])
        found = self.readings[key]
        return key, found.values[-1], found.unit

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
        value = event.data.get("value")
        if isinstance(value, Mapping) and isinstance(value.get("value"), int | float):
            self._keep(event, event.data["call"], float(value["value"]), str(value.get("unit", "")))
        elif isinstance(value, Mapping):
            for name, part in value.items():
                if isinstance(part, Mapping) and isinstance(part.get("value"), int | float):
                    self._keep(event, f"{event.data['call']} {name}", float(part["value"]), str(part.get("unit", "")))

    def _keep(self, event: Event, call: str, value: float, unit: str) -> None:
        kept = self.readings.setdefault((event.data["instrument"], call), Readings(unit))
        kept.times.append(event.time)
        kept.values.append(value)

    def _waveforms(self, event: Event) -> None:
        self.waveforms.append(event.data)

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
