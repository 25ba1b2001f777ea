"""A run's motor, as its journal holds it."""

import tomllib
from collections.abc import Mapping
from functools import lru_cache

from bench.journal.events.run import RunStarted
from procedures.core.nameplate import Nameplate, WindingConnection

_UNKNOWN = Nameplate("?", WindingConnection.WYE, 1.0)


def nameplate_of(start: RunStarted | None) -> Nameplate:
    """Return as much of the nameplate as drawings need: name, connection, colours."""
    return _read(start.motor_file) if start is not None and start.motor_file else _UNKNOWN


def type_values_of(start: RunStarted | None) -> tuple[Mapping[str, float], Mapping[str, float]]:
    """Return the type values and tolerances of a run's motor file; none of a file that is not right."""
    # Read here, for the motor file's own reader brings the virtual motor with it; the run checked the file as it began.
    try:
        data = tomllib.loads(start.motor_file) if start is not None else {}
    except tomllib.TOMLDecodeError:
        return {}, {}
    return _numbers(data.get("expected")), _numbers(data.get("tolerance"))


def _numbers(section: object) -> Mapping[str, float]:
    given = section.items() if isinstance(section, dict) else ()
    return {name: float(value) for name, value in given if type(value) in (int, float)}


@lru_cache(maxsize=64)
def _read(content: str) -> Nameplate:
    try:
        plate = tomllib.loads(content)["nameplate"]
        colours = {
            str(terminal): str(colour) for terminal, colour in dict(plate.get("wire_colours", {})).items() if colour
        }
        return Nameplate(
            str(plate["name"]),
            WindingConnection(plate["connection"]),
            float(plate["rated_current"]),
            wire_colours=colours,
            serial_number=str(plate.get("serial_number", "")),
        )
    except (tomllib.TOMLDecodeError, KeyError, TypeError, ValueError):
        # A drive's file describes its motor in another way; the drawing does without.
        return _UNKNOWN
