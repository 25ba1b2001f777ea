"""Records all calls to instruments and their results in the journal, without any action of procedures or drivers."""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, suppress
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol

from bench.journal.events.instruments import (
    Commanding,
    DeEnergised,
    DeEnergising,
    Energised,
    Energising,
    InstrumentFailed,
    ReadingTaken,
    SettingDone,
    WaveformFile,
    WaveformsTaken,
)
from bench.journal.waveforms import StoredRecord
from drivers.interfaces import Instrument, Role, Waveform
from drivers.interfaces.declarations import Declaration, Effect, Lasting, UndeclaredError, declarations
from procedures.core.bench import Recorder
from procedures.core.procedure_error import CorrectedError, RepeatRequestedError

#: What is no event: an answer that the driver knows without a measurement, and the end of a connection.
_UNRECORDED = (Effect.QUESTION, Effect.DISCONNECTS)

#: Types that a journal's line holds as they are.
_PLAIN = frozenset({float, int, str, bool, dict, list, type(None)})


class WaveformSink(Protocol):
    """A store of samples; the journal only holds the reference and the file's hash."""

    def store(self, name: str, waveforms: Mapping[str, Waveform]) -> StoredRecord:
        """Keep the waveforms of one record of this instrument."""


class KeepsWaveforms(Protocol):
    """The choice of waveforms of a run that are kept."""

    def sink(self, folder: Path, *, durable: bool) -> WaveformSink:
        """Return where a run's samples go: to `folder`, each record on the disk once stored where `durable`."""


class Recording:
    """An instrument whose every setting, reading, waveform and energised block becomes an event.

    What its interface declares to energise or to be a set point is on the disk before it is sent. `name` is its role. An error of
    the instrument is an event as well. Raises UndeclaredError for what the interface does not declare.
    """

    def __init__(self, instrument: Instrument, name: str, recorder: Recorder, waveforms: WaveformSink) -> None:
        self._instrument = instrument
        self._name = name
        self._interface = Role(name).interface
        self._declarations = declarations(self._interface)
        self._recorder = recorder
        self._waveforms = waveforms

    def __getattr__(self, attribute: str) -> Any:
        declaration = self._declarations.get(attribute)
        if declaration is None:
            raise UndeclaredError(self._name, self._interface, attribute)
        if declaration.is_property or declaration.effect in _UNRECORDED:
            return getattr(self._instrument, attribute)
        recorded = self._recorded(attribute, declaration)
        # Found in the instance from now on: the wrapping is paid for once.
        self.__dict__[attribute] = recorded
        return recorded

    def judge(self, method: str, *arguments: Any, **named: Any) -> None:
        """Raise SetpointError where the limits in front of the instrument would refuse a call; nothing is sent or recorded."""
        instrument: Any = self._instrument
        instrument.judge(method, *arguments, **named)

    def _recorded(self, method: str, declaration: Declaration) -> Callable[..., Any]:
        # A block is written when it is entered; nothing is sent before.
        is_block = declaration.lasting is Lasting.BLOCK
        is_command = declaration.is_command and not is_block

        def recorded(*arguments: Any, **named: Any) -> Any:
            if is_command:
                self._recorder.record(Commanding(**self._call(method, arguments, named)))
            try:
                # Looked up anew: an instrument that was closed is another one when it has been opened again.
                given = getattr(self._instrument, method)(*arguments, **named)
            except (CorrectedError, RepeatRequestedError):
                # Nothing has failed: the person at the bench wants something done over.
                raise
            except BaseException as error:
                self._failed(method, arguments, named, error)
                raise
            if is_block:
                return _Energised(given, self._recorder, self._call(method, arguments, named))
            return self._record(method, arguments, named, given)

        return recorded

    def _record(self, method: str, arguments: tuple[Any, ...], named: Mapping[str, Any], given: Any) -> Any:
        call = self._call(method, arguments, named)
        if waves := _waveforms(given):
            file, value = self._kept(waves)
            self._recorder.record(WaveformsTaken(**call, file=file, value=value))
        elif given is None:
            self._recorder.record(SettingDone(**call))
        else:
            self._recorder.record(ReadingTaken(**call, value=_flat(given)))
        return given

    def _call(self, method: str, arguments: tuple[Any, ...], named: Mapping[str, Any]) -> dict[str, Any]:
        return {
            "instrument": self._name,
            "call": method,
            "arguments": tuple(map(_flat, arguments)),
            "named": {name: _flat(value) for name, value in named.items()},
        }

    def _kept(self, waves: Mapping[Any, Waveform]) -> tuple[WaveformFile, dict[str, Any]]:
        stored = self._waveforms.store(self._name, {f"channel{key}": wave for key, wave in waves.items()})
        told = {
            str(key): {
                "waveform": stored.reference(f"channel{key}"),
                "samples": len(wave.values),
                "unit": wave.unit,
                "resolution": wave.resolution,
                "clipped": wave.clipped,
            }
            for key, wave in waves.items()
        }
        return WaveformFile(stored.path, stored.sha256, stored.length), told

    def _failed(self, method: str, arguments: tuple[Any, ...], named: Mapping[str, Any], error: BaseException) -> None:
        self._recorder.record(InstrumentFailed(**self._call(method, arguments, named), error=_words(error)))


class _Energised(AbstractContextManager[Any]):
    """An energised block: on its way to the disk before it is entered, and again when it has been left."""

    def __init__(self, inner: AbstractContextManager[Any], recorder: Recorder, call: dict[str, Any]) -> None:
        self._inner = inner
        self._recorder = recorder
        self._call = call

    def __enter__(self) -> Any:
        self._recorder.record(Energising(**self._call))
        try:
            result = self._inner.__enter__()
        except BaseException as error:
            self._recorder.record(DeEnergised(**self._call, error=_words(error)))
            raise
        try:
            self._recorder.record(Energised(**self._call))
        except BaseException as error:
            # What cannot be recorded must not stay on: the caller never gets to its block's end.
            self._inner.__exit__(type(error), error, error.__traceback__)
            raise
        return result

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> bool | None:
        noted = len(getattr(error, "__notes__", ()))
        if error is not None:
            # Said before it is tried, so that somebody may notice where it is not done.
            with suppress(OSError):
                self._recorder.record(DeEnergising(**self._call, error=_words(error)))
        try:
            swallowed = self._inner.__exit__(kind, error, trace)
        except BaseException as failure:
            self._recorder.record(DeEnergised(**self._call, error=_words(failure)))
            raise
        # An end that fails under an error is a note of that error.
        failed = getattr(error, "__notes__", [])[noted:]
        self._recorder.record(DeEnergised(**self._call, error="; ".join(failed) or None))
        return swallowed


def _waveforms(given: Any) -> Mapping[Any, Waveform]:
    """Return the waveforms by channel where that is what an instrument gave."""
    if isinstance(given, Waveform):
        return {given.channel: given}
    if isinstance(given, Mapping) and any(isinstance(item, Waveform) for item in given.values()):
        return given
    return {}


def _words(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}"


def _flat(value: Any) -> Any:
    """Return a reading in JSON's types by the short way; the journal takes the long way for whatever is left."""
    kind = type(value)
    if kind in _PLAIN:
        return value
    if isinstance(value, Enum):
        return value.value
    names = _field_names(kind)  # type: ignore[arg-type]  # a class can be hashed
    if names is None:
        return value
    result = {}
    for name in names:
        item = getattr(value, name)
        result[name] = item if type(item) in _PLAIN else _flat(item)
    return result


@cache
def _field_names(kind: type) -> tuple[str, ...] | None:
    """Return the names of a dataclass's fields, None for any other kind."""
    return tuple(field.name for field in fields(kind)) if is_dataclass(kind) else None
