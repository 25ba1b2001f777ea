"""What hands and instruments have set on the virtual bench; the physics follows from it."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Terminal = Literal["A", "B", "C"]
Socket = Literal[
    "open", "supply+", "supply-", "lcr_high", "lcr_low", "inverter_u", "inverter_v", "inverter_w",
    "drive_1", "drive_2", "drive_3",
]  # fmt: skip
SixStepFault = Literal["output phase missing", "overcurrent", "no rotation"]
Holder = Literal["free", "locked", "hand", "turning", "pulling"]

TERMINALS: tuple[Terminal, ...] = ("A", "B", "C")
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
)


@dataclass
class SupplySettings:
    """Set points of the supply's output; `over_voltage` None is protection off."""

    on: bool = False
    voltage: float = 0.0
    current_limit: float = 0.1
    over_voltage: float | None = None
    over_current: bool = False
    tripped: Literal["voltage", "current"] | None = None


@dataclass
class DynamometerSettings:
    """Set points of the dynamometer: `command` in rad/s or N·m after the mode."""

    enabled: bool = False
    mode: Literal["speed", "torque"] = "speed"
    command: float = 0.0


@dataclass
class InverterSettings:
    """Set points of the inverter: electrical Hz, A peak."""

    enabled: bool = False
    mode: Literal["frequency", "current"] = "frequency"
    frequency: float = 0.0
    amplitude: float = 0.0
    q_current: float = 0.0
    fault: str | None = None


@dataclass
class SixStepSettings:
    """What is set of the six-step drive, and why it has switched itself off."""

    enabled: bool = False
    fault: SixStepFault | None = None


@dataclass
class ShaftSettings:
    """Who holds or turns the shaft. `wobble_phase` (rad) starts the wobble,
    `pull_until` (s) and `pull_speed` (rad/s) belong to a pull by hand.
    """

    holder: Holder = "free"
    coupled: bool = False
    turning_speed: float = 0.0
    wobble: float = 0.0
    wobble_phase: float = 0.0
    pull_speed: float = 0.0
    pull_until: float = 0.0


@dataclass
class Settings:
    """Everything set on the bench."""

    wiring: dict[Terminal, Socket] = field(default_factory=lambda: {"A": "open", "B": "open", "C": "open"})
    supply: SupplySettings = field(default_factory=SupplySettings)
    dynamometer: DynamometerSettings = field(default_factory=DynamometerSettings)
    inverter: InverterSettings = field(default_factory=InverterSettings)
    six_step: SixStepSettings = field(default_factory=SixStepSettings)
    shaft: ShaftSettings = field(default_factory=ShaftSettings)
    ambient_temperature: float = 25.0
    leads_shorted: bool = False
    open_phase: Terminal | None = None
    swapped: tuple[Terminal, Terminal] | None = None
    stuck_rotor: bool = False

    @property
    def rotor_held(self) -> bool:
        """Whether the lock, a hand or a jam holds the rotor."""
        return self.stuck_rotor or self.shaft.holder in ("locked", "hand")

    def motor_terminal(self, label: Terminal) -> Terminal:
        """Return the motor's own terminal that the wire with this label goes to."""
        if self.swapped is not None and label in self.swapped:
            first, second = self.swapped
            return second if label == first else first
        return label

    def sockets(self) -> tuple[Socket, Socket, Socket]:
        """Return the socket that each of the motor's own terminals A, B, C really meets."""
        real: dict[Terminal, Socket] = {}
        for label in TERMINALS:
            terminal = self.motor_terminal(label)
            real[terminal] = "open" if terminal == self.open_phase else self.wiring[label]
        return real["A"], real["B"], real["C"]
