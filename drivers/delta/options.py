"""Options of each Modbus instrument in a station file."""

from dataclasses import dataclass
from typing import Literal

from drivers.catalogue import Driver
from drivers.delta.recognition import DRIVE, TRANSDUCER
from drivers.interfaces import Accuracy, Role, Watchdog, WhenSilent


@dataclass(frozen=True)
class ModbusInterlockOptions:
    """A contact on an input module: which `input` (a coil or a discrete input), by its `number` from 0, of which `unit`.

    `closed` is the level of a closed contact; a module that has not answered for `timeout` (s) counts as an open one.
    """

    number: int
    input: Literal["discrete_input", "coil"] = "discrete_input"
    unit: int = 1
    closed: bool = True
    timeout: float = 0.25

    @property
    def units(self) -> tuple[int, ...]:
        """The units that it is made of."""
        return (self.unit,)


@dataclass(frozen=True)
class BeckhoffRelayOptions:
    """A relay on a Beckhoff Bus Coupler: `output` is its number among the coupler's digital outputs, from 0, of `unit`.

    The coupler takes all its outputs off once it has not been written to for `watchdog_time` (s); a request that is not
    answered within `timeout` (s) has failed.
    """

    output: int = 0
    unit: int = 1
    watchdog_time: float = 1.0
    timeout: float = 0.25

    @property
    def units(self) -> tuple[int, ...]:
        """The unit that it is."""
        return (self.unit,)

    @property
    def watchdog(self) -> Watchdog:
        """The coupler's watchdog, as it is armed before the relay picks up."""
        return Watchdog(self.watchdog_time, WhenSilent.CONTACT_OPENS, "0x1120, 0x1122")


def communication_watchdog(time: float) -> Watchdog | None:
    """Return the watchdog of a C2000 by its communication time-out (s), None where that is 0."""
    return Watchdog(time, WhenSilent.COAST, "09-02, 09-03") if time else None


@dataclass(frozen=True)
class DeltaDyn200Options:
    """Settings of a dynamometer made of a Delta C2000 drive and a DYN-200 transducer on one Modbus line.

    `pole_pairs` and `rated_torque` (N·m) are the dynamometer machine's; `maximum_speed` (rad/s) and
    `maximum_torque` (N·m, the rated one when not given) the station's limits. A speed counts as settled within
    `speed_tolerance` (relative; slip of an induction machine counts) of the command once readings `settle_interval`
    (s) apart agree within `speed_stability` (relative). The transducer's speed has no sign: `direction_from` takes it from
    what the drive was told, or from the sign of torque and power, for a sensor whose power is known to have one.
    `torque_inverted` is the sensor's parameter 12 as its mounting wants it. `speed_decimals` stands in for the register of
    a sensor that has none (or a wrong one), `power_step` (W a count of 04H) for what the bench else finds by itself.
    `drive_code` refuses another drive than the one with this parameter 00-00.
    `speed_filter` and `torque_filter` (s) are the time constants of first-order filters behind the sensor's own short mean.
    `transducer_range` (N·m) is the transducer's full scale, the rated torque when not given. Once this process has
    been silent for `watchdog_time` (s) the drive coasts to a stop; 0 sets nothing.
    """

    maximum_speed: float
    rated_torque: float = 5.0
    maximum_torque: float | None = None
    pole_pairs: int = 2
    drive_unit: int = 1
    transducer_unit: int = 2
    transducer_range: float | None = None
    torque_accuracy: Accuracy | None = None
    speed_accuracy: Accuracy | None = None
    speed_filter: float = 0.0
    torque_filter: float = 0.0
    speed_tolerance: float = 0.05
    speed_stability: float = 2e-3
    settle_interval: float = 0.05
    settle_timeout: float = 30.0
    watchdog_time: float = 2.0
    direction_from: Literal["command", "power"] = "command"
    torque_inverted: bool = False
    speed_decimals: int | None = None
    power_step: float | None = None
    drive_code: int | None = None

    @property
    def units(self) -> tuple[int, ...]:
        """The units that it is made of."""
        return (self.drive_unit, self.transducer_unit)

    @property
    def watchdog(self) -> Watchdog | None:
        """Watchdog asked of the drive."""
        return communication_watchdog(self.watchdog_time)


DELTA_DYN200 = Driver(
    "delta-dyn200",
    Role.DYNAMOMETER,
    DeltaDyn200Options,
    "drivers.delta.dynamometer:DeltaDyn200.open",
    simulated="delta-dyn200",
    sources=(
        "DYN-200: the maker's manual; dyn200-logger, dyn200-python and J. Deuter's library, each with a sensor",
        "C2000: Delta's manuals, pages 12.1-09; adigupta2004/SRE, a program for a dynamometer and its notes, written after the same manual "
        "(one source for 00-22 = 1, 11-27, 11-33, 11-34; 11-36 to 11-38 also in a public table for its sister C200); the values of 11-36 "
        "from memory",
        "00-21 = 2: public programs for its sisters C200 and MH300, and a guide to the GS20 and MS300; no page of the C2000's own was seen",
    ),
    commands_in="drivers.delta",
    recognised_by=(DRIVE, TRANSDUCER),
    framing="drivers.delta.framing:DriveFraming",
)
