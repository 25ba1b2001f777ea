"""The reading that a person types next, the text typed, and its corrections: for the question's words, and for the journal."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import Protocol

from bench.i18n.language import LANGUAGES, translator
from bench.journal.events.run import RunBegun
from bench.operators.typed import narrow, typed_number
from drivers.interfaces.text import Text, text
from drivers.manual.prompt import Option
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
from procedures.core.procedure_error import CorrectedError, RepeatRequestedError
from procedures.core.short_number import short


@dataclass(frozen=True)
class TypedReading:
    """A number that was typed and counts: what was asked (with its place), in `unit` within `minimum` … `maximum`, or among `options`."""

    number: int
    asked: Text
    unit: str
    minimum: float
    maximum: float
    value: float
    #: How many were asked for in the same words before.
    earlier: int = 0
    options: tuple[Option, ...] = ()

    @property
    def name(self) -> Text:
        """The reading's name among the others."""
        return text("{quantity}, read again", quantity=self.asked) if self.earlier else self.asked

    @property
    def recorded(self) -> str:
        """The question as the journal has it: a chosen number means nothing without its options."""
        return recorded(self.asked, self.options)


class Corrections(Protocol):
    """The typed readings of the running procedure, and their correction."""

    def readings(self) -> Sequence[TypedReading]:
        """Return what was typed in it and counts, oldest first."""

    def correct(self, reading: TypedReading, value: float, typed: str, by: str) -> Text | None:
        """Replace a reading by a corrected value and record it in the journal; return why that is not possible, or None."""


class TypedEntry:
    """The place of a person's entry among repeated readings, by the journal's events.

    `recorder` keeps what is typed, once there is one. `corrections` is what earlier readings are corrected in, where that is possible.
    """

    def __init__(self) -> None:
        self.recorder: Recorder | None = None
        self.corrections: Corrections | None = None
        #: What was typed for the call of an instrument that is going on.
        self.taken: list[TypedReading] = []
        #: Values of the next questions, which nobody is asked any more.
        self.preset: list[float] = []
        self._repeat: RepeatStarted | None = None
        self._numbers = count(1)
        self._person = ""

    def hear(self, event: Event) -> None:
        """Take an event of the journal."""
        match event:
            case RunBegun():
                self._person = event.person
            case RepeatStarted():
                self._repeat = event
            case RepeatsTaken() | StepStarted() | StepFinished() | StepFailed():
                self._repeat = None

    @property
    def readings(self) -> Sequence[TypedReading]:
        """The readings that can be corrected, oldest first."""
        asked = Counter[str]()
        result = []
        for reading in self.corrections.readings() if self.corrections else ():
            result.append(replace(reading, earlier=asked[str(reading.asked)]))
            asked[str(reading.asked)] += 1
        return result

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

    def known(
        self, quantity: Text, unit: str, minimum: float, maximum: float, options: Sequence[Option] = ()
    ) -> float | None:
        """Return the value of a question that was answered already, None where a person is to be asked."""
        if not self.preset:
            return None
        return self._take(quantity, unit, minimum, maximum, options, self.preset.pop(0))

    def typed(
        self,
        quantity: Text,
        unit: str,
        minimum: float,
        maximum: float,
        typed: str,
        value: float | None,
        refused: Text | None = None,
        options: Sequence[Option] = (),
    ) -> None:
        """Put into the journal what was typed, and the value that was taken of it."""
        if self.recorder is not None:
            why = "" if refused is None else refused.render()
            asked = recorded(quantity, options)
            event = ReadingTyped(quantity=asked, unit=unit, typed=typed, value=value, refused=why)
            self.recorder.record(event)
        if value is not None:
            self._take(quantity, unit, minimum, maximum, options, value)

    def checked(self, number: int, typed: str) -> tuple[TypedReading, float]:
        """Return the reading of this number and the value typed for it. Raises ValueError with a Text for what it cannot be."""
        reading = next((one for one in self.readings if one.number == number), None)
        if reading is None:
            raise ValueError(text("this reading is no longer used"))
        value = checked_number(typed, reading.unit, reading.minimum, reading.maximum, reading.options)
        if value == reading.value:
            raise ValueError(text("this value is already in use"))
        return reading, value

    def correct(self, reading: TypedReading, value: float, typed: str, by: str = "") -> Text:
        """Correct a reading for a person: raises CorrectedError, or returns why it cannot be corrected."""
        if self.corrections is None:
            return text("nothing can be corrected here")
        fault = self.corrections.correct(reading, value, typed, by or self._person)
        if fault is not None:
            return fault
        raise CorrectedError

    def repeat(self, by: str = "") -> None:
        """Raise RepeatRequestedError: somebody wants the procedure from its beginning."""
        person = by or self._person or text("the person at the bench")
        raise RepeatRequestedError(text("{person} wants to repeat the procedure from its beginning", person=person))

    def _take(
        self, quantity: Text, unit: str, minimum: float, maximum: float, options: Sequence[Option], value: float
    ) -> float:
        number = next(self._numbers)
        self.taken.append(TypedReading(number, quantity, unit, minimum, maximum, value, options=tuple(options)))
        return value


def checked_number(typed: str, unit: str, minimum: float, maximum: float, options: Sequence[Option] = ()) -> float:
    """Return the number typed, in `unit` and within its range, or of one of the `options`. Raises ValueError with a Text for any other."""
    if options:
        return chosen_option(typed, options)
    return within(typed_number(typed, unit), unit, minimum, maximum)


def chosen_option(typed: str, options: Sequence[Option]) -> float:
    """Return the number of the option that was typed by its number, its sign, its name in any language, or all of these as they are shown.

    Raises ValueError for any other.
    """
    words = _comparable(typed)
    for option in options:
        if words and words in _names(option):
            return float(option.number)
        if words.isascii() and words.isdecimal() and int(words) == option.number:
            return float(option.number)
    if not words:
        raise ValueError(text("Choose one of the answers first."))
    raise ValueError(
        text(
            "'{typed}' is not one of the answers; choose from {allowed}",
            typed=typed.strip(),
            allowed=[*map(told, options)],
        )
    )


def _names(option: Option) -> set[str]:
    """Return in which words an option may be typed."""
    words = (option.name, text("{name} ({sign})", name=option.name, sign=option.sign), told(option))
    return {_comparable(word.render(translator(language))) for word in words for language in LANGUAGES} | {
        _comparable(option.sign)
    }


def _comparable(words: str) -> str:
    return "".join(narrow(words).casefold().split())


def told(option: Option) -> Text:
    """Return an option in words: its number, its name, its sign."""
    name = text("{name} ({sign})", name=option.name, sign=option.sign) if option.sign else option.name
    # Digits that are their own name are not said twice.
    if str(name).isdecimal() and int(str(name)) == option.number:
        return name
    return Text("{number} {name}", {"number": option.number, "name": name})


def recorded(quantity: Text, options: Sequence[Option]) -> str:
    """Return what was asked in English, with what there was to choose from."""
    asked = text("{quantity}: {options}", quantity=quantity, options=[*map(told, options)]) if options else quantity
    return asked.render()


def within(value: float, unit: str, minimum: float, maximum: float) -> float:
    """Return a value that lies within its range. Raises ValueError for any other."""
    if not minimum <= value <= maximum:
        raise ValueError(
            text(
                "{value} is outside {minimum} … {maximum} {unit}; read again",
                value=short(value, unit),
                unit=unit,
                minimum=short(minimum),
                maximum=short(maximum),
            )
        )
    # What has no unit is counted, or chosen from a list.
    if not unit and not value.is_integer():
        raise ValueError(text("{value:g} is not a whole number; read again", value=value))
    return value
