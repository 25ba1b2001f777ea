"""Configuration of a simulated drive for its motor: its unit of velocity, and the places of its maker's own objects.

A station's statements are taken for what its drive does; a unit that the station states is one that the drive does not tell.
"""

import math
import re
from dataclasses import dataclass
from typing import Literal

from sim_instruments.catalogue import Options
from sim_instruments.instruments.cia402.power import (
    MILLI_RPM,
    SI_UNIT_VELOCITY,
    Kind,
    ObjectEntry,
    counts_per_hertz,
    numbered,
)

_UNIT = re.compile(r"([0-9.e+-]*) *(rpm|rps|rad/s|deg/s|counts/s|Hz)")
_A_TURN = {"rpm": 60.0, "rps": 1.0, "rad/s": 2.0 * math.pi, "deg/s": 360.0, "Hz": 1.0}
#: Encoder increments a turn of a drive of which nobody states any.
INCREMENTS = 65536


@dataclass(frozen=True)
class DriveUnit:
    """`counts` of a velocity in one turn a second (one Hz, where it is electrical); `code` is what 60A9h says, None without it."""

    counts: float
    code: int | None


@dataclass(frozen=True)
class OwnObject:
    """An object of the maker's: where it is, its type, and the SI value of one count."""

    index: int
    subindex: int
    kind: Kind
    scale: float

    @property
    def key(self) -> int:
        """The key by which a device is asked for it."""
        return numbered(self.index, self.subindex)


def electrical_unit(options: Options) -> DriveUnit:
    """Return the unit of a drive that turns a field: counts in one Hz, by its pole pairs (1 unless stated)."""
    pole_pairs = options.get("pole_pairs") or 1
    stated = _stated(options)
    if stated is None:
        return DriveUnit(counts_per_hertz(MILLI_RPM, pole_pairs), MILLI_RPM)
    counts, electrical = stated
    return DriveUnit(counts if electrical else counts / pole_pairs, None)


def shaft_unit(options: Options, code: int) -> DriveUnit:
    """Return the unit of a drive that turns a shaft: increments a second, by `code`, unless another is stated."""
    stated = _stated(options)
    return DriveUnit(float(increments_of(options)), code) if stated is None else DriveUnit(stated[0], None)


def increments_of(options: Options) -> int:
    """Return the increments a turn of the encoder."""
    return int(options.get("increments_per_turn") or INCREMENTS)


def unit_entries(unit: DriveUnit, access: Literal["rw", "const"] = "const") -> tuple[ObjectEntry, ...]:
    """Return 60A9h, of a drive that has it."""
    entry = ObjectEntry(SI_UNIT_VELOCITY, "SI unit velocity", "u32", access, value=unit.code)
    return () if unit.code is None else (entry,)


def own_object(options: Options, key: str, usual: OwnObject) -> OwnObject:
    """Return where one of the maker's objects is, as stated, or as it `usually` is."""
    stated = options.get(key)
    if stated is None:
        return usual
    index, subindex = stated.object.removeprefix("0x").split(":")
    return OwnObject(int(index, 16), int(subindex, 16), stated.type, stated.scale)


def _stated(options: Options) -> tuple[float, bool] | None:
    """Return the counts in one turn a second of the stated unit, and whether it is electrical; None where none is."""
    match = _UNIT.fullmatch(options.get("velocity_unit") or "")
    if match is None:
        return None
    a_turn = float(increments_of(options)) if match[2] == "counts/s" else _A_TURN[match[2]]
    return a_turn / float(match[1] or 1.0), match[2] == "Hz"
