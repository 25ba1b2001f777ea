"""A manual driver's questions to a person, and the checks on what is typed."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from drivers.interfaces import Accuracy, MeasurementError
from drivers.interfaces.text import Text, lines, text

#: How often an unusable answer is asked again.
ATTEMPTS = 3


@dataclass(frozen=True)
class Option:
    """One of a question's fixed answers: the number that stands for it, its name, and the sign that the instrument shows, if it has one."""

    number: int
    name: Text
    sign: str = ""


class Prompt(Protocol):
    """A way to reach the person at the bench. A person who gives up makes either method raise."""

    def ask(self, quantity: Text, unit: str, minimum: float, maximum: float, context: Text | None) -> float:
        """Return the number typed for a quantity in `unit`, which should be within `minimum` … `maximum`."""

    def choose(self, quantity: Text, options: Sequence[Option]) -> float:
        """Return the number of the answer chosen among a question's options."""

    def confirm(self, task: Text) -> None:
        """Return once the person says that what the task asks for is done."""


class Questions:
    """Questions about one instrument, each asked until the answer is a number within its range."""

    def __init__(self, prompt: Prompt, instrument: str) -> None:
        self.instrument = instrument
        self._prompt = prompt

    def ask(self, quantity: Text, unit: str, minimum: float, maximum: float, context: Text | None = None) -> float:
        """Return the answer, finite and within its range.

        Raises MeasurementError naming the range after three unusable answers.
        """
        hint = context
        for _ in range(ATTEMPTS):
            value = self._prompt.ask(quantity, unit, minimum, maximum, hint)
            if math.isfinite(value) and minimum <= value <= maximum:
                return value
            outside = text(
                "({value:g} {unit} is outside {minimum:g} … {maximum:g} {unit})",
                value=value,
                unit=unit,
                minimum=minimum,
                maximum=maximum,
            )
            hint = outside if context is None else lines((context, outside), " ")
        raise MeasurementError(
            self.instrument,
            text(
                "{quantity}: the value typed is outside {minimum:g} … {maximum:g} {unit}",
                quantity=quantity,
                minimum=minimum,
                maximum=maximum,
                unit=unit,
            ),
        )

    def choose(self, quantity: Text, options: Sequence[Option]) -> int:
        """Return the number of one of the options. Raises MeasurementError, naming them, after three answers that are none of them."""
        numbers = [option.number for option in options]
        for _ in range(ATTEMPTS):
            value = self._prompt.choose(quantity, options)
            if value in numbers:
                return int(value)
        raise MeasurementError(
            self.instrument,
            text(
                "{quantity}: {value:g} is not one of the answers {allowed}",
                quantity=quantity,
                value=value,
                allowed=numbers,
            ),
        )

    def confirm(self, task: Text) -> None:
        """Let the person do a task."""
        self._prompt.confirm(task)

    def stated(self, accuracy: Accuracy | None, quantity: Text) -> Accuracy:
        """Return the accuracy the station file states; raises MeasurementError where it states none."""
        if accuracy is None:
            raise MeasurementError(
                self.instrument,
                text("no accuracy is stated for its {quantity}", quantity=quantity),
                remedy=text("Enter it in the station file, from the instrument's manual"),
            )
        return accuracy
