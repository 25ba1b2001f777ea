"""The loop of lines B and C, which are joined while a bridge reads A against them, and what it takes of that reading."""

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from procedures.estimation.winding.second_circuit import SeriesReading

#: Across phase A's axis there is at least this share of the reactance that is read.
_LEAST = 1e-3


class LineReading(NamedTuple):
    """Impedance (Ω) of a line at the test frequency, and its resistance (Ω) at a low one."""

    impedance: complex
    resistance: float


@dataclass(frozen=True)
class JoinedLines:
    """The two axes of an equivalent wye's phase, α along phase A and β across it, in which B and C close a loop.

    `along`, `across` and `mutual` (H) are Lαα, Lββ and Lαβ, `resistance` and `unlike` (Ω) Rββ and Rαβ.
    """

    along: float
    across: float
    mutual: float
    resistance: float
    unlike: float

    def taken(self, angular: float) -> complex:
        """Return the impedance (Ω) that the loop takes of A against B and C at a frequency (rad/s)."""
        between = complex(self.unlike, angular * self.mutual)
        return 1.5 * between**2 / complex(self.resistance, angular * self.across)

    def without_loop(self, readings: Sequence[SeriesReading]) -> tuple[SeriesReading, ...]:
        """Return readings of A against B and C as they would be if B and C closed no loop."""
        result = []
        for read in readings:
            angular = 2.0 * math.pi * read.frequency
            taken = self.taken(angular)
            result.append(
                replace(
                    read,
                    resistance=read.resistance + taken.real,
                    inductance=read.inductance + taken.imag / angular,
                )
            )
        return tuple(result)


def joined_lines(reading: complex, ab: LineReading, ca: LineReading, angular: float) -> JoinedLines:
    """Return the axes from A against B and C (Ω), AB and CA at a test frequency (rad/s).

    AB and CA are 1.5·Zαα ∓ √3·Zαβ + 0.5·Zββ; A against B and C is 1.5·(Zαα − Zαβ²/Zββ). This holds of every motor at rest, whatever its
    connection, angle and phases. Zββ solves z² − s·z + 3·Zαβ² = 0 with s = Z_AB + Z_CA − 2·Z_A. Iron adds to resistances at the test
    frequency; of the low one across, in which readings' errors add up, a phase's mean is taken.
    """
    mutual = (ca.impedance - ab.impedance) / (2.0 * math.sqrt(3.0))
    s = ab.impedance + ca.impedance - 2.0 * reading
    # Poles that are not what they should be read anything.
    s = complex(s.real, max(s.imag, _LEAST * reading.imag))
    across = 0.5 * s * (1.0 + cmath.sqrt(1.0 - 12.0 * (mutual / s) ** 2))
    along = reading / 1.5 + mutual**2 / across
    return JoinedLines(
        along.imag / angular,
        across.imag / angular,
        mutual.imag / angular,
        0.25 * (ab.resistance + ca.resistance),
        (ca.resistance - ab.resistance) / (2.0 * math.sqrt(3.0)),
    )
