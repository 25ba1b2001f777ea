"""The error of a measurement that cannot go on."""

from drivers.interfaces.text import Text


class ProcedureError(Exception):
    """A measurement cannot go on; the message names what was found and what to do."""

    def __init__(self, message: Text) -> None:
        self.text = message
        super().__init__(message.render())


class MotorFaultError(ProcedureError):
    """The motor, not the bench, is why there is no figure: a part is missing, dead or broken down; `part` names it."""

    def __init__(self, message: Text, part: str) -> None:
        super().__init__(message)
        self.part = part


class NotModelledError(ProcedureError):
    """A virtual bench was brought where its physics does not follow; what was read there must not be judged."""


class OnlyBoundedError(ProcedureError):
    """What was read gives no figure for `parameter`, only that it is at least `low` (in its unit, 95 %): may be enough to reject."""

    def __init__(self, message: Text, parameter: str, low: float) -> None:
        super().__init__(message)
        self.parameter = parameter
        self.low = low


class RepeatWantedError(ProcedureError):
    """The person at the bench wants the running procedure from its beginning."""


class CorrectedError(BaseException):
    """A reading typed earlier was corrected: the procedure is done over with what it was given, up to where it stands.

    Nothing in a procedure catches it, as nothing has failed.
    """
