"""Someone at the bench of a manual driver."""


class Person:
    """Someone who does what the text says and types what was prepared."""

    def __init__(self, *answers: float) -> None:
        self.answers = list(answers)
        self.asked: list[tuple[str, str, float, float, str]] = []
        self.told: list[str] = []

    def ask(self, quantity: str, unit: str, minimum: float, maximum: float, context: str) -> float:
        self.asked.append((quantity, unit, minimum, maximum, context))
        return self.answers.pop(0)

    def confirm(self, text: str) -> None:
        self.told.append(text)
