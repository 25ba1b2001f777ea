"""Settings that an InfiniiVision may have been left with (Programmer's Guide 3000T X-Series; python-ivi and public programs)."""

import re
from collections.abc import Mapping

from drivers.bases.found_state import WantedSetting
from drivers.bases.oscilloscope_data import Probe
from drivers.bases.oscilloscope_dialogue import channel_rows, hidden_row, trigger_row
from drivers.interfaces import ProbeKind
from drivers.interfaces.text import text


def found_settings(model: str, probes: Mapping[int, Probe]) -> tuple[WantedSetting, ...]:
    """Return the table of a model, whose last digit is its number of channels, with these probes."""
    digits = re.search(r"\d{3}(\d)", model)
    channels = int(digits[1]) if digits else max(probes, default=0)
    others = (number for number in range(1, channels + 1) if number not in probes)
    return (
        *(row for number, probe in sorted(probes.items()) for row in _channel(number, probe)),
        *(hidden_row(number) for number in others),
        WantedSetting(":ACQ:MODE?", ("RTIM",), text("a record is one of many segments"), ":ACQ:MODE {value}"),
        trigger_row(":TRIG:EDGE:COUP", "DC"),
        trigger_row(":TRIG:HFR", "0"),
        trigger_row(":TRIG:NREJ", "0"),
        WantedSetting(":TRIG:HOLD?", (), text("after a trigger, further triggers are ignored for this time (s)")),
    )


def _channel(number: int, probe: Probe) -> tuple[WantedSetting, ...]:
    head = f":CHAN{number}"
    # A current probe may want 50 Ω; what it is told as is the station's.
    passive = ("ONEM",) if probe.kind is ProbeKind.VOLTAGE else ()
    return (
        *channel_rows(number, "0"),
        WantedSetting(
            f"{head}:IMP?",
            passive,
            text("the input loads the probe, so the probe's factor is wrong"),
            remedy=text("Press the channel's key, then Imped, 1 MΩ"),
        ),
        WantedSetting(
            f"{head}:PROB:SKEW?", ("0",), text("the trace is shifted by this time (s)"), f"{head}:PROB:SKEW {{value}}"
        ),
    )
