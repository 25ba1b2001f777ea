"""Factors from a reading between terminals to the phase."""

from enum import Enum
from typing import Literal, NamedTuple

from procedures.estimation.fitting.fit import EstimationError

Connection = Literal["wye", "delta"]


class ReadingConnection(Enum):
    """Connection of the meter when it gave a resistance or an inductance."""

    LINE_TO_LINE = "line to line, third terminal open"
    SERIES_PARALLEL = "one line to the other two joined, A to B and C"
    PHASE_TO_STAR = "line to star point"


class PhaseFactor(NamedTuple):
    """Factors to multiply a reading by: for one leg of the equivalent wye, and for the winding itself."""

    y_equivalent: float
    winding: float


_FACTORS: dict[tuple[str, ReadingConnection], PhaseFactor] = {
    ("wye", ReadingConnection.LINE_TO_LINE): PhaseFactor(1 / 2, 1 / 2),
    ("delta", ReadingConnection.LINE_TO_LINE): PhaseFactor(1 / 2, 3 / 2),
    ("wye", ReadingConnection.SERIES_PARALLEL): PhaseFactor(2 / 3, 2 / 3),
    ("delta", ReadingConnection.SERIES_PARALLEL): PhaseFactor(2 / 3, 2.0),
    ("wye", ReadingConnection.PHASE_TO_STAR): PhaseFactor(1.0, 1.0),
}


def phase_factor(connection: Connection, reading: ReadingConnection) -> PhaseFactor:
    """Return the factors from a resistance or inductance reading to the phase (§3.2.2, §3.3; errata E1, E8).

    Raises EstimationError for a reading that the winding's connection does not allow.
    """
    try:
        return _FACTORS[connection, reading]
    except KeyError:
        if connection in ("wye", "delta"):
            raise EstimationError("a delta winding has no star point to read against; read line to line") from None
        raise EstimationError(f"winding connection '{connection}' is not known; it is 'wye' or 'delta'") from None
