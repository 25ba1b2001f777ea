"""Base of every instrument that a person works: someone to ask, the options of the station file, and no connection."""

from typing import Generic, Protocol, TypeVar

from drivers.bases.set_points import check_setpoint
from drivers.interfaces import Accuracy, Clock, Identity, Reading
from drivers.interfaces.declarations import declarations
from drivers.interfaces.text import Text
from drivers.manual.prompt import Prompt, Questions


class NamesModel(Protocol):
    """Options that name the instrument's model."""

    @property
    def model(self) -> str:
        """The model the station file names."""


OptionsT = TypeVar("OptionsT", bound=NamesModel)


class InstrumentByHand(Generic[OptionsT]):
    """An instrument that a person sets and reads; `name` stands for it in messages."""

    def __init__(self, prompt: Prompt, clock: Clock, options: OptionsT, name: str) -> None:
        self._questions = Questions(prompt, name)
        self._clock = clock
        self._options = options
        self._name = name
        #: Whether a person has said that it is off, and has not been asked to switch it on since.
        self._is_off = False

    @property
    def identity(self) -> Identity:
        """The model the station file names."""
        return Identity("", self._options.model)

    @property
    def read_by_hand(self) -> bool:
        """Always so."""
        return True

    def close(self) -> None:
        """Do nothing: there is no connection."""

    def _have_on(self, task: Text) -> None:
        """Let the person do a task after which the instrument is on."""
        self._is_off = False
        self._questions.confirm(task)

    def _have_off(self, task: Text) -> None:
        """Let the person switch it off, unless it was said already that it is."""
        if not self._is_off:
            self._questions.confirm(task)
            self._is_off = True

    def _check(self, method: str, *values: float) -> None:
        """Raise SetpointError, before anything is asked, for a value beyond the station's limit, as the interface declares."""
        kind: type = type(self)
        for amount, value in zip(declarations(kind)[method].amounts.values(), values, strict=True):
            highest = getattr(self, amount.own)
            lowest = -highest if amount.signed else 0.0
            check_setpoint(self._name, amount.label, value, amount.unit, lowest, highest, "the station")

    def _reading(
        self,
        quantity: Text,
        unit: str,
        minimum: float,
        maximum: float,
        accuracy: Accuracy | None,
        *,
        stated_of: Text | None = None,
        context: Text | None = None,
    ) -> Reading:
        """Ask for a quantity (in `unit`, within `minimum` … `maximum`) and return the answer with the accuracy the station file states.

        Raises MeasurementError where it states none of the quantity, called `stated_of` where that is another word, before
        anything is asked, or after three unusable answers.
        """
        stated = self._questions.stated(accuracy, stated_of or quantity)
        value = self._questions.ask(quantity, unit, minimum, maximum, context)
        return Reading(value, unit, stated, self._clock.now())
