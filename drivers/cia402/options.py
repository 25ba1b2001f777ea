"""Options of drives with the CiA 402 profile in a station file."""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Any, ClassVar

from drivers.catalogue import Driver
from drivers.cia402.data_sheet import check_data_sheet
from drivers.cia402.stated_objects import StatedObject
from drivers.cia402.velocity_unit import stated_unit
from drivers.interfaces import Accuracy, InverterAbility, Role, Watchdog, WhenSilent
from drivers.interfaces.text import text
from drivers.recognition import CanOpenProfile

#: What the power states, the mode and the actual velocity are read and set by.
_EVERY_DRIVE = (0x1000, 0x1018, 0x6040, 0x6041, 0x6060, 0x6061)
_PROFILE_SOURCES = (
    "user units, torque and status bits as Nanotec's, Synapticon's, Beckhoff's and ABB's object descriptions have them; the rest "
    "of CiA 301 and CiA 402-2 from memory, not checked",
    "data sheets of Elmo Gold, Elmo SimplIQ and Yiyou EuServo drives (objects, types, access, defaults)",
)


@dataclass(frozen=True)
class CanInterlockOptions:
    """A contact as a bit of a frame that is sent again and again: identifier of the `frame`, `byte` and `bit` from 0.

    `closed` is the level of a closed contact, `extended` a 29-bit identifier; a frame that has stayed away for `timeout`
    (s) counts as an open contact.
    """

    frame: int
    byte: int
    bit: int
    closed: bool = True
    extended: bool = False
    timeout: float = 0.25


@dataclass(frozen=True, kw_only=True)
class NodeOptions:
    """Settings that all such drives have; times are in s.

    A transition of the power states may take `transition_timeout`; the drive is asked every `poll_interval`.
    A drive that has a heartbeat consumer (0x1016) is set to switch its voltage off (0x6007, where it has that) once this
    process, as node `heartbeat_node`, has been silent for `heartbeat_time`; 0 sets nothing. `velocity_unit` is one count of a
    velocity, for a drive that does not say it ("0.1 rpm", "counts/s"; "Hz" is electrical), `increments_per_turn` its encoder's
    resolution in place of 0x608F. With `process_data` what is measured is mapped into its PDOs, where it lets them be mapped.
    `eds` is the file of the drive's electronic data sheet, in which the objects that are needed are looked up.
    """

    needed_objects: ClassVar[tuple[int, ...]] = _EVERY_DRIVE

    transition_timeout: float = 1.0
    poll_interval: float = 0.01
    serial_number: str | None = None
    heartbeat_time: float = 1.0
    heartbeat_node: int = 127
    velocity_unit: str = ""
    increments_per_turn: int | None = None
    process_data: bool = True
    eds: str = ""

    def __post_init__(self) -> None:
        """Raise ValueError, beginning with the key, for what cannot be."""
        if self.velocity_unit:
            try:
                stated_unit(self.velocity_unit)
            except ValueError as error:
                raise ValueError(text("velocity_unit: {error}", error=error)) from error
        for key in ("increments_per_turn", "pole_pairs"):
            number = getattr(self, key, None)
            if number is not None and number < 1:
                raise ValueError(text("{key} = {number} must be 1 or more", key=key, number=number))
        for key, stated in self.stated_objects():
            stated.check(key)
        if self.eds:
            check_data_sheet(self.eds, (*self.needed_objects, *(stated.index for _, stated in self.stated_objects())))

    def stated_objects(self) -> Iterator[tuple[str, StatedObject]]:
        """Yield the objects that the station states, each with its key."""
        values: list[tuple[str, Any]] = [(field.name, getattr(self, field.name)) for field in fields(self)]
        yield from ((key, value) for key, value in values if isinstance(value, StatedObject))

    @property
    def watchdog(self) -> Watchdog | None:
        """Watchdog asked of the drive, where it has a heartbeat consumer."""
        return Watchdog(self.heartbeat_time, WhenSilent.VOLTAGE_OFF, "0x1016, 0x6007") if self.heartbeat_time else None


@dataclass(frozen=True)
class Cia402Options(NodeOptions):
    """Settings of an inverter with the CiA 402 profile over CANopen.

    `maximum_current` (A, peak) and `maximum_frequency` (Hz) are the station's limits. `current_scale` is peak amperes
    per ampere of the drive's scale (1 for one that counts peak, √2 for rms), which no object tells: without it the drive is
    refused. `pole_pairs` are those that the drive is set up with. `rated_current` (A, the drive's scale) stands in for 0x6075.
    `field_current` is the object of the phase current in the drive's open-loop mode, which no profile has; without one it turns
    at no frequency. The ramp has ended within `frequency_tolerance` (Hz) of the target, a current has settled within
    `current_tolerance` (of rated), a quantity that comes no nearer for `settle_timeout` (s) is given up.
    """

    maximum_current: float
    maximum_frequency: float
    current_scale: float | None = None
    pole_pairs: int | None = None
    rated_current: float | None = None
    field_current: StatedObject | None = None
    frequency_tolerance: float = 0.05
    current_tolerance: float = 0.01
    settle_timeout: float = 30.0
    current_accuracy: Accuracy | None = None
    frequency_accuracy: Accuracy | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for key in ("current_scale", "rated_current"):
            value = getattr(self, key)
            if value is not None and not 0.0 < value < float("inf"):
                raise ValueError(text("{key} = {number} must be above 0", key=key, number=value))


@dataclass(frozen=True)
class Cia402SixStepOptions(NodeOptions):
    """Settings of a six-step drive with the CiA 402 profile over CANopen.

    The profile knows no block commutation at full voltage: `mode` is the maker's mode of operation for it, `bus_current` the
    object of the current out of the DC source, `hall_state` that of the Hall signals (bits 0 to 2). A reading whose object is not
    stated is refused. `pole_pairs` are those that the drive is set up with. An accuracy that is not given is assumed and named
    so: of the DC link's voltage (V) and current (A), and of the electrical frequency (Hz).
    """

    needed_objects: ClassVar[tuple[int, ...]] = (*_EVERY_DRIVE, 0x606C, 0x6079)

    mode: int | None = None
    bus_current: StatedObject | None = None
    hall_state: StatedObject | None = None
    pole_pairs: int | None = None

    voltage_accuracy: Accuracy | None = None
    current_accuracy: Accuracy | None = None
    frequency_accuracy: Accuracy | None = None


@dataclass(frozen=True)
class Cia402RotorActuatorOptions(NodeOptions):
    """Settings of a rotor actuator with the CiA 402 profile over CANopen.

    `maximum_speed` (rad/s) is the station's limit, and the speed of movements. Brake, clutch, coupling and drive have done what
    they were told within `timeout` (s).
    """

    needed_objects: ClassVar[tuple[int, ...]] = (*_EVERY_DRIVE, 0x6064, 0x606C, 0x607A, 0x6081, 0x60FD, 0x60FE, 0x60FF)

    maximum_speed: float
    timeout: float = 5.0
    angle_accuracy: Accuracy | None = None


#: CiA 402, by device type (0x1000); which of its drives it is no object tells.
PROFILE = CanOpenProfile(402)

#: What the profile's modes let an inverter do; which of them a drive has shows when they are commanded.
ABILITIES = frozenset({InverterAbility.FREQUENCY, InverterAbility.Q_CURRENT})

INVERTER = Driver(
    "cia402-inverter",
    Role.INVERTER,
    Cia402Options,
    "drivers.cia402.inverter:Cia402Inverter.open",
    simulated="cia402-inverter",
    abilities=ABILITIES,
    recognised_by=(PROFILE,),
    sources=_PROFILE_SOURCES,
    commands_in="drivers.cia402",
)
SIX_STEP = Driver(
    "cia402-six-step",
    Role.DRIVE,
    Cia402SixStepOptions,
    "drivers.cia402.six_step:Cia402SixStep.open",
    simulated="cia402-six-step",
    recognised_by=(PROFILE,),
    sources=_PROFILE_SOURCES,
    commands_in="drivers.cia402",
)
ROTOR_ACTUATOR = Driver(
    "cia402-rotor-actuator",
    Role.ROTOR_ACTUATOR,
    Cia402RotorActuatorOptions,
    "drivers.cia402.rotor_actuator:Cia402RotorActuator.open",
    simulated="cia402-rotor-actuator",
    recognised_by=(PROFILE,),
    sources=_PROFILE_SOURCES,
    commands_in="drivers.cia402",
)
