"""Questions to a person for instruments that are set and read by hand."""

from collections.abc import Sequence
from typing import Protocol

from bench.operators.entry import TypedEntry
from drivers.interfaces.text import Text, text
from drivers.manual.prompt import Option
from reports.labels import role_name


class PersonAsked(Protocol):
    """The operator who is a person, at a terminal or at a panel."""

    entry: TypedEntry

    def number(self, quantity: Text, unit: str, minimum: float, maximum: float) -> float:
        """Ask for a number within a range."""

    def choice(self, quantity: Text, options: Sequence[Option]) -> float:
        """Ask for one of the options; return its number."""

    def confirm(self, instrument: str, task: Text) -> None:
        """Ask for a task on the instrument of a role."""


class PersonPrompt:
    """Questions to the person who operates the run; `instrument` is the role."""

    def __init__(self, operator: PersonAsked, instrument: str) -> None:
        self._operator = operator
        self._instrument = instrument

    def ask(self, quantity: Text, unit: str, minimum: float, maximum: float, context: Text | None) -> float:
        """Return the number given, within its range."""
        return self._operator.number(self._placed(quantity, context), unit, minimum, maximum)

    def choose(self, quantity: Text, options: Sequence[Option]) -> float:
        """Return the number of the option chosen."""
        return self._operator.choice(self._placed(quantity, None), options)

    def confirm(self, task: Text) -> None:
        """Return once the person says that it is done."""
        self._operator.confirm(self._instrument, task)

    def _placed(self, quantity: Text, context: Text | None) -> Text:
        """Return what is asked for, with the instrument's role and the place among repeated readings."""
        values: dict[str, object] = {"instrument": role_name(self._instrument), "quantity": quantity}
        if context is None:
            return self._operator.entry.placed(text("{instrument}, {quantity}", **values))
        return self._operator.entry.placed(text("{instrument}, {quantity} {context}", **values, context=context))
