"""What disturbs one bench of the study, gathered thing by thing, and the figures that say how large it is for a motor."""

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from procedures.core.nameplate import Nameplate
from sim_instruments.disturbances.bench import Contacts, Disturbances, Hands, ShaftSensors, SupplyRipple
from sim_instruments.disturbances.channel import ChannelPath
from sim_instruments.disturbances.current_loop import CurrentLoop
from sim_instruments.physics.motor.motor import VirtualMotor

#: The channels of the virtual station: three voltage probes, one current probe.
VOLTAGES, CURRENT = (1, 2, 3), 4
#: Shares of plate figures that the procedures work at: the step's current, the fastest back-EMF record, the ramps' top.
_STEP, _FASTEST = 0.1, 1.0


@dataclass
class Dirt:
    """A motor and its bench, to be made dirty; every cause draws how much of itself there is from `random`."""

    random: np.random.Generator
    motor: VirtualMotor
    plate: Nameplate
    warmth: float = 0.0
    _channels: dict[int, dict[str, Any]] = field(default_factory=dict)
    _sensors: dict[str, Any] = field(default_factory=dict)
    _contacts: dict[str, Any] = field(default_factory=dict)
    _hands: dict[str, Any] = field(default_factory=dict)
    _inverter: dict[str, float] = field(default_factory=dict)
    _supply: dict[str, float] = field(default_factory=dict)

    # How much

    def log(self, low: float, high: float) -> float:
        """Return a number between two positive ones, every decade equally likely."""
        return math.exp(self.random.uniform(math.log(low), math.log(high)))

    def either(self, *choices: Any) -> Any:
        """Return one of them."""
        return choices[int(self.random.integers(len(choices)))]

    def phase(self) -> float:
        """Return an angle (rad)."""
        return float(self.random.uniform(0.0, 2.0 * math.pi))

    @property
    def step_current(self) -> float:
        """The step's current (A) at its end."""
        return _STEP * self.plate.rated_current

    @property
    def step_voltage(self) -> float:
        """The step's voltage (V): one phase in series with two."""
        return 1.5 * self.motor.stator_resistance_y * self.step_current

    @property
    def time_constant(self) -> float:
        """The step's time constant (s), of an axis between d and q."""
        axes = self.motor.d_axis_inductance_y, self.motor.q_axis_inductance_y
        return math.sqrt(axes[0] * axes[1]) / self.motor.stator_resistance_y

    @property
    def top_speed(self) -> float:
        """The rated speed (rad/s)."""
        return _FASTEST * (self.plate.rated_speed_rpm or 0.0) * math.pi / 30.0

    @property
    def emf(self) -> float:
        """A phase's EMF (V, peak) at rated speed."""
        return self.motor.back_emf_constant_mechanical * self.top_speed

    @property
    def emf_frequency(self) -> float:
        """Its frequency (Hz)."""
        return self.motor.pole_pairs * self.top_speed / (2.0 * math.pi)

    def signal(self, channel: int, of_step: bool) -> float:
        """Return how large (V or A) a channel's signal is, in a step or in a record of the back-EMF."""
        if not of_step:
            return self.emf
        return self.step_current if channel == CURRENT else self.step_voltage

    # What of

    def channel(self, *numbers: int, **values: Any) -> None:
        """Put something before channels' converters."""
        for number in numbers:
            self._channels.setdefault(number, {}).update(values)

    def sensors(self, **values: Any) -> None:
        """Put something on the shaft's sensors."""
        self._sensors.update(values)

    def contacts(self, **values: Any) -> None:
        """Put something into the contacts."""
        self._contacts.update(values)

    def hands(self, **values: Any) -> None:
        """Give the hands a habit."""
        self._hands.update(values)

    def inverter(self, **values: float) -> None:
        """Put something on the drive, over what it has by itself."""
        self._inverter.update(values)

    def supply(self, **values: float) -> None:
        """Put something on the supply's output."""
        self._supply.update(values)

    def bearing(self, **values: Any) -> None:
        """Change the motor's bearing."""
        self.motor = replace(self.motor, bearing=replace(self.motor.bearing, **values))

    def iron(self, **values: Any) -> None:
        """Change the motor's iron."""
        self.motor = replace(self.motor, iron=replace(self.motor.iron, **values))

    def disturbances(self) -> Disturbances:
        """Return all that was gathered of the bench."""
        return Disturbances(
            {number: ChannelPath(**values) for number, values in self._channels.items()},
            ShaftSensors(**self._sensors),
            Contacts(**self._contacts),
            Hands(**self._hands),
            CurrentLoop(**self._inverter),
            SupplyRipple(**self._supply),
        )
