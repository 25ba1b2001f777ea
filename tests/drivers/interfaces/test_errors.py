"""What an instrument's error says."""

from drivers.interfaces import InstrumentError
from drivers.interfaces.text import text


def test_what_to_do_is_said_once_also_where_an_error_holds_another() -> None:
    remedy = text("Check power and cable")
    first = InstrumentError("supply", "no answer", remedy=remedy)
    outer = InstrumentError("the bench", text("the supply is lost ({error})", error=first), remedy=remedy)
    assert str(outer) == "the bench: the supply is lost (supply: no answer. Check power and cable)"
    assert str(InstrumentError("supply", "no answer", remedy=remedy)) == "supply: no answer. Check power and cable"
