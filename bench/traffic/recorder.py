"""Records what drivers are asked to do and what they send and receive for it."""

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from datetime import UTC, datetime
from hashlib import sha256
from importlib.metadata import version
from types import TracebackType
from typing import Any, cast

from bench.journal.encoding import dumps
from bench.station.station_file import Station
from bench.traffic.anonymity import anonymous
from bench.traffic.calls import END, FAIL, OPEN, WITH, flat, words_of
from bench.traffic.traffic_file import Kind, SessionRecording, TrafficLine
from drivers.interfaces import Instrument, Role
from drivers.interfaces.declarations import Declaration, Effect, Lasting, declarations
from drivers.transport.wire import Carrier, Direction, Wire

#: What came of a call is told up to so many characters; of what is longer, the hash tells whether it is the same.
_TOLD = 300
#: Digits that two computers agree on.
_DIGITS = 9


class TrafficRecorder:
    """Takes down the sessions of several instruments from any thread; `now` is the time (s) of their clock, `tell` hears each line."""

    def __init__(self, now: Callable[[], float], tell: Callable[[TrafficLine], None] = lambda _: None) -> None:
        self._now = now
        self._tell = tell
        self._lock = threading.Lock()
        self._begin: float | None = None
        self._lines: list[TrafficLine] = []
        self._carriers: dict[Role, Carrier] = {}
        self._calling: dict[tuple[Role, int], str | None] = {}

    def wire(self, role: Role) -> Wire:
        """Return what receives the bytes of an instrument's wire."""

        def told(carrier: Carrier, direction: Direction, data: bytes) -> None:
            if role not in self._carriers:
                self._carriers[role] = carrier
                self._tell(TrafficLine(self._time(), role, "@", carrier.encode()))
            caller = role, threading.get_ident()
            beside = direction == ">" and caller not in self._calling
            if (call := self._calling.get(caller)) is not None:
                self._calling[caller] = None
                self._add(role, "=", call.encode())
            self._add(role, "~" if beside else direction, data)

        return told

    def opened(self, role: Role, opener: Callable[[], Instrument]) -> Instrument:
        """Return the instrument that `opener` opens, whose calls are recorded like its opening."""
        with self.call(role, OPEN):
            instrument = opener()
        return cast("Instrument", _RecordedCalls(instrument, role, self))

    def lines(self, role: Role) -> Sequence[TrafficLine]:
        """Return what was recorded so far of one instrument."""
        with self._lock:
            return [line for line in self._lines if line.role is role]

    def recording(self, station: Station, *, identifiable: bool = False) -> SessionRecording:
        """Return what was recorded so far, of the instruments that have said or been told anything.

        Network addresses and serial numbers are left out unless it is to be `identifiable`.
        """
        with self._lock:
            lines, carriers = tuple(self._lines), dict(self._carriers)
        tables = {role.value: station.entries[role].table for role in carriers}
        made = SessionRecording(tables, carriers, [line for line in lines if line.role in carriers], made_now())
        return made if identifiable else anonymous(made)

    @contextmanager
    def call(self, role: Role, words: str, *, lazy: bool = False) -> Iterator[Callable[[object], None]]:
        """Record a call of the block's length, a `lazy` one only where it sends something; its outcome is handed to what is given."""
        caller = role, threading.get_ident()
        outer, was_calling = self._calling.get(caller), caller in self._calling
        if not lazy:
            self._add(role, "=", words.encode())
        self._calling[caller] = words if lazy else None
        try:
            yield lambda outcome: None if outcome is None else self._came(role, caller, f"gave {_told(outcome)}")
        except BaseException as error:
            self._came(role, caller, f"raised {type(error).__name__}: {' '.join(str(error).split())}")
            raise
        finally:
            del self._calling[caller]
            if was_calling:
                self._calling[caller] = outer

    def _came(self, role: Role, caller: tuple[Role, int], words: str) -> None:
        if self._calling.get(caller) is None:
            self._add(role, "#", words.encode())

    def _add(self, role: Role, kind: Kind, content: bytes) -> None:
        with self._lock:
            line = TrafficLine(self._time(), role, kind, content)
            self._lines.append(line)
            self._tell(line)

    def _time(self) -> float:
        now = self._now()
        self._begin = now if self._begin is None else self._begin
        return now - self._begin


def made_now() -> dict[str, str]:
    """Return what a recording says of itself: when it was made, and by which version."""
    return {"made": datetime.now(UTC).isoformat(timespec="seconds"), "motorbench": version("motorbench")}


class _RecordedCalls:
    """An instrument whose declared calls are recorded."""

    def __init__(self, instrument: Instrument, role: Role, recorder: TrafficRecorder) -> None:
        self._instrument, self._role, self._recorder = instrument, role, recorder
        self._declarations = declarations(role.interface)

    def __getattr__(self, attribute: str) -> Any:
        declaration = self._declarations.get(attribute)
        if declaration is None:
            return getattr(self._instrument, attribute)
        if declaration.is_property:
            with self._recorder.call(self._role, attribute, lazy=True) as tell:
                result = getattr(self._instrument, attribute)
                tell(result)
                return result
        return self._method(attribute, declaration)

    def _method(self, name: str, declaration: Declaration) -> Callable[..., Any]:
        method, recorder, role = getattr(self._instrument, name), self._recorder, self._role

        def called(*arguments: Any, **named: Any) -> Any:
            words = words_of(name, {**dict(zip(declaration.arguments, arguments, strict=False)), **named})
            if declaration.lasting is Lasting.BLOCK:
                return _RecordedBlock(method(*arguments, **named), role, recorder, words)
            with recorder.call(role, words, lazy=declaration.effect is Effect.QUESTION) as tell:
                outcome = method(*arguments, **named)
                tell(outcome)
                return outcome

        return called


class _RecordedBlock(AbstractContextManager[Any]):
    """An energised block whose beginning and end are calls."""

    def __init__(self, inner: AbstractContextManager[Any], role: Role, recorder: TrafficRecorder, words: str) -> None:
        self._inner, self._role, self._recorder, self._words = inner, role, recorder, words

    def __enter__(self) -> Any:
        with self._recorder.call(self._role, WITH + self._words):
            return self._inner.__enter__()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> bool | None:
        with self._recorder.call(self._role, END if error is None else FAIL):
            return self._inner.__exit__(kind, error, trace)


def _told(outcome: object) -> str:
    said = dumps({"": _rounded(flat(outcome))})[4:-1]
    return said if len(said) <= _TOLD else f"{said[:_TOLD]}… {sha256(said.encode()).hexdigest()[:16]}"


def _rounded(value: Any) -> Any:
    """Return JSON without times and accuracies, which no reading gives, and with numbers rounded."""
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items() if key != "time" and not key.endswith("accuracy")}
    if isinstance(value, list):
        return [_rounded(item) for item in value]
    return float(f"{value:.{_DIGITS}g}") if isinstance(value, float) else value
