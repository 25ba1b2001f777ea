"""A run's motor, as its journal holds it."""

import tomllib
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from procedures.core.nameplate import Connection, Nameplate

_UNKNOWN = Nameplate("?", Connection.WYE, 1.0)


def nameplate_of(start: Mapping[str, Any]) -> Nameplate:
    """Return as much of the nameplate as drawings need: name, connection, colours; `start` is the run's first event."""
    content = start.get("motor_file")
    return _read(str(content)) if content else _UNKNOWN


@lru_cache(maxsize=64)
def _read(content: str) -> Nameplate:
    try:
        plate = tomllib.loads(content)["nameplate"]
        colours = {
            str(terminal): str(colour) for terminal, colour in dict(plate.get("wire_colours", {})).items() if colour
        }
        return Nameplate(
            str(plate["name"]),
            Connection(plate["connection"]),
            float(plate["rated_current"]),
            wire_colours=colours,
            serial_number=str(plate.get("serial_number", "")),
        )
    except (tomllib.TOMLDecodeError, KeyError, TypeError, ValueError):
        # A drive's file describes its motor in another way; the drawing does without.
        return _UNKNOWN
