"""The machines round the motor under test: data of supply, dynamometer, inverter and leads."""

import math
from dataclasses import dataclass, fields

from sim_instruments.physics.circuits.bridge_error import BridgeError


def _not_negative(part: object) -> None:
    for entry in fields(part):  # type: ignore[arg-type]
        value = getattr(part, entry.name)
        if not 0.0 <= value < math.inf:
            raise ValueError(f"{type(part).__name__}.{entry.name} is {value}; it must be finite and not negative")


@dataclass(frozen=True)
class SupplyStage:
    """Output stage of a DC supply.

    `maximum_voltage` V, `maximum_current` A, `output_resistance` Ω, `slew` V/s up and down. While it holds a voltage, a triangle of the
    amplitude `ripple` (V) and the frequency `ripple_frequency` (Hz) is on it, as a rectifier's capacitor leaves it.
    """

    maximum_voltage: float = 10.3
    maximum_current: float = 10.3
    output_resistance: float = 0.005
    slew: float = 1000.0
    ripple: float = 0.0
    ripple_frequency: float = 100.0

    def __post_init__(self) -> None:
        _not_negative(self)
        if self.slew == 0.0:
            raise ValueError("SupplyStage.slew is 0 V/s; the output could never rise")
        if self.ripple_frequency == 0.0:
            raise ValueError("SupplyStage.ripple_frequency is 0 Hz; it must be positive")

    def ripple_at(self, time: float) -> tuple[float, float, float]:
        """Return the ripple (V) at a time (s), its slope (V/s), and when it turns next."""
        half = 0.5 / self.ripple_frequency
        # At a turn, the next half wave counts.
        number = math.floor(time / half + 1e-9)
        sign = 1.0 if number % 2 == 0 else -1.0
        slope = sign * 2.0 * self.ripple / half
        return -sign * self.ripple + slope * (time - number * half), slope, (number + 1) * half


@dataclass(frozen=True)
class DynamometerMachine:
    """Machine of the dynamometer, on the same shaft as the motor when coupled.

    `inertia` kg·m², `coulomb_friction` N·m, `viscous_friction` N·m·s/rad, `maximum_speed` rad/s, `maximum_torque`
    N·m, `speed_ramp` rad/s², `speed_ripple` relative amplitude, once a turn.
    """

    inertia: float = 1.0e-4
    coulomb_friction: float = 0.01
    viscous_friction: float = 2.0e-5
    maximum_speed: float = 630.0
    maximum_torque: float = 10.0
    speed_ramp: float = 500.0
    speed_ripple: float = 1.0e-4

    def __post_init__(self) -> None:
        _not_negative(self)
        if self.speed_ramp == 0.0:
            raise ValueError("DynamometerMachine.speed_ramp is 0 rad/s²; the machine could never start")


@dataclass(frozen=True)
class InverterStage:
    """Three-phase inverter.

    `dc_voltage` V, `maximum_current` A peak, `maximum_frequency` Hz, `frequency_ramp` Hz/s, `switching_frequency` Hz,
    `current_ripple` at the switching frequency relative to the amplitude of the current. `dead_time` (s) of a leg, `device_drop`
    (V, at no current) and `device_resistance` (Ω) of what conducts in it; below `knee_current` (A) dead time and drop fade.
    `modulation` is the share of the largest voltage that it makes use of.
    """

    dc_voltage: float = 48.0
    maximum_current: float = 30.0
    maximum_frequency: float = 1000.0
    frequency_ramp: float = 20.0
    switching_frequency: float = 16_000.0
    current_ripple: float = 0.01
    dead_time: float = 0.0
    device_drop: float = 0.0
    device_resistance: float = 0.0
    knee_current: float = 0.0
    modulation: float = 1.0

    def __post_init__(self) -> None:
        _not_negative(self)
        if self.frequency_ramp == 0.0:
            raise ValueError("InverterStage.frequency_ramp is 0 Hz/s; the field could never start to turn")
        if not 0.0 < self.modulation <= 1.0:
            raise ValueError(f"InverterStage.modulation is {self.modulation}; it is a share, above 0 and at most 1")

    @property
    def maximum_phase_voltage(self) -> float:
        """Largest phase voltage (V, peak) that space-vector modulation makes of the DC link."""
        return self.modulation * self.dc_voltage / math.sqrt(3.0)

    @property
    def bridge_error(self) -> BridgeError:
        """The voltage error of a leg: each dead time of a period costs a share of the DC link, against the current."""
        step = self.dead_time * self.switching_frequency * self.dc_voltage + self.device_drop
        return BridgeError(step, self.knee_current, self.device_resistance)


@dataclass(frozen=True)
class Leads:
    """`resistance` (Ω) of each lead from supply or inverter to a terminal, and what the bridge's fixture leaves in
    series with the motor: `lcr_resistance` (Ω), `lcr_inductance` (H).
    """

    resistance: float = 0.002
    lcr_resistance: float = 0.001
    lcr_inductance: float = 20.0e-9

    def __post_init__(self) -> None:
        _not_negative(self)
