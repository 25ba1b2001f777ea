"""What a manual driver needs of a person, and the checks on what is typed."""

import math
from typing import Protocol

from drivers.interfaces import Accuracy, MeasurementError

#: How often an unusable answer is asked again.
ATTEMPTS = 3


class Prompt(Protocol):
    """A way to reach the person at the bench. A person who gives up makes either method raise."""

    def ask(self, quantity: str, unit: str, minimum: float, maximum: float, context: str) -> float:
        """Return the number typed for a quantity in `unit`, which should be within `minimum` … `maximum`."""

    def confirm(self, text: str) -> None:
        """Return once the person says that what the text asks for is done."""


class Questions:
    """Questions about one instrument, each asked until the answer is a number within its range."""

    def __init__(self, prompt: Prompt, instrument: str) -> None:
        self.instrument = instrument
        self._prompt = prompt

    def ask(self, quantity: str, unit: str, minimum: float, maximum: float, context: str = "") -> float:
        """Return the answer, finite and within its range.

        Raises MeasurementError naming the range after three unusable answers.
        """
        hint = context
        for _ in range(ATTEMPTS):
            value = self._prompt.ask(quantity, unit, minimum, maximum, hint)
            if math.isfinite(value) and minimum <= value <= maximum:
                return value
            hint = f"{context} ({value:g} {unit} is outside {minimum:g} … {maximum:g} {unit})".strip()
        raise MeasurementError(
            self.instrument, f"{quantity}: the value typed is outside {minimum:g} … {maximum:g} {unit}"
        )

    def confirm(self, text: str) -> None:
        """Have the person do what the text says."""
        self._prompt.confirm(text)

    def stated(self, accuracy: Accuracy | None, quantity: str) -> Accuracy:
        """Return the accuracy the station file states; raises MeasurementError where it states none."""
        if accuracy is None:
            raise MeasurementError(
                self.instrument,
                f"no accuracy is stated for its {quantity}",
                remedy="Enter it in the station file, from the instrument's manual",
            )
        return accuracy
