"""Parts that the three methods for L_d and L_q share."""

from drivers.interfaces.text import text
from procedures.core.actions import Connect, Socket
from procedures.core.bench import ProcedureError
from procedures.estimation.winding.connections import ReadingConnection


def connection_of(action: Connect) -> ReadingConnection:
    """Return how a meter that is connected by this action reads the motor."""
    sockets = list(action.complete().values())
    highs, lows = sockets.count(Socket.METER_HIGH), sockets.count(Socket.METER_LOW)
    if (highs, lows) == (1, 1):
        return ReadingConnection.LINE_TO_LINE
    if (highs, lows) in ((1, 2), (2, 1)):
        return ReadingConnection.SERIES_PARALLEL
    raise ProcedureError(
        text(
            "the meter's high lead is on {highs} terminals and its low lead on {lows}: this gives no reading",
            highs=highs,
            lows=lows,
        )
    )


def require(reading: ReadingConnection, wanted: ReadingConnection) -> None:
    """Refuse a reading that was taken on another connection than the step draws (E2)."""
    if reading is not wanted:
        raise ProcedureError(
            text(
                "this step needs a reading of connection {wanted}, this one was taken on {given}: after aligning B to C the "
                "d axis lies along B–C, so only A against B and C together shows the q axis",
                wanted=wanted.name,
                given=reading.name,
            )
        )
