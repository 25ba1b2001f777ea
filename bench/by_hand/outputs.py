"""The outputs that are on, each until it is switched off, and at the latest until the block ends."""

from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from functools import partial
from types import TracebackType
from typing import Any, Self

from drivers.interfaces import Instrument, InstrumentError, Role
from drivers.interfaces.declarations import Effect, declarations
from drivers.interfaces.text import text

#: Leaves an energised block, with the error that ends it or none.
_Leave = Callable[[type[BaseException] | None, BaseException | None, TracebackType | None], bool | None]


@dataclass(frozen=True)
class SwitchedOn:
    """Something that is on: the words that switched it on, and how it is left."""

    words: str
    leave: _Leave


class StillOnError(InstrumentError):
    """An instrument that could not be switched off: the run ends, and its shutdown and its guardian see to it."""


class Outputs(AbstractContextManager["Outputs"]):
    """Instruments that put something out, by role, in the order in which they were switched on.

    One whose block ends with an error is switched off once more by `make_safe`; where that fails too, StillOnError is raised.
    """

    def __init__(self, make_safe: Callable[[Role], None]) -> None:
        self._make_safe = make_safe
        self._on: dict[Role, SwitchedOn] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        stack = ExitStack()
        for role, output in self._on.items():
            stack.push(partial(self._leave, role, output))
        self._on.clear()
        stack.__exit__(kind, error, trace)

    def __bool__(self) -> bool:
        return bool(self._on)

    def __contains__(self, role: Role) -> bool:
        return role in self._on

    @property
    def words(self) -> tuple[str, ...]:
        """The commands, as typed, that switched on the outputs that are on."""
        return tuple(output.words for output in self._on.values())

    def block(self, role: Role, words: str, block: AbstractContextManager[Any]) -> None:
        """Enter a block and stay in it."""
        block.__enter__()
        self._on[role] = SwitchedOn(words, block.__exit__)

    def turning(self, role: Role, words: str, instrument: Instrument) -> None:
        """Remember what goes on until its instrument is stopped."""

        def leave(*_: object) -> None:
            stop(role, instrument)

        self._on[role] = SwitchedOn(words, leave)

    def off(self, role: Role) -> None:
        """Leave what the instrument of a role is in. Raises what its driver reports, once it is off."""
        output = self._on.pop(role, None)
        if output is not None:
            self._leave(role, output, None, None, None)

    def all_off(self, error: BaseException | None = None) -> None:
        """Leave all blocks, the last first, each independent of the others. `error` is the reason, if any."""
        self.__exit__(type(error) if error else None, error, error.__traceback__ if error else None)

    def _leave(
        self,
        role: Role,
        output: SwitchedOn,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            output.leave(kind, error, trace)
        except InstrumentError as reported:
            if reported is error:
                return
            # It may be off by its own protection, or still on: this tells.
            try:
                self._make_safe(role)
            except InstrumentError as failed:
                raise StillOnError(role.value, text("it cannot be switched off: {failed}", failed=failed)) from reported
            raise


def stop(role: Role, instrument: Instrument) -> None:
    """End what an instrument does, by its own `stop` where its interface has one."""
    found = declarations(role.interface).get("stop")
    method = "stop" if found is not None and found.effect is Effect.MAKES_SAFE else "make_safe"
    getattr(instrument, method)()
