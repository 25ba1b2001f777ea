"""The error of a measurement that cannot go on."""

from drivers.interfaces.text import Text


class ProcedureError(Exception):
    """A measurement cannot go on; the message names what was found and what to do."""

    def __init__(self, message: Text) -> None:
        self.text = message
        super().__init__(message.render())


class RepeatWantedError(ProcedureError):
    """The person at the bench wants the running procedure from its beginning."""


class CorrectedError(BaseException):
    """A reading typed earlier was corrected: the procedure is done over with what it was given, up to where it stands.

    Nothing in a procedure catches it, as nothing has failed.
    """
