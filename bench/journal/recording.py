"""Everything that instruments are told and give, in the journal without procedures or drivers doing anything."""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, suppress
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from types import TracebackType
from typing import Any, Protocol

from bench.journal.waveforms import StoredRecord
from drivers.interfaces import Instrument, Waveform
from procedures.core.bench import Recorder

#: Questions that an instrument answers from its own data, without a measurement.
_UNRECORDED = frozenset({"accuracy_at", "channels", "close"})
#: What energises or moves by itself, or changes the energy in an energised block: on the disk before it is done, as a block's
#: beginning is.
_COMMANDS = frozenset(
    {
        ("inverter", "set_current"),
        ("dynamometer", "set_speed"),
        ("supply", "configure"),
        ("insulation_tester", "measure"),
        ("rotor_actuator", "turn"),
        ("rotor_actuator", "move_by"),
    }
)

#: Types that a journal's line holds as they are.
_PLAIN = frozenset({float, int, str, bool, dict, list, type(None)})


class WaveformSink(Protocol):
    """Where samples go; the journal only holds the reference and the file's hash."""

    def store(self, name: str, waveforms: Mapping[str, Waveform]) -> StoredRecord:
        """Keep the waveforms of one record of this instrument, on the disk when this returns."""


class Recording:
    """An instrument whose every setting, reading, waveform and energised block becomes an event.

    It passes on whatever the instrument has; `name` is its role. An error of the instrument is an event as well.
    """

    def __init__(self, instrument: Instrument, name: str, recorder: Recorder, waveforms: WaveformSink) -> None:
        self._instrument = instrument
        self._name = name
        self._recorder = recorder
        self._waveforms = waveforms

    def __getattr__(self, attribute: str) -> Any:
        value = getattr(self._instrument, attribute)
        if not callable(value) or attribute.startswith("_") or attribute in _UNRECORDED:
            return value
        recorded = self._recorded(attribute)
        # Found in the instance from now on: the wrapping is paid for once.
        self.__dict__[attribute] = recorded
        return recorded

    def _recorded(self, method: str) -> Callable[..., Any]:
        commands = (self._name, method) in _COMMANDS

        def recorded(*arguments: Any, **named: Any) -> Any:
            if commands:
                said = _said(arguments, named)
                self._recorder.event("commanding", instrument=self._name, call=method, **said)
            try:
                # Looked up anew: an instrument that was closed is another one when it has been opened again.
                given = getattr(self._instrument, method)(*arguments, **named)
            except BaseException as error:
                self._failed(method, arguments, named, error)
                raise
            return self._record(method, arguments, named, given)

        return recorded

    def _record(self, method: str, arguments: tuple[Any, ...], named: Mapping[str, Any], given: Any) -> Any:
        event: dict[str, Any] = {"instrument": self._name, "call": method, **_said(arguments, named)}
        if isinstance(given, AbstractContextManager):
            return _Energised(given, self._recorder, event)
        if waves := _waveforms(given):
            event["file"], event["value"] = self._kept(waves)
            self._recorder.event("waveforms", **event)
        elif given is None:
            self._recorder.event("setting", **event)
        else:
            self._recorder.event("reading", **event, value=_flat(given))
        return given

    def _kept(self, waves: Mapping[Any, Waveform]) -> tuple[dict[str, Any], dict[str, Any]]:
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
        return {"path": stored.path, "sha256": stored.sha256, "bytes": stored.length}, told

    def _failed(self, method: str, arguments: tuple[Any, ...], named: Mapping[str, Any], error: BaseException) -> None:
        self._recorder.event(
            "instrument_error",
            instrument=self._name,
            call=method,
            **_said(arguments, named),
            error=f"{type(error).__name__}: {error}",
        )


class _Energised(AbstractContextManager[Any]):
    """An energised block: on its way to the disk before it is entered, and again when it has been left."""

    def __init__(self, inner: AbstractContextManager[Any], recorder: Recorder, said: dict[str, Any]) -> None:
        self._inner = inner
        self._recorder = recorder
        self._said = said

    def __enter__(self) -> Any:
        self._recorder.event("energising", **self._said)
        try:
            given = self._inner.__enter__()
        except BaseException as error:
            self._recorder.event("de_energised", **self._said, error=f"{type(error).__name__}: {error}")
            raise
        try:
            self._recorder.event("energised", **self._said)
        except BaseException as error:
            # What cannot be recorded must not stay on: the caller never gets to its block's end.
            self._inner.__exit__(type(error), error, error.__traceback__)
            raise
        return given

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> bool | None:
        noted = len(getattr(error, "__notes__", ()))
        if error is not None:
            # Said before it is tried, so that somebody may notice where it is not done.
            with suppress(OSError):
                self._recorder.event("de_energising", **self._said, error=f"{type(error).__name__}: {error}")
        try:
            swallowed = self._inner.__exit__(kind, error, trace)
        except BaseException as failure:
            self._recorder.event("de_energised", **self._said, error=f"{type(failure).__name__}: {failure}")
            raise
        # An end that fails under an error is a note of that error.
        failed = getattr(error, "__notes__", [])[noted:]
        self._recorder.event("de_energised", **self._said, **({"error": "; ".join(failed)} if failed else {}))
        return swallowed


def _waveforms(given: Any) -> Mapping[Any, Waveform]:
    """Return the waveforms by channel where that is what an instrument gave."""
    if isinstance(given, Waveform):
        return {given.channel: given}
    if isinstance(given, Mapping) and any(isinstance(item, Waveform) for item in given.values()):
        return given
    return {}


def _said(arguments: tuple[Any, ...], named: Mapping[str, Any]) -> dict[str, Any]:
    said: dict[str, Any] = {}
    if arguments:
        said["arguments"] = [_flat(argument) for argument in arguments]
    if named:
        said["named"] = {name: _flat(value) for name, value in named.items()}
    return said


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
    told = {}
    for name in names:
        item = getattr(value, name)
        told[name] = item if type(item) in _PLAIN else _flat(item)
    return told


@cache
def _field_names(kind: type) -> tuple[str, ...] | None:
    """Return the names of a dataclass's fields, None for any other kind."""
    return tuple(field.name for field in fields(kind)) if is_dataclass(kind) else None
