"""Between which points of a winding a meter was, and what of its reading is one leg of the equivalent wye."""

from bench.analysis.outcome import AnalysisOutcome, estimated
from bench.captures import Capture
from drivers.interfaces.text import Text, text, word
from procedures.estimation.winding.connections import Connection, PhaseFactor, ReadingConnection, phase_factor

#: By the word that is typed.
READINGS = {
    "line": (
        ReadingConnection.LINE_TO_LINE,
        text("winding in {connection}, read line to line: leg of the equivalent wye = {y_equivalent:.4g} × reading"),
    ),
    "series-parallel": (
        ReadingConnection.SERIES_PARALLEL,
        text(
            "winding in {connection}, read from one line to the other two joined: leg of the equivalent wye = {y_equivalent:.4g} × reading"
        ),
    ),
    "phase": (
        ReadingConnection.PHASE_TO_STAR,
        text(
            "winding in {connection}, read from one line to the star point: leg of the equivalent wye = {y_equivalent:.4g} × reading"
        ),
    ),
}


def reading_factor(outcome: AnalysisOutcome, capture: Capture, connection: Connection, reading: str) -> PhaseFactor:
    """Return the factors on a reading, and say so. Raises CaptureError where the connection has no such points."""
    points, said = READINGS[reading]
    factor = estimated(capture, lambda: phase_factor(connection, points))
    outcome.assume(Text(said.template, {"connection": word(connection), "y_equivalent": factor.y_equivalent}))
    return factor
