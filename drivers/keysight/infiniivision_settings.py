"""What an InfiniiVision may have been left with (Programmer's Guide 3000T X-Series; python-ivi and public programs)."""

import re
from collections.abc import Mapping

from drivers.bases.found_state import WantedSetting
from drivers.bases.oscilloscope_data import Probe
from drivers.interfaces import ProbeKind
from drivers.interfaces.text import text

_EDGES = text("the trigger does not see the edge as it is")
_MEMORY = text("another channel takes half of the memory")


def found_settings(model: str, probes: Mapping[int, Probe]) -> tuple[WantedSetting, ...]:
    """Return the table of a model, whose last digit is its number of channels, with these probes."""
    digits = re.search(r"\d{3}(\d)", model)
    channels = int(digits[1]) if digits else max(probes, default=0)
    others = (number for number in range(1, channels + 1) if number not in probes)
    return (
        *(row for number, probe in sorted(probes.items()) for row in _channel(number, probe)),
        *(WantedSetting(f":CHAN{number}:DISP?", ("0",), _MEMORY, f":CHAN{number}:DISP {{value}}") for number in others),
        WantedSetting(":ACQ:MODE?", ("RTIM",), text("a record is one of many segments"), ":ACQ:MODE {value}"),
        WantedSetting(":TRIG:EDGE:COUP?", ("DC",), _EDGES, ":TRIG:EDGE:COUP {value}"),
        WantedSetting(":TRIG:HFR?", ("0",), _EDGES, ":TRIG:HFR {value}"),
        WantedSetting(":TRIG:NREJ?", ("0",), _EDGES, ":TRIG:NREJ {value}"),
        WantedSetting(":TRIG:HOLD?", (), text("no trigger is taken for this time (s) after one")),
    )


def _channel(number: int, probe: Probe) -> tuple[WantedSetting, ...]:
    head = f":CHAN{number}"
    # A current probe may want 50 Ω; what it is told as is the station's.
    passive = ("ONEM",) if probe.kind is ProbeKind.VOLTAGE else ()
    return (
        WantedSetting(f"{head}:INV?", ("0",), text("the trace has the other sign"), f"{head}:INV {{value}}"),
        WantedSetting(f"{head}:BWL?", ("0",), text("edges are rounded off"), f"{head}:BWL {{value}}"),
        WantedSetting(
            f"{head}:IMP?",
            passive,
            text("the input loads the probe, and its factor is another"),
            remedy=text("Press the channel's key, then Imped, 1 MΩ"),
        ),
        WantedSetting(
            f"{head}:PROB:SKEW?", ("0",), text("the trace is shifted by this time (s)"), f"{head}:PROB:SKEW {{value}}"
        ),
    )
