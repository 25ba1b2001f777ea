"""What a procedure wants, asked of an operator as a run asks it."""

from typing import Any, cast

from drivers.interfaces import Clock
from procedures.core.actions import Action, Wanted
from procedures.core.bench import Bench, Operator, Role
from tests.studies.worlds.measured_motor import NoRecord


class Asking:
    """An operator behind a bench that keeps track of the setup; all else is the operator's own."""

    def __init__(self, operator: Operator, clock: Clock) -> None:
        self.operator = operator
        instruments = cast("Any", {Role.DYNAMOMETER: None})
        self.bench = Bench(instruments, operator, clock, NoRecord())

    def perform(self, *actions: Action) -> object:
        if isinstance(actions[0], Wanted):
            self.bench.perform(*actions)
            return None
        return self.operator.perform(actions[0])

    def __getattr__(self, name: str) -> Any:
        return getattr(self.operator, name)
