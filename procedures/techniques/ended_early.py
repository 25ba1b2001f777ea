"""What a procedure says that makes figures of what it had taken before it was left."""

from typing import Any

from drivers.interfaces.text import Text, text
from procedures.core.procedure import Procedure


def tell_ended(procedure: Procedure[Any], why: Text, what: Text) -> None:
    """Say why it was left, and what its figures are of."""
    procedure.notice("ended-early", text("it was stopped before its end: {why}; {what}", why=why, what=what))
