"""Options of an instrument that a person reads in a station file.

An accuracy that is not given makes a reading of that quantity an error: a figure without one is worth nothing.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from drivers.interfaces import Accuracy, InverterAbility, ProbeKind

#: What a person can set at an inverter's own panel.
INVERTER_ABILITIES = frozenset({InverterAbility.FREQUENCY, InverterAbility.Q_CURRENT})


@dataclass(frozen=True)
class ManualSupplyOptions:
    """Limits (V, A) and accuracies of a supply that a person sets."""

    maximum_voltage: float
    maximum_current: float
    model: str = "supply set by hand"
    voltage_accuracy: Accuracy | None = None
    current_accuracy: Accuracy | None = None


@dataclass(frozen=True)
class ManualLcrMeterOptions:
    """Ranges and accuracies of an LCR meter that a person reads.

    `frequencies` (Hz) are those it offers, any when empty; `direct_current` is for a meter that gives a DC
    resistance only. `maximum_level` is in V rms, resistance in Ω, inductance in H; `source_impedance` (Ω) is what its
    test signal stands behind.
    """

    model: str = "LCR meter read by hand"
    frequencies: tuple[float, ...] = ()
    direct_current: bool = False
    maximum_level: float = 10.0
    maximum_resistance: float = 200e6
    maximum_inductance: float = 20.0
    source_impedance: float = 100.0
    resistance_accuracy: Accuracy | None = None
    inductance_accuracy: Accuracy | None = None


@dataclass(frozen=True)
class ManualOscilloscopeOptions:
    """Probes and accuracies of an oscilloscope that a person reads.

    `maximum_frequency` in Hz, `maximum_amplitude` in V or A at the probe's tip; `amplitude_accuracy` by channel.
    """

    probes: Mapping[int, ProbeKind] = field(default_factory=dict)
    model: str = "oscilloscope read by hand"
    maximum_frequency: float = 1e6
    maximum_amplitude: float = 1000.0
    frequency_accuracy: Accuracy | None = None
    amplitude_accuracy: Mapping[int, Accuracy] = field(default_factory=dict)


@dataclass(frozen=True)
class ManualDynamometerOptions:
    """Limits (rad/s, N·m) and accuracies of a dynamometer that a person runs."""

    maximum_speed: float
    maximum_torque: float
    model: str = "dynamometer run by hand"
    speed_accuracy: Accuracy | None = None
    torque_accuracy: Accuracy | None = None


@dataclass(frozen=True)
class ManualTachometerOptions:
    """Range (rad/s) and accuracy (rad/s) of a tachometer that a person reads."""

    model: str = "tachometer read by hand"
    maximum_speed: float = 10_471.0
    accuracy: Accuracy | None = None


@dataclass(frozen=True)
class ManualInverterOptions:
    """Limits (A peak, Hz) and accuracies of an inverter that a person runs."""

    maximum_current: float
    maximum_frequency: float
    model: str = "inverter run by hand"
    current_accuracy: Accuracy | None = None
    frequency_accuracy: Accuracy | None = None


@dataclass(frozen=True)
class ManualVoltmeterOptions:
    """Range (V) and accuracy (V) of a DC voltmeter that a person reads."""

    model: str = "voltmeter read by hand"
    maximum_voltage: float = 1000.0
    accuracy: Accuracy | None = None


@dataclass(frozen=True)
class ManualDriveOptions:
    """Ranges (V, A, Hz electrical) and accuracies of a six-step drive that a person switches and reads."""

    maximum_voltage: float
    maximum_current: float
    maximum_frequency: float = 5000.0
    model: str = "six-step drive run by hand"
    voltage_accuracy: Accuracy | None = None
    current_accuracy: Accuracy | None = None
    frequency_accuracy: Accuracy | None = None
