"""What a station file may say about drives with the CiA 402 profile."""

from dataclasses import dataclass

from drivers.catalogue import Driver
from drivers.interfaces import Accuracy, Role, Watchdog, WhenSilent
from drivers.recognition import CanOpenProfile


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
    process, as node `heartbeat_node`, has been silent for `heartbeat_time`; 0 sets nothing.
    """

    transition_timeout: float = 1.0
    poll_interval: float = 0.01
    serial_number: str | None = None
    heartbeat_time: float = 1.0
    heartbeat_node: int = 127

    @property
    def watchdog(self) -> Watchdog | None:
        """What the drive is asked to watch, where it has a heartbeat consumer."""
        return Watchdog(self.heartbeat_time, WhenSilent.VOLTAGE_OFF, "0x1016, 0x6007") if self.heartbeat_time else None


@dataclass(frozen=True)
class Cia402Options(NodeOptions):
    """Settings of an inverter with the CiA 402 profile over CANopen.

    `maximum_current` (A, peak) and `maximum_frequency` (Hz) are the station's limits. `current_scale` is peak amperes
    per ampere of the drive's scale (√2 for a drive that counts rms). The ramp has ended within `frequency_tolerance`
    (Hz) of the target, a current has settled within `current_tolerance` (of rated), at most `settle_timeout` (s) later.
    """

    maximum_current: float
    maximum_frequency: float
    current_scale: float = 1.0
    frequency_tolerance: float = 0.05
    current_tolerance: float = 0.01
    settle_timeout: float = 30.0
    current_accuracy: Accuracy | None = None
    frequency_accuracy: Accuracy | None = None


@dataclass(frozen=True)
class Cia402SixStepOptions(NodeOptions):
    """Settings of a six-step drive with the CiA 402 profile over CANopen.

    An accuracy that is not given is assumed and named so: of the DC link's voltage (V) and current (A), and of the
    electrical frequency (Hz).
    """

    voltage_accuracy: Accuracy | None = None
    current_accuracy: Accuracy | None = None
    frequency_accuracy: Accuracy | None = None


@dataclass(frozen=True)
class Cia402RotorActuatorOptions(NodeOptions):
    """Settings of a rotor actuator with the CiA 402 profile over CANopen.

    `maximum_speed` (rad/s) is the station's limit, and the speed of movements. `increments_per_turn` replaces what the
    drive says (0x608F). Brake, clutch, coupling and drive have done what they were told within `timeout` (s).
    """

    maximum_speed: float
    increments_per_turn: int | None = None
    timeout: float = 5.0
    angle_accuracy: Accuracy | None = None


#: CiA 402, by device type (0x1000); which of its drives it is no object tells.
PROFILE = CanOpenProfile(402)

INVERTER = Driver(
    "cia402-inverter",
    Role.INVERTER,
    Cia402Options,
    "drivers.cia402.inverter:Cia402Inverter.open",
    simulated="cia402-inverter",
    recognised_by=(PROFILE,),
)
SIX_STEP = Driver(
    "cia402-six-step",
    Role.DRIVE,
    Cia402SixStepOptions,
    "drivers.cia402.six_step:Cia402SixStep.open",
    simulated="cia402-six-step",
    recognised_by=(PROFILE,),
)
ROTOR_ACTUATOR = Driver(
    "cia402-rotor-actuator",
    Role.ROTOR_ACTUATOR,
    Cia402RotorActuatorOptions,
    "drivers.cia402.rotor_actuator:Cia402RotorActuator.open",
    simulated="cia402-rotor-actuator",
    recognised_by=(PROFILE,),
)
