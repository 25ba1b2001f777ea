"""A procedure done over with one typed reading corrected, and nothing else changed."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from enum import Enum
from typing import Any

from bench.journal.encoding import plain
from bench.operators.entry import TypedEntry, TypedReading
from bench.run.given import GivenReply, Key, captured, remade, restore, said
from drivers.interfaces import Waveform
from drivers.interfaces.text import Text, text, text_of
from procedures.core.bench import Bench, Recorder
from procedures.core.events import Event, ReadingCorrected, RepeatsTaken, RepeatStarted, StepFinished, StepStarted
from procedures.core.procedure import Procedure
from procedures.core.procedure_error import CorrectedError, RepeatRequestedError
from procedures.core.result import ProcedureResult

#: Samples of waveforms that are kept for a procedure; beyond that it cannot be done over.
_MOST = 20_000_000
_NOW: Key = ("now",)


class _EndOfTape(BaseException):
    """The tape ends here: the answer that follows has not been given yet."""


class _Diverged(BaseException):
    """Something else follows than what was done."""

    def __init__(self, what: Text) -> None:
        self.what = what


class Mode(Enum):
    """The treatment of a procedure's calls."""

    THROUGH = "is done, and not kept"
    LIVE = "is done, and kept"
    OVER = "was done already, as far as the tape goes"
    TRIED = "was done already; nothing happens, and nothing is written"
    LEFT = "is wanted by a procedure that is done over"


class Tape:
    """Stands between a procedure and its bench: stores the results of its calls, and returns them again when a reading was corrected.

    What is switched on stays so meanwhile, and nothing is asked twice. A procedure that wants something else of the bench with the
    corrected reading has been decided by it: nothing is changed then. `entry` is where a person types.
    """

    def __init__(self, recorder: Recorder, entry: TypedEntry) -> None:
        self._recorder = recorder
        self._entry = entry
        self._make: Callable[[], Procedure[Any]]
        self.mode = Mode.THROUGH
        self._given: list[GivenReply] = []
        self._position = 0
        self._events: list[Event] = []
        self._open: list[AbstractContextManager[Any]] = []
        self._pending: list[TypedReading] = []
        self._last = 0.0
        self._samples = 0
        self._group = 0
        self._repeat: RepeatStarted | None = None
        self._told = False
        entry.corrections = self

    def perform(self, bench: Bench, make: Callable[[], Procedure[Any]]) -> ProcedureResult:
        """Run the procedure that `make` gives, over again with each correction. Raises what it raises, and RepeatRequestedError."""
        self._bench, self._make = bench, make
        procedure = make()
        if procedure.manual:
            return procedure.run()
        self._begin = captured(bench)
        self._given, self._events, self._pending, self._samples = [], [], [], 0
        self._rewind(Mode.LIVE)
        try:
            while True:
                try:
                    return procedure.run()
                except CorrectedError:
                    restore(bench, self._begin)
                    self._rewind(Mode.OVER)
                    procedure = make()
        except _Diverged as other:
            raise RepeatRequestedError(
                text("the corrected reading has decided {what}; the procedure is measured again", what=other.what)
            ) from None
        finally:
            self.mode, self._given = Mode.THROUGH, []
            self._leave()

    @property
    def lives(self) -> bool:
        """Tell whether the request at this point is carried out."""
        return self.mode in (Mode.THROUGH, Mode.LIVE)

    def readings(self) -> Sequence[TypedReading]:
        """Return what was typed in this procedure and counts, oldest first."""
        if self.mode is Mode.THROUGH:
            return ()
        return [one for given in self._given for one in given.typed] + self._entry.taken

    def correct(self, reading: TypedReading, value: float, typed: str, by: str) -> Text | None:
        """Put another value in a reading's place and into the journal; return why that cannot be, or None."""
        now = replace(reading, value=value)
        event = ReadingCorrected(
            quantity=reading.recorded, unit=reading.unit, was=reading.value, typed=typed, value=value, by=by
        )
        taken = self._entry.taken
        if any(one.number == reading.number for one in taken):
            self._entry.taken = [now if one.number == reading.number else one for one in taken]
            self._recorder.record(event)
            return None
        given = next(given for given in self._given if any(one.number == reading.number for one in given.typed))
        if self._samples > _MOST:
            return text("too much was recorded since then to calculate the procedure again")
        before = given.result, given.typed
        after = tuple(now if one.number == reading.number else one for one in given.typed)
        try:
            given.result, given.typed = remade(given, after, self._entry), after
        except Exception as error:  # noqa: BLE001  whatever a driver has against a value, the one before stays
            return text_of(error)
        fault = self._tried()
        if fault is None:
            role = "" if given.remake is None else given.key[1]
            whole = {"instrument": role, "before": plain(before[0]), "after": plain(given.result)}
            self._recorder.record(replace(event, **whole))
        else:
            given.result, given.typed = before
        return fault

    def call(
        self, key: Key, act: Callable[[], Any], *, skipped: bool = False, remake: Callable[[], Any] | None = None
    ) -> Any:
        """Return what `act` gives, or gave; `skipped` is what the procedure may ask for or not as a reading comes out."""
        if self.mode is Mode.THROUGH:
            return act()
        if self.mode is Mode.LEFT:
            raise CorrectedError
        if skipped:
            at = self._repeat
            key = (*key, self._group, at.terminals, at.number) if at else key
        if self.mode is not Mode.LIVE:
            found = self._find(key)
            if found is not None:
                if found.error is not None:
                    raise found.error
                return found.result
            self._go_beyond(skipped=skipped)
        return self._live(GivenReply(key, skipped=skipped, remake=remake), act)

    def left(self, key: Key, block: AbstractContextManager[Any], error: BaseException | None) -> Any:
        """Leave a block that is on."""
        if isinstance(error, _EndOfTape | _Diverged | CorrectedError):
            return None
        if error is not None and self.mode in (Mode.OVER, Mode.TRIED):
            found = self._find(key)
            return found.result if found else None

        def leave() -> Any:
            self._open.remove(block)
            return block.__exit__(type(error) if error else None, error, error.__traceback__ if error else None)

        return self.call(key, leave)

    def entered(self, block: AbstractContextManager[Any]) -> tuple[AbstractContextManager[Any], Any]:
        """Enter a block; return it, and what it gives."""
        given = block.__enter__()
        self._open.append(block)
        return block, given

    def now(self, clock: Callable[[], float]) -> float:
        """Return the time (s) as it was then, else that of the clock."""
        if self.mode in (Mode.OVER, Mode.TRIED) and self._position < len(self._given):
            if self._given[self._position].key == _NOW:
                self._last = self._given[self._position].result
                self._position += 1
            return self._last
        if self.mode is Mode.TRIED:
            raise _EndOfTape
        if self.mode is not Mode.LEFT:
            self._last = clock()
        if self.mode is Mode.LIVE:
            self._keep(GivenReply(_NOW, self._last, skipped=True))
        return self._last

    def record(self, event: Event) -> None:
        """Write an event, once."""
        if self.mode is Mode.LEFT:
            return
        match event:
            case RepeatStarted():
                self._repeat = event
            case RepeatsTaken():
                self._group, self._repeat = self._group + 1, None
            case StepStarted() | StepFinished():
                self._repeat = None
        if self.mode is Mode.TRIED or (self.mode is Mode.OVER and event in self._events):
            return
        self._told = self._told or self.mode is Mode.OVER
        if self.mode is not Mode.THROUGH:
            self._events.append(event)
        self._recorder.record(event)

    def _find(self, key: Key) -> GivenReply | None:
        for at in range(self._position, len(self._given)):
            result = self._given[at]
            if result.key == key:
                self._position = at + 1
                return result
            if not result.skipped:
                return None
        return None

    def _go_beyond(self, *, skipped: bool) -> None:
        """Go on where nothing was given for what is wanted now: what is to be asked is asked, what was decided stays."""
        decided = next((given for given in self._given[self._position :] if not given.skipped), None)
        if decided is not None and not skipped:
            raise _Diverged(said(decided.key))
        if self.mode is Mode.TRIED:
            raise _EndOfTape
        if decided is None:
            self._position = len(self._given)
            self.mode = Mode.LIVE
            self._entry.preset = [one.value for one in self._pending]
            self._pending = []
        if self._told and self._repeat is not None:
            self._recorder.record(self._repeat)
        self._told = False

    def _live(self, given: GivenReply, act: Callable[[], Any]) -> Any:
        self._entry.taken = []
        try:
            given.result = act()
        except CorrectedError:
            self._pending, self.mode = self._entry.taken, Mode.LEFT
            raise
        except Exception as error:
            given.error = error
            self._keep(given)
            raise
        given.typed, self._entry.taken = tuple(self._entry.taken), []
        self._keep(given)
        return given.result

    def _keep(self, given: GivenReply) -> None:
        if self._repeat is not None and self._repeat.again and given.typed:
            for earlier in self._given:
                if earlier.key == given.key:
                    # Typed over: it counts from the first.
                    earlier.result, earlier.typed = given.result, given.typed
                    return
        if given.skipped and given.result is True:
            # A doubt that had something typed again.
            return
        waves = given.result.values() if isinstance(given.result, dict) else (given.result,)
        self._samples += sum(len(wave.values) for wave in waves if isinstance(wave, Waveform))
        if self._samples > _MOST:
            given.result = None
        at = len(self._given) if self.mode is Mode.LIVE else self._position
        self._given.insert(at, given)
        self._position = at + 1

    def _tried(self) -> Text | None:
        """Go through all of it without touching anything; return why it would come out otherwise, or None."""
        here = (self.mode, self._position, self._last, self._group, self._repeat, self._told)
        state, taken = captured(self._bench), self._entry.taken
        restore(self._bench, self._begin)
        self._rewind(Mode.TRIED)
        try:
            self._make().run()
        except _EndOfTape:
            pass
        except _Diverged as other:
            return text("this reading has already decided what followed: {what}", what=other.what)
        except Exception as error:  # noqa: BLE001  whatever it is, it is said, and the reading stays as it was
            return text("with this value the procedure ends: {error}", error=error)
        finally:
            restore(self._bench, state)
            self.mode, self._position, self._last, self._group, self._repeat, self._told = here
            self._entry.taken = taken
        return None

    def _rewind(self, mode: Mode) -> None:
        self.mode, self._position, self._group, self._repeat, self._told = mode, 0, 0, None, False

    def _leave(self) -> None:
        """Leave what a procedure that was done over has not come to again."""
        while self._open:
            self._open.pop().__exit__(None, None, None)
