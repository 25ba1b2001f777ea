"""A procedure's bench with recorded calls: instruments, manual work, time and what feeds the motor."""

from collections.abc import Callable, Collection, Mapping
from contextlib import AbstractContextManager
from functools import partial
from types import TracebackType
from typing import Any, cast

from bench.run.given import Key
from bench.run.tape import Tape
from drivers.interfaces import Clock, Instrument, Role
from drivers.interfaces.declarations import Effect, Lasting, declarations
from procedures.core.actions import DoubtReading, EnterReading, HandWork
from procedures.core.bench import Bench, Feeding, Operator
from procedures.core.live_plot import RunObserver

#: What a driver answers by itself, and the end of a connection.
_PASSED = (Effect.QUESTION, Effect.DISCONNECTS)


def taped_bench(
    instruments: Mapping[Role, Instrument],
    unrecorded: Callable[[Role], Instrument],
    operator: Operator,
    clock: Clock,
    tape: Tape,
    session: int,
    feeding: Feeding,
    onlooker: RunObserver,
) -> Bench:
    """Return a bench behind a tape; `unrecorded` gives the instrument of a role without the journal."""
    taped = {
        role: cast("Instrument", _TapedInstrument(one, role, tape, partial(unrecorded, role)))
        for role, one in instruments.items()
    }
    return Bench(
        taped,
        _TapedOperator(operator, tape),
        _TapedClock(clock, tape),
        tape,
        session,
        _TapedFeeding(feeding, tape),
        onlooker,
    )


class _TapedInstrument:
    """An instrument of a role; `behind` gives the same without a record, asked anew for what was typed for it."""

    def __init__(self, instrument: Instrument, role: Role, tape: Tape, behind: Callable[[], Instrument]) -> None:
        self._instrument = instrument
        self._role = role
        self._tape = tape
        self._behind = behind
        self._declarations = declarations(role.interface)

    def __getattr__(self, attribute: str) -> Any:
        declaration = self._declarations.get(attribute)
        there = getattr(self._instrument, attribute)
        if declaration is None or declaration.is_property or declaration.effect in _PASSED:
            return there
        if declaration.lasting is Lasting.BLOCK:
            return lambda *arguments, **named: _Block(
                self._tape, self._key(attribute, arguments, named), partial(there, *arguments, **named)
            )
        reads = declaration.effect is Effect.READING

        def called(*arguments: Any, **named: Any) -> Any:
            return self._tape.call(
                ("does", *self._key(attribute, arguments, named)),
                partial(there, *arguments, **named),
                skipped=reads and getattr(self._instrument, "read_by_hand", False),
                remake=lambda: getattr(self._behind(), attribute)(*arguments, **named),
            )

        return called

    def _key(self, attribute: str, arguments: tuple[Any, ...], named: dict[str, Any]) -> Key:
        return self._role.value, attribute, arguments, tuple(named.items())


class _Block(AbstractContextManager[Any]):
    """A block that is entered and left once, however often the procedure is done over."""

    def __init__(self, tape: Tape, key: Key, make: Callable[[], AbstractContextManager[Any]]) -> None:
        self._tape = tape
        self._key = key
        self._make = make

    def __enter__(self) -> Any:
        self._inner, given = self._tape.call(("on", *self._key), lambda: self._tape.entered(self._make()))
        return given

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> Any:
        return self._tape.left(("off", *self._key), self._inner, error)


class _TapedOperator:
    """Whoever has hands."""

    def __init__(self, operator: Operator, tape: Tape) -> None:
        self._operator = operator
        self._tape = tape

    def perform(self, action: HandWork) -> object:
        """Do it and return what it gives; what was done is not done again."""
        act = partial(self._operator.perform, action)
        if isinstance(action, EnterReading):
            return self._tape.call(("enter", action.key, action.unit), act, skipped=True)
        if isinstance(action, DoubtReading):
            about = action.finding.values
            return self._tape.call(("doubt", about.get("number"), about.get("value")), act, skipped=True)
        return self._tape.call(("hands", action), act)


class _TapedClock:
    """The procedure's time."""

    def __init__(self, clock: Clock, tape: Tape) -> None:
        self._clock = clock
        self._tape = tape

    def now(self) -> float:
        """Return the time (s), then as it was."""
        return self._tape.now(self._clock.now)

    def sleep(self, seconds: float) -> None:
        """Wait for a time (s), once."""
        if self._tape.lives:
            self._clock.sleep(seconds)


class _TapedFeeding:
    """Sources that feed the motor or drive its shaft."""

    def __init__(self, feeding: Feeding, tape: Tape) -> None:
        self._feeding = feeding
        self._tape = tape

    @property
    def roles(self) -> Collection[Role]:
        """The roles that fed the motor or drove its shaft then."""
        return cast("Collection[Role]", self._tape.call(("feeds",), lambda: tuple(self._feeding.roles), skipped=True))

    @property
    def turned(self) -> bool:
        """Return whether something had driven the shaft since it was last seen at rest."""
        return bool(self._tape.call(("turned",), lambda: int(self._feeding.turned), skipped=True))

    def stands(self) -> None:
        """Say that the shaft was seen at rest."""
        if self._tape.lives:
            self._feeding.stands()
