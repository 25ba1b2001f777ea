"""Settings that an E4980A may have been left with (User's Guide E4980-90230; public programs, its set-up strings in them).

That it measures on some pages only is in two public programs, which go from MEAS SETUP to MEAS DISPLAY before they trigger.
"""

from drivers.bases.found_state import WantedSetting
from drivers.interfaces.text import text

_TRIGGER = text("a trigger is ignored, and the reading is the previous one")
_BIAS = WantedSetting("BIAS:STAT?", ("0",), text("a DC bias drives current through the winding"), "BIAS:STAT {value}")


def found_settings(*, has_bias: bool) -> tuple[WantedSetting, ...]:
    """Return the table; only a bridge that `has_bias` is asked for its DC bias."""
    deviation = text("readings are differences from a reference")
    return (
        WantedSetting(
            "DISP:PAGE?",
            ("MEAS", "BNUM"),
            text("another page measures a list, or nothing"),
            "DISP:PAGE {value}",
            text("Press [Display Format], then MEAS DISPLAY"),
            busy=("LIST",),
        ),
        WantedSetting("TRIG:SOUR?", ("BUS",), _TRIGGER, "TRIG:SOUR {value}"),
        WantedSetting("INIT:CONT?", ("1",), _TRIGGER, "INIT:CONT {value}"),
        WantedSetting("FUNC:DEV1:MODE?", ("OFF", "0"), deviation, "FUNC:DEV1:MODE {value}"),
        WantedSetting("FUNC:DEV2:MODE?", ("OFF", "0"), deviation, "FUNC:DEV2:MODE {value}"),
        WantedSetting("AMPL:ALC?", ("0",), text("the level at the winding is not the one set"), "AMPL:ALC {value}"),
        WantedSetting(
            "CORR:OPEN:STAT?",
            ("0",),
            text("an open correction of another fixture is applied"),
            "CORR:OPEN:STAT {value}",
        ),
        WantedSetting(
            "CORR:LOAD:STAT?", ("0",), text("a load correction of another fixture is applied"), "CORR:LOAD:STAT {value}"
        ),
        WantedSetting("CORR:LENG?", (), text("readings are corrected for cables of this length (m)")),
        *((_BIAS,) if has_bias else ()),
    )
