"""The settings of the virtual bench by hands and instruments; the physics follows from them."""

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Terminal = Literal["A", "B", "C"]
Socket = Literal[
    "open", "supply+", "supply-", "lcr_high", "lcr_low", "inverter_u", "inverter_v", "inverter_w",
    "drive_1", "drive_2", "drive_3", "insulation_high", "link",
]  # fmt: skip
#: What a terminal meets: a socket, or with other terminals a net that belongs to no instrument, named after its first one.
Contact = Socket | Literal["joined_a", "joined_b", "joined_c"]
SixStepFault = Literal["output phase missing", "overcurrent", "no rotation"]
Holder = Literal["free", "locked", "hand", "turning", "pulling"]

TERMINALS: tuple[Terminal, ...] = ("A", "B", "C")
#: Where a terminal may be connected; a bench with a fixture has `insulation_high` as well.
SOCKETS: tuple[Socket, ...] = (
    "open",
    "supply+",
    "supply-",
    "lcr_high",
    "lcr_low",
    "inverter_u",
    "inverter_v",
    "inverter_w",
    "drive_1",
    "drive_2",
    "drive_3",
    "link",
)
#: Everything that is set at one moment.
Snapshot = tuple[object, ...]


@dataclass(frozen=True)
class Heating:
    """A winding with a fault of overheating: it tends to `temperature` (°C) with `time_constant` (s), independent of the current."""

    temperature: float = 200.0
    time_constant: float = 30.0


@dataclass
class BenchFaults:
    """The faults on the bench, those of the instruments' lines apart.

    `unplugged`: all the motor's wires are open. `supply_current` (A) is all that the supply gives, whatever its limit.
    `dynamometer_runaway` (rad/s) and `inverter_runaway` (Hz, electrical) are where those go while they are switched on.
    """

    open_phase: Terminal | None = None
    swapped: tuple[Terminal, Terminal] | None = None
    stuck_rotor: bool = False
    unplugged: bool = False
    supply_current: float | None = None
    dynamometer_runaway: float | None = None
    inverter_runaway: float | None = None
    heating: Heating | None = None


@dataclass
class SupplySettings:
    """Set points of the supply's output; `over_voltage` None is protection off.

    Over-current protection trips `over_current_delay` s after the output went to constant current or, with
    `over_current_from_change`, as soon as it is in constant current that long after the last change (`changed`, s) of voltage,
    current or output.
    """

    on: bool = False
    voltage: float = 0.0
    current_limit: float = 0.1
    over_voltage: float | None = None
    over_current: bool = False
    over_current_delay: float = 0.05
    over_current_from_change: bool = False
    changed: float = -math.inf
    tripped: Literal["voltage", "current"] | None = None


@dataclass
class DynamometerSettings:
    """Set points of the dynamometer: `command` in rad/s or N·m after the mode, `way` +1 or -1 as it was last."""

    enabled: bool = False
    mode: Literal["speed", "torque"] = "speed"
    command: float = 0.0
    way: float = 1.0


@dataclass
class InverterSettings:
    """Set points of the inverter: electrical Hz, A peak; `way` is +1 or -1 as the field's direction was last.

    `dq_current` is d + j·q in the true rotor's coordinates, `current_offset` what stands still in the stator beside it. With a
    `held_speed` (rad/s, mechanical) its q part is the most that is used, either way, to come to that speed and to hold it. A loop of
    `bandwidth` (Hz) brings the currents to it on a shaft that is free or held at rest, at once where there is none.
    """

    enabled: bool = False
    mode: Literal["frequency", "current", "dq"] = "frequency"
    frequency: float = 0.0
    amplitude: float = 0.0
    q_current: float = 0.0
    dq_current: complex = 0j
    current_offset: complex = 0j
    held_speed: float | None = None
    bandwidth: float | None = None
    way: float = 1.0
    fault: str | None = None


@dataclass
class SixStepSettings:
    """The settings of the six-step drive, and the reason why it has switched itself off."""

    enabled: bool = False
    fault: SixStepFault | None = None


@dataclass
class ShaftSettings:
    """The holder or driver of the shaft. `wobble_phase` (rad) starts the wobble, `pauses` (from, to, s) are those in which a hand
    takes hold anew, `pull_until` (s), `pull_speed` (rad/s) and `pull_then`, who holds the shaft after it, belong to a pull.
    """

    holder: Holder = "free"
    coupled: bool = False
    turning_speed: float = 0.0
    wobble: float = 0.0
    wobble_phase: float = 0.0
    pauses: tuple[tuple[float, float], ...] = ()
    pull_speed: float = 0.0
    pull_until: float = 0.0
    pull_then: Holder = "free"


@dataclass
class WorldSettings:
    """Everything set on the bench. `exchanged` are two terminals whose wires are exchanged inside the motor.

    `clamps` are the resistances (Ω) of the contacts at the motor's own terminals A, B, C, cold.
    """

    wiring: dict[Terminal, Contact] = field(default_factory=lambda: {"A": "open", "B": "open", "C": "open"})
    supply: SupplySettings = field(default_factory=SupplySettings)
    dynamometer: DynamometerSettings = field(default_factory=DynamometerSettings)
    inverter: InverterSettings = field(default_factory=InverterSettings)
    six_step: SixStepSettings = field(default_factory=SixStepSettings)
    shaft: ShaftSettings = field(default_factory=ShaftSettings)
    ambient_temperature: float = 25.0
    leads_shorted: bool = False
    faults: BenchFaults = field(default_factory=BenchFaults)
    exchanged: tuple[Terminal, Terminal] | None = None
    clamps: tuple[float, ...] = (0.0, 0.0, 0.0)

    def snapshot(self) -> Snapshot:
        """Return everything that is set now, to be compared with what is set later."""
        return (
            self.ambient_temperature,
            self.leads_shorted,
            self.clamps,
            self.wiring.copy(),
            vars(self.supply).copy(),
            vars(self.dynamometer).copy(),
            vars(self.inverter).copy(),
            vars(self.six_step).copy(),
            vars(self.shaft).copy(),
            vars(self.faults).copy(),
        )

    @property
    def rotor_held(self) -> bool:
        """True if the lock, a hand or a jam holds the rotor."""
        return self.faults.stuck_rotor or self.shaft.holder in ("locked", "hand")

    @property
    def supply_limit(self) -> float:
        """The actual current limit (A) of the supply's output."""
        limit, broken = self.supply.current_limit, self.faults.supply_current
        return limit if broken is None else min(limit, broken)

    @property
    def dynamometer_mode(self) -> Literal["speed", "torque"]:
        """The quantity that the dynamometer actually regulates; one that runs away regulates its speed."""
        return self.dynamometer.mode if self.faults.dynamometer_runaway is None else "speed"

    @property
    def dynamometer_target(self) -> float:
        """The actual target of the dynamometer: rad/s or N·m, by its mode."""
        command, runaway = self.dynamometer.command, self.faults.dynamometer_runaway
        return command if runaway is None else runaway * self.dynamometer.way

    @property
    def field_frequency(self) -> float:
        """The actual electrical frequency (Hz, signed) that the inverter's field is driven to."""
        frequency, runaway = self.inverter.frequency, self.faults.inverter_runaway
        return frequency if runaway is None else runaway * self.inverter.way

    def motor_terminal(self, label: Terminal) -> Terminal:
        """Return the motor's own terminal that the wire with this label goes to."""
        return _other(_other(label, self.faults.swapped), self.exchanged)

    def sockets(self) -> tuple[Contact, Contact, Contact]:
        """Return the socket that each of the motor's own terminals A, B, C is actually connected to."""
        faults, wiring = self.faults, self.wiring
        if faults.swapped is None and self.exchanged is None and faults.open_phase is None and not faults.unplugged:
            return wiring["A"], wiring["B"], wiring["C"]
        real: dict[Terminal, Contact] = {}
        for label in TERMINALS:
            terminal = self.motor_terminal(label)
            broken = faults.unplugged or terminal == faults.open_phase
            real[terminal] = "open" if broken else wiring[label]
        return real["A"], real["B"], real["C"]


def _other(terminal: Terminal, exchanged: tuple[Terminal, Terminal] | None) -> Terminal:
    if exchanged is None or terminal not in exchanged:
        return terminal
    first, second = exchanged
    return second if terminal == first else first
