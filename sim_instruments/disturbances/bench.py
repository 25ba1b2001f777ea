"""Everything that disturbs a bench, each thing by itself; by default nothing."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace

from sim_instruments.disturbances.channel import CLEAR, ChannelPath
from sim_instruments.disturbances.current_loop import CurrentLoop
from sim_instruments.world.machine_data import SupplyStage


def _not_negative(part: object, positive: frozenset[str] = frozenset()) -> None:
    for entry in fields(part):  # type: ignore[arg-type]
        value = getattr(part, entry.name)
        if not (0.0 <= value < math.inf) or (entry.name in positive and value == 0.0):
            allowed = "positive and finite" if entry.name in positive else "finite and not negative"
            raise ValueError(f"{type(part).__name__}: {entry.name} is {value}; it must be {allowed}")


@dataclass(frozen=True)
class ShaftSensors:
    """Disturbances of the torque transducer and its speed sensor.

    `torque_filter`, `speed_filter` (s): time constants of first-order filters in place of the transducer's own mean; `dropouts`: share
    of readings that come as zeros; `speed_runout`: relative amplitude, once a turn, of an eccentric encoder; `torque_runout` (N·m):
    once a turn, of shafts out of line; `pulses`: a turn, where the speed is counted from them within a reading's time, 0 where not;
    `torque_drift` (N·m/s): of the zero; `vibration` (N·m) at `vibration_frequency` (Hz).
    """

    torque_filter: float = 0.0
    speed_filter: float = 0.0
    dropouts: float = 0.0
    speed_runout: float = 0.0
    torque_runout: float = 0.0
    pulses: int = 0
    torque_drift: float = 0.0
    vibration: float = 0.0
    vibration_frequency: float = 25.0

    def __post_init__(self) -> None:
        _not_negative(self, frozenset({"vibration_frequency"}))
        if self.dropouts >= 1.0:
            raise ValueError(f"ShaftSensors: dropouts is {self.dropouts}; it is a share of the readings, below 1")

    @property
    def clear(self) -> bool:
        """True if there are no such disturbances."""
        return self == _CLEAR_SENSORS


_CLEAR_SENSORS = ShaftSensors()


@dataclass(frozen=True)
class Contacts:
    """Disturbances by the contacts of clamps.

    `thermal_emf` (V) fades with `thermal_time` (s) after fingers have warmed the voltmeter's clamp. `resistance` (Ω) of each clamp on
    the motor lies in the loop of whatever feeds it; it has doubled where `doubling_current` (A) has flowed for long, and follows with
    `heating_time` (s). The leads of voltmeter and bridge that sense see it, being on the same clamp, unless `kelvin` says that each lead
    has its own contact; an ohmmeter of two wires has its own in series.
    No contact is like the one before: put on anew, its resistance is log-normal about that, with the standard deviation `remaking`
    of its logarithm.
    """

    thermal_emf: float = 0.0
    thermal_time: float = 60.0
    resistance: float = 0.0
    doubling_current: float = 10.0
    heating_time: float = 5.0
    remaking: float = 0.5
    kelvin: bool = False

    def __post_init__(self) -> None:
        _not_negative(self, frozenset({"thermal_time", "doubling_current", "heating_time"}))


@dataclass(frozen=True)
class Hands:
    """Errors that a person adds by hand and eye.

    `unevenness`: share by which a hand's speed varies instead of the usual tenth, 0 leaves that; `regrips`: stops a turn in which the
    hand takes hold anew, `regrip_time` (s) each; `slips`: share of typed readings whose decimal point is a place off;
    `thermometer_share`: how much of the winding's warmth above the room the thermometer on its outside shows.
    """

    unevenness: float = 0.0
    regrips: float = 0.0
    regrip_time: float = 0.4
    slips: float = 0.0
    thermometer_share: float = 1.0

    def __post_init__(self) -> None:
        _not_negative(self, frozenset({"regrip_time"}))
        for name in ("unevenness", "slips", "thermometer_share"):
            if getattr(self, name) > 1.0:
                raise ValueError(f"Hands: {name} is {getattr(self, name)}; it is a share, at most 1")
        if self.unevenness == 1.0:
            raise ValueError("Hands: unevenness is 1; a hand does not turn back, give less")


@dataclass(frozen=True)
class SupplyRipple:
    """What of its rectifier is left on a DC supply's output: a triangle of the amplitude `ripple` (V) and the `frequency` (Hz), while it
    holds a voltage.
    """

    ripple: float = 0.0
    frequency: float = 100.0

    def __post_init__(self) -> None:
        _not_negative(self, frozenset({"frequency"}))

    def stage(self, stage: SupplyStage) -> SupplyStage:
        """Return a stage with this on its output."""
        return replace(stage, ripple=self.ripple, ripple_frequency=self.frequency) if self.ripple else stage


@dataclass(frozen=True)
class Disturbances:
    """Disturbances of a bench: of the oscilloscope's `channels` by number, of the shaft's `sensors`, of `contacts`, of `hands`, of the
    `supply`, and of the `inverter`, which are more than it has by itself.
    """

    channels: Mapping[int, ChannelPath] = field(default_factory=dict)
    sensors: ShaftSensors = field(default_factory=ShaftSensors)
    contacts: Contacts = field(default_factory=Contacts)
    hands: Hands = field(default_factory=Hands)
    inverter: CurrentLoop = field(default_factory=CurrentLoop)
    supply: SupplyRipple = field(default_factory=SupplyRipple)

    def channel(self, number: int) -> ChannelPath:
        """Return what lies before a channel's converter."""
        return self.channels.get(number, CLEAR)
