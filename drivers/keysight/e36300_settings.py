"""Settings that an E36300 may have been left with (Programming Guide E36311-90008; public programs for E36312A and E36313A).

The E36311A has no pairing, lists or remote sense: what a model refuses to tell it has not.
"""

from drivers.bases.found_state import WantedSetting
from drivers.interfaces.text import text

_LIST = text("a list or a step sets the output instead of the level")


def found_settings(channel: str) -> tuple[WantedSetting, ...]:
    """Return the table of one output; `channel` is its channel list."""
    return (
        WantedSetting(
            "OUTP:PAIR?",
            ("OFF", "0"),
            text("two outputs in series or in parallel: voltage or current at the motor is twice the one set"),
            remedy=text("Press [Output Settings], then Pair Off, with all outputs off"),
            optional=True,
        ),
        WantedSetting(
            "OUTP:TRAC?",
            ("0", "OFF"),
            text("outputs 2 and 3 follow each other"),
            remedy=text("Press [Output Settings], then Tracking Off, with all outputs off"),
            optional=True,
        ),
        WantedSetting(f"VOLT:MODE? {channel}", ("FIX",), _LIST, f"VOLT:MODE {{value}},{channel}", optional=True),
        WantedSetting(f"CURR:MODE? {channel}", ("FIX",), _LIST, f"CURR:MODE {{value}},{channel}", optional=True),
        WantedSetting(
            f"VOLT:SENS? {channel}",
            (),
            text("EXT regulates and measures at the sense terminals, which must be wired"),
            optional=True,
        ),
    )
