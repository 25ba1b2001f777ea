"""A step combines data and code: its place in the document, its sentence, and the method it wraps."""

import functools
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Concatenate, ParamSpec, Protocol, TypeVar

from drivers.interfaces.text import Text

P = ParamSpec("P")
R = TypeVar("R")


@dataclass(frozen=True)
class Step:
    """One step of the document: `identifier` as in `3.2.2/1`, the English `template` of what happens, whether hands work."""

    identifier: str
    template: str
    by_hand: bool = False

    def words(self, values: dict[str, object]) -> Text:
        """Return the sentence with the settings' values in place."""
        return Text(self.template, values)


class StepRecorder(Protocol):
    """Recorder of the beginning and end of a step in the journal."""

    def step(self, step: Step, values: dict[str, object]) -> AbstractContextManager[None]:
        """Run one step; `values` stand in its sentence."""


class HasSteps(Protocol):
    """Requirement on a class whose methods are steps."""

    @property
    def bench(self) -> StepRecorder:
        """The recorder of this object's steps."""

    def step_values(self) -> dict[str, object]:
        """Return the values that step sentences may name."""


S = TypeVar("S", bound=HasSteps)


def step(
    identifier: str, template: str, *, by_hand: bool = False
) -> Callable[[Callable[Concatenate[S, P], R]], Callable[Concatenate[S, P], R]]:
    """Make a method of a procedure the step `identifier` of the document.

    The step begins and ends in the journal with the call; `template` may name any setting.
    """
    this = Step(identifier, template, by_hand)

    def wrap(method: Callable[Concatenate[S, P], R]) -> Callable[Concatenate[S, P], R]:
        @functools.wraps(method)
        def run(self: S, /, *args: P.args, **kwargs: P.kwargs) -> R:
            with self.bench.step(this, self.step_values()):
                return method(self, *args, **kwargs)

        run.__step__ = this  # type: ignore[attr-defined]
        return run

    return wrap


def steps_of(procedure: type[Any]) -> tuple[Step, ...]:
    """Return a procedure's steps in the order in which it defines them, base classes first."""
    found: dict[str, Step] = {}
    for cls in reversed(procedure.__mro__):
        for member in vars(cls).values():
            this = getattr(member, "__step__", None)
            if isinstance(this, Step):
                found[this.identifier] = this
    return tuple(found.values())


def methods_of(procedure: type[Any]) -> dict[str, str]:
    """Return the name of the method behind each step, by the step's identifier."""
    return {
        member.__step__.identifier: name
        for cls in reversed(procedure.__mro__)
        for name, member in vars(cls).items()
        if isinstance(getattr(member, "__step__", None), Step)
    }
