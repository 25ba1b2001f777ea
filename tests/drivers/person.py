"""Someone at the bench of a manual driver."""

from collections.abc import Sequence

from drivers.interfaces.text import Text
from drivers.manual.prompt import Option


class Person:
    """Someone who does what the text says and types what was prepared."""

    def __init__(self, *answers: float) -> None:
        self.answers = list(answers)
        self.asked: list[tuple[str, str, float, float, str]] = []
        self.told: list[str] = []

    def ask(self, quantity: Text, unit: str, minimum: float, maximum: float, context: Text | None) -> float:
        self.asked.append((str(quantity), unit, minimum, maximum, str(context or "")))
        return self.answers.pop(0)

    def choose(self, quantity: Text, options: Sequence[Option]) -> float:
        self.asked.append((str(quantity), "", options[0].number, options[-1].number, ""))
        return self.answers.pop(0)

    def confirm(self, task: Text) -> None:
        self.told.append(str(task))
