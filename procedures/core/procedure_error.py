"""The error of a measurement that cannot go on."""

from drivers.interfaces.text import Text


class ProcedureError(Exception):
    """A measurement cannot go on; the message names what was found and what to do."""

    def __init__(self, message: Text) -> None:
        self.text = message
        super().__init__(message.render())
