"""The drivers by the names that station files use; importing this imports no transport library."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

from drivers.cia402.options import Cia402Options, Cia402RotorActuatorOptions, Cia402SixStepOptions
from drivers.delta.options import DeltaDyn200Options
from drivers.interfaces import (
    UNWATCHED,
    BldcDrive,
    Calls,
    Clock,
    Dynamometer,
    Instrument,
    InsulationTester,
    Inverter,
    LcrMeter,
    Oscilloscope,
    Role,
    RotorActuator,
    Supply,
    SwitchMatrix,
    Tachometer,
    Traffic,
    Voltmeter,
)
from drivers.keysight.options import (
    E4980AOptions,
    E36300Options,
    Gpt9800Options,
    InfiniiVisionOptions,
    Keysight34461AOptions,
    Keysight34970AOptions,
)
from drivers.lutron.options import LutronTachometerOptions
from drivers.manual.drive import ManualDrive
from drivers.manual.dynamometer import ManualDynamometer
from drivers.manual.inverter import ManualInverter
from drivers.manual.lcr_meter import ManualLcrMeter
from drivers.manual.options import (
    ManualDriveOptions,
    ManualDynamometerOptions,
    ManualInverterOptions,
    ManualLcrMeterOptions,
    ManualOscilloscopeOptions,
    ManualSupplyOptions,
    ManualTachometerOptions,
    ManualVoltmeterOptions,
)
from drivers.manual.oscilloscope import ManualOscilloscope
from drivers.manual.prompt import Prompt
from drivers.manual.supply import ManualSupply
from drivers.manual.tachometer import ManualTachometer
from drivers.manual.voltmeter import ManualVoltmeter
from drivers.transport.can.buses import CanBuses
from drivers.transport.in_process import InProcess

if TYPE_CHECKING:
    from pyvisa import ResourceManager

    from drivers.cia402.opening import Opener

MANUAL = "manual"
#: How long (s) an energised instrument may take to answer unless its driver or the station says otherwise.
REPLY_TIME = 0.6
OptionsT = TypeVar("OptionsT")
InstrumentT = TypeVar("InstrumentT")


@dataclass(frozen=True)
class Surroundings:
    """What drivers are handed: the bench's clock, and for those that need it a VISA manager or a way to the person.

    `visa` is called when the first VISA instrument is opened, so that a bench without one needs no VISA. `calls` watches over each
    exchange. Instruments on one CAN bus that are handed the same `can_buses` share the connection to it. `in_process` opens
    the addresses of instruments that this process itself plays. With `guarding`, a second process holds the connection for
    the way down only: nothing that the first one could notice is asked when it is opened.
    """

    clock: Clock
    visa: "Callable[[], ResourceManager] | None" = None
    prompt: Prompt | None = None
    traffic: Traffic | None = None
    calls: Calls = UNWATCHED
    can_buses: CanBuses = field(default_factory=CanBuses)
    in_process: InProcess | None = None
    guarding: bool = False

    def manager(self) -> "ResourceManager":
        """Return the VISA manager; raises ValueError where none was handed in."""
        if self.visa is None:
            raise ValueError("a VISA instrument needs a VISA resource manager")
        return self.visa()

    def person(self) -> Prompt:
        """Return the way to the person; raises ValueError where none was handed in."""
        if self.prompt is None:
            raise ValueError("a manual instrument needs a person to ask")
        return self.prompt


#: Opens an instrument, as the one of a name, at an address, which one worked by hand has not.
_Opened = Callable[[str, Any, Surroundings, str], InstrumentT]


@dataclass(frozen=True)
class Driver:
    """One driver in one role: its options' class, how it is opened, and how long (s) its instrument may take to answer while it is
    energised.
    """

    name: str
    role: Role
    options: type[Any]
    needs_address: bool
    opener: _Opened[Instrument]
    reply_time: float = REPLY_TIME

    def open(self, address: str, options: object, surroundings: Surroundings, *, name: str = "") -> Instrument:
        """Open the instrument at an address; `name` stands for it in messages, its role when empty.

        Raises TypeError for options of another driver, and what the driver's own opener raises.
        """
        if not isinstance(options, self.options):
            raise TypeError(f"{self.name} takes {self.options.__name__}, not {type(options).__name__}")
        return self.opener(address, options, surroundings, name or self.role.value)


def drivers_for(role: Role) -> tuple[str, ...]:
    """Return the names of the drivers that can fill a role."""
    return tuple(driver.name for driver in DRIVERS if driver.role is role)


def find(name: str, role: Role) -> Driver:
    """Return the driver of a name for a role; raises KeyError naming those there are."""
    for driver in DRIVERS:
        if driver.name == name and driver.role is role:
            return driver
    raise KeyError(f"no driver '{name}' for {role.value}; there are {', '.join(drivers_for(role))}")


def _open_e4980a(address: str, options: E4980AOptions, given: Surroundings, name: str) -> LcrMeter:
    from drivers.keysight.e4980a import open_keysight_e4980a

    return open_keysight_e4980a(
        address, given.manager(), given.clock, options, name=name, traffic=given.traffic, calls=given.calls
    )


def _open_e36300(address: str, options: E36300Options, given: Surroundings, name: str) -> Supply:
    from drivers.keysight.e36300 import open_keysight_e36300

    return open_keysight_e36300(
        address,
        given.manager(),
        given.clock,
        options,
        name=name,
        traffic=given.traffic,
        calls=given.calls,
        guarding=given.guarding,
    )


def _open_infiniivision(address: str, options: InfiniiVisionOptions, given: Surroundings, name: str) -> Oscilloscope:
    from drivers.keysight.infiniivision import open_keysight_infiniivision

    return open_keysight_infiniivision(
        address, given.manager(), given.clock, options, name=name, traffic=given.traffic, calls=given.calls
    )


def _open_delta_dyn200(address: str, options: DeltaDyn200Options, given: Surroundings, name: str) -> Dynamometer:
    from drivers.delta.dynamometer import open_delta_dyn200

    return open_delta_dyn200(
        address,
        given.clock,
        options,
        name=name,
        traffic=given.traffic,
        calls=given.calls,
        in_process=given.in_process,
        guarding=given.guarding,
    )


def _open_lutron(address: str, options: LutronTachometerOptions, given: Surroundings, name: str) -> Tachometer:
    from drivers.lutron.tachometer import open_lutron_tachometer

    return open_lutron_tachometer(
        address, given.clock, options, name=name, traffic=given.traffic, calls=given.calls, in_process=given.in_process
    )


def _on_can(
    opener: "Opener[OptionsT, InstrumentT]", address: str, options: OptionsT, given: Surroundings, name: str
) -> "InstrumentT":
    return opener(
        address,
        given.clock,
        options,
        name=name,
        traffic=given.traffic,
        calls=given.calls,
        buses=given.can_buses,
        guarding=given.guarding,
    )


def _open_cia402(address: str, options: Cia402Options, given: Surroundings, name: str) -> Inverter:
    from drivers.cia402.inverter import open_cia402_inverter

    return _on_can(open_cia402_inverter, address, options, given, name)


def _open_six_step(address: str, options: Cia402SixStepOptions, given: Surroundings, name: str) -> BldcDrive:
    from drivers.cia402.six_step import open_cia402_six_step

    return _on_can(open_cia402_six_step, address, options, given, name)


def _open_34461a(address: str, options: Keysight34461AOptions, given: Surroundings, name: str) -> Voltmeter:
    from drivers.keysight.dmm_34461a import open_keysight_34461a

    return open_keysight_34461a(
        address, given.manager(), given.clock, options, name=name, traffic=given.traffic, calls=given.calls
    )


def _open_34970a(address: str, options: Keysight34970AOptions, given: Surroundings, name: str) -> SwitchMatrix:
    from drivers.keysight.switch_unit_34970a import open_keysight_34970a

    return open_keysight_34970a(
        address,
        given.manager(),
        given.clock,
        options,
        name=name,
        traffic=given.traffic,
        calls=given.calls,
        guarding=given.guarding,
    )


def _open_rotor_actuator(
    address: str, options: Cia402RotorActuatorOptions, given: Surroundings, name: str
) -> RotorActuator:
    from drivers.cia402.rotor_actuator import open_cia402_rotor_actuator

    return _on_can(open_cia402_rotor_actuator, address, options, given, name)


def _open_gpt9800(address: str, options: Gpt9800Options, given: Surroundings, name: str) -> InsulationTester:
    from drivers.gwinstek.gpt9800 import open_gwinstek_gpt9800

    return open_gwinstek_gpt9800(
        address,
        given.manager(),
        given.clock,
        options,
        name=name,
        traffic=given.traffic,
        calls=given.calls,
        guarding=given.guarding,
    )


def _by_hand(make: Callable[..., InstrumentT]) -> _Opened[InstrumentT]:
    def opened(_: str, options: object, given: Surroundings, name: str) -> InstrumentT:
        return make(given.person(), given.clock, options, name=name)

    return opened


_manual_supply: _Opened[Supply] = _by_hand(ManualSupply)
_manual_lcr_meter: _Opened[LcrMeter] = _by_hand(ManualLcrMeter)
_manual_oscilloscope: _Opened[Oscilloscope] = _by_hand(ManualOscilloscope)
_manual_dynamometer: _Opened[Dynamometer] = _by_hand(ManualDynamometer)
_manual_tachometer: _Opened[Tachometer] = _by_hand(ManualTachometer)
_manual_inverter: _Opened[Inverter] = _by_hand(ManualInverter)
_manual_voltmeter: _Opened[Voltmeter] = _by_hand(ManualVoltmeter)
_manual_drive: _Opened[BldcDrive] = _by_hand(ManualDrive)

DRIVERS: tuple[Driver, ...] = (
    Driver("keysight-e36300", Role.SUPPLY, E36300Options, True, _open_e36300),
    Driver("keysight-e4980a", Role.LCR_METER, E4980AOptions, True, _open_e4980a),
    Driver("keysight-infiniivision", Role.OSCILLOSCOPE, InfiniiVisionOptions, True, _open_infiniivision),
    Driver("delta-dyn200", Role.DYNAMOMETER, DeltaDyn200Options, True, _open_delta_dyn200),
    Driver("lutron-tachometer", Role.TACHOMETER, LutronTachometerOptions, True, _open_lutron),
    Driver("cia402-inverter", Role.INVERTER, Cia402Options, True, _open_cia402),
    Driver("cia402-six-step", Role.DRIVE, Cia402SixStepOptions, True, _open_six_step),
    Driver("keysight-34461a", Role.VOLTMETER, Keysight34461AOptions, True, _open_34461a),
    Driver("keysight-34970a", Role.SWITCH_MATRIX, Keysight34970AOptions, True, _open_34970a),
    Driver("cia402-rotor-actuator", Role.ROTOR_ACTUATOR, Cia402RotorActuatorOptions, True, _open_rotor_actuator),
    Driver("gwinstek-gpt9800", Role.INSULATION_TESTER, Gpt9800Options, True, _open_gpt9800),
    Driver(MANUAL, Role.SUPPLY, ManualSupplyOptions, False, _manual_supply),
    Driver(MANUAL, Role.LCR_METER, ManualLcrMeterOptions, False, _manual_lcr_meter),
    Driver(MANUAL, Role.OSCILLOSCOPE, ManualOscilloscopeOptions, False, _manual_oscilloscope),
    Driver(MANUAL, Role.DYNAMOMETER, ManualDynamometerOptions, False, _manual_dynamometer),
    Driver(MANUAL, Role.TACHOMETER, ManualTachometerOptions, False, _manual_tachometer),
    Driver(MANUAL, Role.INVERTER, ManualInverterOptions, False, _manual_inverter),
    Driver(MANUAL, Role.VOLTMETER, ManualVoltmeterOptions, False, _manual_voltmeter),
    Driver(MANUAL, Role.DRIVE, ManualDriveOptions, False, _manual_drive),
)
