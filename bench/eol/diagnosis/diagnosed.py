"""Diagnosis, and the data that it is made from."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from drivers.interfaces.text import Text


class FaultyPart(Enum):
    """Part that a rework place looks at first; the value begins the rework code."""

    LEAD = "LEAD"
    JOINT = "JOINT"
    TURNS = "TURNS"
    SHORT = "SHORT"
    WINDING = "WINDING"
    MAGNET = "MAGNET"
    MAGNETS = "MAGNETS"
    HALL = "HALL"
    BEARING = "BEARING"
    #: The shaft does not turn, for the motor's bearing or the fixture's coupling or lock.
    HELD = "HELD"
    COGGING = "COGGING"
    INSULATION = "INSULATION"
    TYPE = "TYPE"


@dataclass(frozen=True)
class Diagnosis:
    """One part at fault: at which terminal, line or sensor (`place`, empty where it is none's), and the figures behind, in words."""

    part: FaultyPart
    place: str
    words: Text

    @property
    def code(self) -> str:
        """The rework code, as JOINT-B."""
        return f"{self.part.value}-{self.place}" if self.place else self.part.value


@dataclass(frozen=True)
class Evidence:
    """The evidence about a motor that failed.

    `findings` are the procedures' by name, `outside` the figures that failed by parameter, each its value over the middle of its
    limits (NaN where a side is open), `values` all figures (SI, %, °), `mistakes` what wrong connections look like: records of a
    kind and its terminals, `broken` parts that are missing or broken down, `expected` the type's values, `least` what figures that
    are not known are above, beyond their limits.
    """

    findings: Mapping[str, Mapping[str, Any]]
    outside: Mapping[str, float]
    values: Mapping[str, float]
    mistakes: Sequence[Mapping[str, Any]] = field(default_factory=tuple)
    broken: Collection[str] = ()
    expected: Mapping[str, float] = field(default_factory=dict)
    least: Mapping[str, float] = field(default_factory=dict)

    def of(self, procedure: str, name: str) -> Any:
        """Return a finding of a procedure, None where there is none."""
        return self.findings.get(procedure, {}).get(name)
