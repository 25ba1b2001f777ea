"""Which reading a person is about to type, and what was typed: for the question's words, and for the journal."""

from drivers.interfaces.text import Text, text
from procedures.core.bench import Recorder
from procedures.core.events import (
    Event,
    ReadingTyped,
    RepeatsTaken,
    RepeatStarted,
    StepFailed,
    StepFinished,
    StepStarted,
)


class TypedEntry:
    """Where a person is among repeated readings, by the journal's events; `recorder` keeps what is typed, once there is one."""

    def __init__(self) -> None:
        self.recorder: Recorder | None = None
        self._repeat: RepeatStarted | None = None

    def hear(self, event: Event) -> None:
        """Take an event of the journal."""
        match event:
            case RepeatStarted():
                self._repeat = event
            case RepeatsTaken() | StepStarted() | StepFinished() | StepFailed():
                self._repeat = None

    @property
    def has_before(self) -> bool:
        """Whether there is an entry before this one that can be typed again."""
        return self._repeat is not None and self._repeat.number > 1 and not self._repeat.again

    def placed(self, quantity: Text) -> Text:
        """Return what is asked with the terminals, and the number of the reading where there are several."""
        at = self._repeat
        if at is None:
            return quantity
        values: dict[str, object] = {"quantity": quantity, "terminals": at.terminals}
        if at.count == 1:
            return text("{quantity}, {terminals}", **values)
        values |= {"number": at.number, "count": at.count}
        return text("{quantity}, {terminals}, reading {number} of {count}", **values)

    def typed(self, quantity: Text, unit: str, typed: str, value: float | None, refused: Text | None = None) -> None:
        """Put into the journal what was typed, and the value that was taken of it."""
        if self.recorder is not None:
            why = "" if refused is None else refused.render()
            event = ReadingTyped(quantity=quantity.render(), unit=unit, typed=typed, value=value, refused=why)
            self.recorder.record(event)


def within(value: float, unit: str, minimum: float, maximum: float) -> float:
    """Return a value that lies within its range. Raises ValueError for any other."""
    if not minimum <= value <= maximum:
        raise ValueError(
            text(
                "{value:g} {unit} is outside {minimum:g} … {maximum:g} {unit}; read again",
                value=value,
                unit=unit,
                minimum=minimum,
                maximum=maximum,
            )
        )
    return value
