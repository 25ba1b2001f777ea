"""Messages of a procedure that gives figures from the data taken before it ended early."""

from typing import Any

from drivers.interfaces.text import Text, text
from procedures.core.procedure import Procedure


def tell_ended(procedure: Procedure[Any], why: Text, what: Text) -> None:
    """Say why it was left, and what its figures are of."""
    procedure.notice("ended-early", text("it was stopped before its end: {why}; {what}", why=why, what=what))
