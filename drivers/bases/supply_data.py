"""Data of a SCPI power supply: its commands, its ratings, and the options of a station."""

from dataclasses import dataclass

from drivers.interfaces import Accuracy


@dataclass(frozen=True)
class SupplyCommands:
    """Headers of a supply's commands; a query is the header with a question mark.

    `over_voltage` takes a level (V), `over_current` ON or OFF; the two that tell a trip answer 0 where there is none. An
    empty header is a protection that the supply has not. `channel` is appended to every command, as `(@1)` or `CH1` is.
    `remote` lets a program set the supply and is sent when it is opened, `local` gives the front panel back when it is closed.
    """

    voltage: str = "VOLT"
    current: str = "CURR"
    output: str = "OUTP"
    measure_voltage: str = "MEAS:VOLT"
    measure_current: str = "MEAS:CURR"
    over_voltage: str = "VOLT:PROT"
    over_current: str = "CURR:PROT:STAT"
    over_voltage_tripped: str = "VOLT:PROT:TRIP"
    over_current_tripped: str = "CURR:PROT:TRIP"
    clear: str = "OUTP:PROT:CLE"
    channel: str = ""
    remote: str = ""
    local: str = ""


@dataclass(frozen=True)
class SupplyData:
    """Ratings of an output: highest voltage (V), current (A) and over-voltage level (V), accuracies of its meters."""

    maximum_voltage: float
    maximum_current: float
    maximum_over_voltage: float
    voltage: Accuracy
    current: Accuracy


@dataclass(frozen=True)
class ScpiSupplyOptions:
    """Settings of a supply: the station's limits (V, A), its protections, and accuracies that replace the data sheet's.

    Over-voltage protection stands `over_voltage_margin` (relative) plus `over_voltage_headroom` (V) above the voltage level.
    """

    serial_number: str | None = None
    maximum_voltage: float | None = None
    maximum_current: float | None = None
    over_voltage_margin: float = 0.1
    over_voltage_headroom: float = 0.5
    trip_at_current_limit: bool = False
    voltage_accuracy: Accuracy | None = None
    current_accuracy: Accuracy | None = None
