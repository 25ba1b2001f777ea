"""Options of a GW Instek safety tester in a station file."""

from dataclasses import dataclass

from drivers.catalogue import Driver
from drivers.interfaces import Accuracy, Role
from drivers.recognition import ScpiIdentity


@dataclass(frozen=True)
class Gpt9800Options:
    """Settings of a GW Instek GPT-9803 or GPT-9804 as an insulation tester.

    `maximum_voltage` (V) is the station's limit. The voltage has risen after `ramp_time` (s); the object counts as
    discharged below 30 V at most `discharge_timeout` (s) after the end. `accuracy` (Ω) replaces the specification's.
    `baud_rate` (bit/s) is for a serial line.
    """

    maximum_voltage: float | None = None
    ramp_time: float = 0.1
    discharge_timeout: float = 5.0
    accuracy: Accuracy | None = None
    serial_number: str | None = None
    baud_rate: int = 115_200


#: Models of the series with an insulation test. They answer model, serial number, firmware: the maker does not name itself.
IDENTITY = ScpiIdentity((), ("GPT-9803", "GPT-9804", "GPT-9903", "GPT-9904"), unnamed="GW Instek")

GPT9800 = Driver(
    "gwinstek-gpt9800",
    Role.INSULATION_TESTER,
    Gpt9800Options,
    "drivers.gwinstek.gpt9800:GwInstekGpt9800.open",
    simulated="gwinstek-gpt9800",
    sources=(
        "the GPT-9800 Series User Manual: pages on *IDN?, *CLS and MEASure",
        "public programs for testers of the series: every command, two or more (TEST:RET: they send ON, the driver OFF)",
        "one public program each: MAIN:FUNC? and TEST:RET?",
    ),
    commands_in="drivers.gwinstek",
    recognised_by=(IDENTITY,),
)
