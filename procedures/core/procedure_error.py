"""The error of a measurement that cannot go on."""

from drivers.interfaces.text import Text


class ProcedureError(Exception):
    """A measurement cannot continue; the message says what was found and what to do."""

    def __init__(self, message: Text) -> None:
        self.text = message
        super().__init__(message.render())


class MotorFaultError(ProcedureError):
    """There is no figure because of a defect of the motor, not of the bench; `part` names the part that is missing or defective."""

    def __init__(self, message: Text, part: str) -> None:
        super().__init__(message)
        self.part = part


class NotModelledError(ProcedureError):
    """The virtual bench is in a state that it does not model; readings from this state must not be evaluated."""


class OnlyBoundedError(ProcedureError):
    """The readings give no figure for `parameter`, only a lower bound `low` (in its unit, 95 %), which may be enough to reject."""

    def __init__(self, message: Text, parameter: str, low: float) -> None:
        super().__init__(message)
        self.parameter = parameter
        self.low = low


class RepeatRequestedError(ProcedureError):
    """The person at the bench wants to repeat the running procedure from its beginning."""


class CorrectedError(BaseException):
    """A reading typed earlier was corrected: the procedure is calculated again with its readings, up to the present point.

    Nothing in a procedure catches it, as nothing has failed.
    """
