"""Options of each VISA instrument in a station file."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from drivers.bases.crosspoints import check_channels, is_fixed_point
from drivers.bases.oscilloscope_data import OscilloscopeOptions
from drivers.bases.supply_data import ScpiSupplyOptions
from drivers.catalogue import Driver
from drivers.interfaces import Accuracy, Role
from drivers.interfaces.text import text
from drivers.recognition import ScpiIdentity

#: The maker's names over the years.
KEYSIGHT = ("keysight technologies", "agilent technologies", "keysight", "agilent")
E36300_IDENTITY = ScpiIdentity(KEYSIGHT, ("E36311A", "E36312A", "E36313A"))
E4980A_IDENTITY = ScpiIdentity(KEYSIGHT, ("E4980A",))
INFINIIVISION_IDENTITY = ScpiIdentity(
    KEYSIGHT, ("DSOX3", "MSOX3", "DSO-X 3", "MSO-X 3", "DSOX4", "MSOX4", "DSO-X 4", "MSO-X 4")
)
DMM_34461A_IDENTITY = ScpiIdentity(KEYSIGHT, ("34461A",))
SWITCH_UNIT_IDENTITY = ScpiIdentity((*KEYSIGHT, "hewlett-packard"), ("34970A", "34972A", "34980A"))


@dataclass(frozen=True)
class ImpedanceCalibration:
    """A calibrated point of an LCR meter: at `frequency` (Hz), accuracies that replace those of the data sheet.

    `resistance` is in Ω, `inductance` in H; `None` keeps the data sheet's.
    """

    frequency: float
    resistance: Accuracy | None = None
    inductance: Accuracy | None = None


@dataclass(frozen=True)
class E4980AOptions:
    """Settings of a Keysight E4980A or E4980AL.

    `maximum_frequency` (Hz) and `maximum_level` (V rms) are the station's limits; `temperature_factor` is Kt of the
    data sheet (1 between 18 and 28 °C).
    """

    serial_number: str | None = None
    maximum_frequency: float | None = None
    maximum_level: float | None = None
    temperature_factor: float = 1.0
    calibration: tuple[ImpedanceCalibration, ...] = ()


@dataclass(frozen=True)
class E36300Options(ScpiSupplyOptions):
    """Settings of one output of a Keysight E36300 series supply.

    Over-current protection switches the output off `over_current_delay` (s) after it went over to constant current, in a
    block that holds the voltage; with `trip_at_current_limit` in every block.
    """

    channel: int = 1
    over_current_delay: float = 0.05


@dataclass(frozen=True)
class Keysight34461AOptions:
    """Settings of a Keysight 34461A as a DC voltmeter.

    `calibration` replaces the data sheet's accuracy, by range (V); a range that is not in it keeps the data sheet's.
    """

    serial_number: str | None = None
    calibration: Mapping[float, Accuracy] = field(default_factory=dict)


@dataclass(frozen=True)
class Keysight34970AOptions:
    """Settings of a Keysight 34970A, 34972A or 34980A as a switch matrix.

    `crosspoints` gives the channel of each crosspoint by name; contacts have moved and stand `settling` (s) after they
    were told to. `fixed` names what is connected for good, as a current probe round a wire is (`A:channel4~`).
    Raises ValueError for a name or a channel that cannot be.
    """

    crosspoints: Mapping[str, int]
    settling: float = 0.05
    fixed: tuple[str, ...] = ()
    serial_number: str | None = None

    def __post_init__(self) -> None:
        check_channels(self.crosspoints)
        for name in self.fixed:
            if not is_fixed_point(name):
                raise ValueError(
                    text('fixed = "{name}": allowed are leads of probes and meters, like "A:channel4~"', name=name)
                )
        if not 0.0 <= self.settling <= 10.0:
            raise ValueError(text("settling = {settling:g}: allowed is 0 s to 10 s", settling=self.settling))


E36300 = Driver(
    "keysight-e36300",
    Role.SUPPLY,
    E36300Options,
    "drivers.keysight.e36300:KeysightE36300.open",
    simulated="keysight-e36313a",
    sources=(
        "Keysight's Programming Guide E36311-90008 and its relatives'",
        "public programs for E36312A and E36313A (channel lists, protection, OUTP:PAIR, OUTP:TRAC, VOLT:SENS, VOLT:MODE)",
        "libsigrok's scpi-pps for an E36312A (constant current and voltage in the condition register, ranges)",
    ),
    commands_in="drivers.keysight",
    recognised_by=(E36300_IDENTITY,),
)
E4980A = Driver(
    "keysight-e4980a",
    Role.LCR_METER,
    E4980AOptions,
    "drivers.keysight.e4980a:KeysightE4980A.open",
    simulated="keysight-e4980a",
    sources=(
        "the User's Guide E4980-90230",
        "pymeasure's agilentE4980 (function, level, trigger)",
        "public programs that set or log all of its found state; that only some pages measure, from memory, not checked",
    ),
    commands_in="drivers.keysight",
    recognised_by=(E4980A_IDENTITY,),
)
INFINIIVISION = Driver(
    "keysight-infiniivision",
    Role.OSCILLOSCOPE,
    OscilloscopeOptions,
    "drivers.keysight.infiniivision:KeysightInfiniiVision.open",
    simulated="keysight-infiniivision",
    sources=(
        "Keysight's Programmer's Guide and data sheet 5992-0140 (accuracy: one source)",
        "python-ivi's InfiniiVision base and public programs (inversion, limits, impedance, skew, trigger, acquisition)",
    ),
    commands_in="drivers.keysight",
    recognised_by=(INFINIIVISION_IDENTITY,),
)
DMM_34461A = Driver(
    "keysight-34461a",
    Role.VOLTMETER,
    Keysight34461AOptions,
    "drivers.keysight.dmm_34461a:Keysight34461A.open",
    simulated="keysight-34461a",
    sources=(
        "Keysight's Truevolt Operating and Service Guide and data sheet (accuracy: one source)",
        "public programs (auto zero, null, scaling), not all of which name their meter",
    ),
    commands_in="drivers.keysight",
    recognised_by=(DMM_34461A_IDENTITY,),
)
SWITCH_UNIT_34970A = Driver(
    "keysight-34970a",
    Role.SWITCH_MATRIX,
    Keysight34970AOptions,
    "drivers.keysight.switch_unit_34970a:Keysight34970A.open",
    simulated="keysight-34970a",
    sources=(
        "Keysight's 34970A/34972A Command Reference (ROUTe: closing, opening and their queries)",
        "public programs: SYSTem:CTYPe? 100, 200, 300 and what an empty slot replies (two), SYSTem:CPON ALL to open every relay (two)",
        "from memory, not checked: the 34980A's slots 1 … 8",
    ),
    commands_in="drivers.keysight",
    recognised_by=(SWITCH_UNIT_IDENTITY,),
)
