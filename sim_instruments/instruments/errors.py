"""Individual errors of the instruments: a healthy unit by default, or drawn from its maker's specification."""

from dataclasses import dataclass, field

import numpy as np


def _within(generator: np.random.Generator, limit: float) -> float:
    return float(generator.uniform(-limit, limit))


@dataclass(frozen=True)
class SupplyErrors:
    """Errors of a supply: set and measured voltage (relative, V) and current (relative, A)."""

    set_voltage_gain: float = 1.0e-4
    set_voltage_offset: float = 2.0e-4
    set_current_gain: float = 3.0e-4
    set_current_offset: float = 5.0e-4
    voltage_gain: float = -5.0e-5
    voltage_offset: float = 1.0e-4
    current_gain: float = 1.0e-4
    current_offset: float = 2.0e-4

    @classmethod
    def drawn(cls, generator: np.random.Generator) -> "SupplyErrors":
        """Draw a unit within 0.03 % + 3 mV and 0.1 % + 5 mA setting, 0.03 % + 2 mV and 0.05 % + 5 mA reading."""
        return cls(
            set_voltage_gain=_within(generator, 3.0e-4),
            set_voltage_offset=_within(generator, 3.0e-3),
            set_current_gain=_within(generator, 1.0e-3),
            set_current_offset=_within(generator, 5.0e-3),
            voltage_gain=_within(generator, 3.0e-4),
            voltage_offset=_within(generator, 2.0e-3),
            current_gain=_within(generator, 5.0e-4),
            current_offset=_within(generator, 5.0e-3),
        )


@dataclass(frozen=True)
class LcrErrors:
    """Errors of a bridge.

    `gain` is relative, `phase` rad; `residual_resistance` (Ω) and `residual_inductance` (H) are left after a short
    correction. `share` is the part, complex and at most 1 in magnitude, of the data sheet's error that this unit has:
    of the proportional error, of the short's and of the open's.
    """

    gain: float = 2.0e-4
    phase: float = 2.0e-5
    residual_resistance: float = 20.0e-6
    residual_inductance: float = 5.0e-9
    share: tuple[complex, complex, complex] = (0j, 0j, 0j)

    @classmethod
    def drawn(cls, generator: np.random.Generator) -> "LcrErrors":
        """Draw a unit anywhere within the data sheet's accuracy formula (Keysight 5989-4435EN).

        The shares are the shadows of points on a sphere: whatever part of the impedance is read, resistance, reactance or
        magnitude, its error is then spread evenly between the limits, and never beyond them.
        """
        radius = np.sqrt(1.0 - generator.uniform(0.0, 1.0, 3) ** 2)
        angle = generator.uniform(0.0, 2.0 * np.pi, 3)
        share = radius * np.exp(1j * angle)
        return cls(0.0, 0.0, 0.0, 0.0, (complex(share[0]), complex(share[1]), complex(share[2])))


@dataclass(frozen=True)
class ScopeErrors:
    """Errors of an oscilloscope: `gain` (relative) and `offset` (of the full scale) a channel, `time_base` (relative)."""

    gain: tuple[float, float, float, float] = (5.0e-4, -4.0e-4, 3.0e-4, -5.0e-4)
    offset: tuple[float, float, float, float] = (1.0e-4, -1.0e-4, 0.5e-4, -0.8e-4)
    time_base: float = 2.0e-7

    @classmethod
    def drawn(cls, generator: np.random.Generator) -> "ScopeErrors":
        """Draw a unit within ±2 % gain, ±0.1 division offset and ±1.6 ppm (Keysight 5992-0140EN)."""
        gain = generator.uniform(-0.02, 0.02, 4)
        offset = generator.uniform(-0.0125, 0.0125, 4)
        return cls(
            (float(gain[0]), float(gain[1]), float(gain[2]), float(gain[3])),
            (float(offset[0]), float(offset[1]), float(offset[2]), float(offset[3])),
            _within(generator, 1.6e-6),
        )


@dataclass(frozen=True)
class DynamometerErrors:
    """Errors of a torque transducer: `torque_gain` and `speed_gain` relative, `torque_offset` N·m until it is zeroed."""

    torque_gain: float = 5.0e-4
    torque_offset: float = 5.0e-4
    speed_gain: float = 0.0

    @classmethod
    def drawn(cls, generator: np.random.Generator, rated_torque: float = 5.0) -> "DynamometerErrors":
        """Draw a unit within ±0.2 % gain, ±0.1 % of `rated_torque` offset and ±0.02 % speed."""
        return cls(_within(generator, 2.0e-3), _within(generator, 1.0e-3 * rated_torque), _within(generator, 2.0e-4))


@dataclass(frozen=True)
class TachometerErrors:
    """Errors of a tachometer: `gain` is relative."""

    gain: float = 0.0

    @classmethod
    def drawn(cls, generator: np.random.Generator) -> "TachometerErrors":
        """Draw a unit within ±0.05 %; the digit comes on top."""
        return cls(_within(generator, 5.0e-4))


@dataclass(frozen=True)
class InverterErrors:
    """Errors of an inverter: `frequency_gain` and `current_gain` are relative."""

    frequency_gain: float = 0.0
    current_gain: float = 2.0e-3

    @classmethod
    def drawn(cls, generator: np.random.Generator) -> "InverterErrors":
        """Draw a unit within ±50 ppm of frequency and ±2 % of current."""
        return cls(_within(generator, 5.0e-5), _within(generator, 0.02))


@dataclass(frozen=True)
class DriveErrors:
    """Errors of a six-step drive's readings: gains relative, offsets and noise (standard deviation) in V and A."""

    voltage_gain: float = 2.0e-4
    voltage_offset: float = 1.0e-3
    voltage_noise: float = 1.0e-3
    current_gain: float = -3.0e-4
    current_offset: float = 1.0e-3
    current_noise: float = 1.0e-3
    frequency_gain: float = 0.0

    @classmethod
    def drawn(cls, generator: np.random.Generator) -> "DriveErrors":
        """Draw a unit within ±0.1 % + 5 mV of voltage, ±0.2 % + 5 mA of current and ±50 ppm of frequency."""
        return cls(
            voltage_gain=_within(generator, 1.0e-3),
            voltage_offset=_within(generator, 5.0e-3),
            current_gain=_within(generator, 2.0e-3),
            current_offset=_within(generator, 5.0e-3),
            frequency_gain=_within(generator, 5.0e-5),
        )


@dataclass(frozen=True)
class VoltmeterErrors:
    """Errors of a DC voltmeter in its ranges 100 mV, 1, 10, 100, 1000 V.

    `gain` is relative to the reading, `offset` to the range; the defaults are a tenth of the data sheet's limits.
    """

    gain: tuple[float, ...] = (5.0e-6, 4.0e-6, 3.5e-6, 4.5e-6, 4.5e-6)
    offset: tuple[float, ...] = (-3.5e-6, -0.7e-6, 0.5e-6, -0.6e-6, 1.0e-6)

    @classmethod
    def drawn(cls, generator: np.random.Generator) -> "VoltmeterErrors":
        """Draw a unit within the 1-year accuracy at 23 ± 5 °C (Keysight 34461A data sheet, 5991-1983EN)."""
        gain = (5.0e-5, 4.0e-5, 3.5e-5, 4.5e-5, 4.5e-5)
        offset = (3.5e-5, 0.7e-5, 0.5e-5, 0.6e-5, 1.0e-5)
        return cls(
            tuple(_within(generator, limit) for limit in gain), tuple(_within(generator, limit) for limit in offset)
        )


@dataclass(frozen=True)
class InsulationErrors:
    """Errors of an insulation tester: `voltage_gain` and `resistance_gain` relative, `noise` relative (standard deviation)."""

    voltage_gain: float = -2.0e-3
    resistance_gain: float = 5.0e-3
    noise: float = 2.0e-3

    @classmethod
    def drawn(cls, generator: np.random.Generator) -> "InsulationErrors":
        """Draw a unit within ±1 % of voltage and ±5 % of resistance."""
        return cls(_within(generator, 0.01), _within(generator, 0.05))


@dataclass(frozen=True)
class Errors:
    """The errors of every instrument of a bench."""

    supply: SupplyErrors = field(default_factory=SupplyErrors)
    lcr_meter: LcrErrors = field(default_factory=LcrErrors)
    oscilloscope: ScopeErrors = field(default_factory=ScopeErrors)
    dynamometer: DynamometerErrors = field(default_factory=DynamometerErrors)
    tachometer: TachometerErrors = field(default_factory=TachometerErrors)
    inverter: InverterErrors = field(default_factory=InverterErrors)
    voltmeter: VoltmeterErrors = field(default_factory=VoltmeterErrors)
    drive: DriveErrors = field(default_factory=DriveErrors)
    insulation_tester: InsulationErrors = field(default_factory=InsulationErrors)

    @classmethod
    def drawn(cls, generator: np.random.Generator, *, fixture: bool = False) -> "Errors":
        """Draw a bench of instruments, each within its maker's specification, evenly spread; with `fixture` also its tester."""
        return cls(
            SupplyErrors.drawn(generator),
            LcrErrors.drawn(generator),
            ScopeErrors.drawn(generator),
            DynamometerErrors.drawn(generator),
            TachometerErrors.drawn(generator),
            InverterErrors.drawn(generator),
            VoltmeterErrors.drawn(generator),
            DriveErrors.drawn(generator),
            InsulationErrors.drawn(generator) if fixture else InsulationErrors(),
        )
