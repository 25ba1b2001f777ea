"""Options of a tachometer on a serial line in a station file."""

import math
from dataclasses import dataclass

from drivers.catalogue import Driver
from drivers.interfaces import Accuracy, Role
from drivers.interfaces.text import Text, text
from drivers.lutron.frame import END, LENGTH, parse_frame
from drivers.recognition import SerialTalk


@dataclass(frozen=True)
class LutronTachometerOptions:
    """Settings of a Lutron tachometer.

    `annunciator` is the two-digit code of rpm in a frame; 22 has not been compared with the maker's sheet, and a frame
    with another code is refused. `update_period` is in s, `speed_limit` (rad/s) is the largest speed the instrument can show.
    """

    model: str = "DT-2236"
    annunciator: str = "22"
    update_period: float = 1.0
    speed_limit: float = 2 * math.pi / 60 * 99_999
    accuracy: Accuracy | None = None


def _recognise(heard: bytes) -> Text | None:
    """Say what a line's instrument is by the last whole frame in what it sent."""
    for piece in reversed(heard.split(END)[:-1]):
        try:
            frame = parse_frame(piece[-(LENGTH - 1) :] + END)
        except ValueError:
            continue
        return text("a Lutron frame: {value:g}, annunciator {code}", value=frame.value, code=frame.annunciator)
    return None


TACHOMETER = Driver(
    "lutron-tachometer",
    Role.TACHOMETER,
    LutronTachometerOptions,
    "drivers.lutron.tachometer:LutronTachometer.open",
    simulated="lutron-tachometer",
    sources=(
        "the maker's page on the data stream in manuals of its sisters GC-2028, TM-946 and VB-8213 (frame, 9600 8N1: one maker)",
        "from memory, not checked: code 22 for rpm, and that a DT-2236 sends the same frame",
    ),
    commands_in="drivers.lutron",
    # It sends once a second by itself.
    recognised_by=(SerialTalk(9600, _recognise, wait=2.2),),
)
