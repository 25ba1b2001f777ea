"""Settings that a GPT-9800 may have been left with and that change an insulation test or its replies.

MANU:EDIT:MODE? and MANU:IR:REF? are asked by two public programs each; MAIN:FUNC? by one, of a tester that RS PRO sells with the same
commands, and TEST:RET? by another one: one source each. A tester that refuses these two is taken to have nothing to tell. Voltage, limits
and times are set anew for each test.
"""

import re

from drivers.bases.found_state import WantedSetting
from drivers.interfaces.text import text

_NUMBER = re.compile(r"\s*([+-]?\d+(?:\.\d*)?)\s*(?:[MG]?\s*ohm)?\s*", re.IGNORECASE | re.ASCII)

FOUND_SETTINGS = (
    # First: what belongs to insulation is told and taken in its own mode only, and that in manual tests only.
    WantedSetting("MAIN:FUNC?", ("MANU",), text("a sequence of tests is started"), "MAIN:FUNC {value}", optional=True),
    WantedSetting("MANU:EDIT:MODE?", ("IR",), text("another test is edited, and started"), "MANU:EDIT:MODE {value}"),
    WantedSetting(
        "MANU:IR:REF?",
        ("0",),
        text("a reference (MΩ) is subtracted from the resistance"),
        "MANU:IR:REF {value}",
        remedy=text("Set REF to 0 at the tester"),
    ),
    WantedSetting(
        "TEST:RET?",
        ("OFF",),
        text("results are sent without a query, and taken for other replies"),
        "TEST:RET {value}",
        optional=True,
    ),
)


def plain(reply: str) -> str:
    """Return what a setting takes of its answer: a number without its unit, or the word ("TEST:RETURN ON", "AUTO MODE")."""
    number = _NUMBER.fullmatch(reply)
    if number is not None:
        return f"{float(number[1]):g}"
    words = [word for word in reply.upper().split() if word != "MODE"]
    return words[-1] if words else ""
