"""Checks that readings are in the unit that the interface declares, so that a plug-in's millivolts are not taken for volts."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any

from drivers.interfaces import InstrumentError, Reading, Waveform
from drivers.interfaces.text import text

_WITH_UNIT = (Reading, Waveform)


def unit_check(instrument: str, driver: str, method: str, unit: str) -> Callable[[Any], None]:
    """Return what raises InstrumentError for a result of a method with a Reading or Waveform that is not in `unit`.

    `V|A` is one or the other. Readings in mappings, sequences and dataclasses are looked at as well.
    """
    allowed = frozenset(unit.split("|"))

    def check(result: Any) -> None:
        if isinstance(result, Reading):
            if result.unit in allowed:
                return
            raise _refused(result.unit)
        for found in _with_unit(result):
            if found.unit not in allowed:
                raise _refused(found.unit)

    def _refused(given: object) -> InstrumentError:
        return InstrumentError(
            instrument,
            text(
                "the driver {driver} gave a reading in the unit {given!r}, declared is {declared}; the reading is not used",
                driver=driver,
                given=given,
                declared=unit.replace("|", " / "),
            ),
            command=method,
            remedy=text("Let the driver convert what it returns to that unit (SI, without a prefix), and name it so"),
        )

    return check


def _with_unit(given: Any) -> Iterator[Reading | Waveform]:
    if isinstance(given, _WITH_UNIT):
        yield given
    elif isinstance(given, Mapping):
        for item in given.values():
            yield from _with_unit(item)
    elif isinstance(given, tuple | list):
        for item in given:
            yield from _with_unit(item)
    else:
        for name in _field_names(type(given)):  # type: ignore[arg-type]  # a class can be hashed
            yield from _with_unit(getattr(given, name))


@cache
def _field_names(kind: type) -> tuple[str, ...]:
    return tuple(field.name for field in fields(kind)) if is_dataclass(kind) else ()
