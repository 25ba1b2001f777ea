"""A rated current that the bench's instruments do not resolve: a slip in the motor file, not a fault of the wiring."""

from drivers.interfaces.text import Text, text
from procedures.core.procedure_error import ProcedureError
from procedures.estimation.fitting.intervals import Interval


def require_resolved(rated_current: float, read: Interval, instrument: Text) -> None:
    """Raise ProcedureError where a reading of current (A, within its limits of error) does not tell the rated current from none."""
    limit = 0.5 * (read.high - read.low)
    if rated_current < limit:
        raise below_resolution(rated_current, limit, instrument)


def below_resolution(rated_current: float, limit: float, instrument: Text) -> ProcedureError:
    """Return the error for a rated current (A) below what an instrument resolves (A)."""
    return ProcedureError(
        text(
            "the rated current is {rated:.3g} A, below what the {instrument} can resolve ({limit:.2g} A). Correct rated_current under "
            "[nameplate] in the motor file (A, phase, peak), or use an instrument for such currents",
            rated=rated_current,
            instrument=instrument,
            limit=limit,
        )
    )
