"""Individual errors of the instruments: a healthy unit by default, or drawn from its maker's specification."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from sim_instruments.disturbances.current_loop import CurrentLoop

#: Draws a unit's error from a limit of error.
Draw = Callable[[np.random.Generator, float], float]


def evenly(generator: np.random.Generator, limit: float) -> float:
    """Draw an error anywhere within its limit, each place equally likely."""
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
    def drawn(cls, generator: np.random.Generator, draw: Draw = evenly) -> "SupplyErrors":
        """Draw a unit within 0.03 % + 3 mV and 0.1 % + 5 mA setting, 0.03 % + 2 mV and 0.05 % + 5 mA reading."""
        return cls(
            set_voltage_gain=draw(generator, 3.0e-4),
            set_voltage_offset=draw(generator, 3.0e-3),
            set_current_gain=draw(generator, 1.0e-3),
            set_current_offset=draw(generator, 5.0e-3),
            voltage_gain=draw(generator, 3.0e-4),
            voltage_offset=draw(generator, 2.0e-3),
            current_gain=draw(generator, 5.0e-4),
            current_offset=draw(generator, 5.0e-3),
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
    def drawn(cls, generator: np.random.Generator, draw: Draw = evenly) -> "LcrErrors":
        """Draw a unit anywhere within the data sheet's accuracy formula (Keysight 5989-4435EN).

        Drawn evenly, the shares are the shadows of points on a sphere: whatever part of the impedance is read, resistance, reactance
        or magnitude, its error is then spread evenly between the limits, and never beyond them.
        """
        radius = np.sqrt(1.0 - generator.uniform(0.0, 1.0, 3) ** 2)
        if draw is not evenly:
            radius = np.abs([draw(generator, 1.0) for _ in range(3)])
        angle = generator.uniform(0.0, 2.0 * np.pi, 3)
        share = radius * np.exp(1j * angle)
        return cls(0.0, 0.0, 0.0, 0.0, (complex(share[0]), complex(share[1]), complex(share[2])))


@dataclass(frozen=True)
class ScopeErrors:
    """Errors of an oscilloscope: of all channels alike, by their common reference, `reference` (relative).

    `gain` (relative) and `offset` (of the full scale) are a channel's own, `time_base` (relative).
    """

    gain: tuple[float, float, float, float] = (5.0e-4, -4.0e-4, 3.0e-4, -5.0e-4)
    offset: tuple[float, float, float, float] = (1.0e-4, -1.0e-4, 0.5e-4, -0.8e-4)
    time_base: float = 2.0e-7
    reference: float = 0.0

    @classmethod
    def drawn(cls, generator: np.random.Generator, draw: Draw = evenly) -> "ScopeErrors":
        """Draw a unit within ±2 % of full scale, ±0.1 division offset and ±1.6 ppm (Keysight 5992-0140EN).

        A trace over the whole screen is off by 2 % of it at most. The reference's error is in every channel; a channel has to itself
        what that leaves of the limit.
        """
        reference = draw(generator, 0.02)
        gain = [draw(generator, 0.02 - abs(reference)) for _ in range(4)]
        offset = [draw(generator, 0.0125) for _ in range(4)]
        return cls(
            (gain[0], gain[1], gain[2], gain[3]),
            (offset[0], offset[1], offset[2], offset[3]),
            draw(generator, 1.6e-6),
            reference,
        )


@dataclass(frozen=True)
class DynamometerErrors:
    """Errors of a torque transducer: `torque_gain` and `speed_gain` relative, `torque_offset` N·m until it is zeroed."""

    torque_gain: float = 5.0e-4
    torque_offset: float = 5.0e-4
    speed_gain: float = 0.0

    @classmethod
    def drawn(
        cls, generator: np.random.Generator, draw: Draw = evenly, rated_torque: float = 5.0
    ) -> "DynamometerErrors":
        """Draw a unit within ±0.2 % gain, ±0.1 % of `rated_torque` offset and ±0.02 % speed."""
        return cls(draw(generator, 2.0e-3), draw(generator, 1.0e-3 * rated_torque), draw(generator, 2.0e-4))


@dataclass(frozen=True)
class TachometerErrors:
    """Errors of a tachometer: `gain` is relative."""

    gain: float = 0.0

    @classmethod
    def drawn(cls, generator: np.random.Generator, draw: Draw = evenly) -> "TachometerErrors":
        """Draw a unit within ±0.05 %; the digit comes on top."""
        return cls(draw(generator, 5.0e-4))


_HEALTHY_LOOP = CurrentLoop(
    current_gain=5.0e-4,
    current_offset_a=2.0e-3,
    current_offset_b=-1.0e-3,
    voltage_gain=-3.0e-4,
    angle_error=1.0e-3,
    voltage_delay=1.0e-5,
    current_noise=5.0e-3,
    voltage_noise=5.0e-3,
)


@dataclass(frozen=True)
class InverterErrors:
    """Errors of an inverter: `frequency_gain` and `current_gain` are relative, of one that turns a field or regulates the q current.

    `loop` is what one has that regulates both currents at its rotor's angle and tells its voltages.
    """

    frequency_gain: float = 0.0
    current_gain: float = 2.0e-3
    loop: CurrentLoop = _HEALTHY_LOOP

    @classmethod
    def drawn(cls, generator: np.random.Generator, draw: Draw = evenly) -> "InverterErrors":
        """Draw a unit within ±50 ppm of frequency and ±2 % of current; its loop as `CurrentLoop.drawn`."""
        # A stream of its own: what is drawn after it stays what it was without.
        return cls(draw(generator, 5.0e-5), draw(generator, 0.02), CurrentLoop.drawn(generator.spawn(1)[0], draw))


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
    def drawn(cls, generator: np.random.Generator, draw: Draw = evenly) -> "DriveErrors":
        """Draw a unit within ±0.1 % + 5 mV of voltage, ±0.2 % + 5 mA of current and ±50 ppm of frequency."""
        return cls(
            voltage_gain=draw(generator, 1.0e-3),
            voltage_offset=draw(generator, 5.0e-3),
            current_gain=draw(generator, 2.0e-3),
            current_offset=draw(generator, 5.0e-3),
            frequency_gain=draw(generator, 5.0e-5),
        )


@dataclass(frozen=True)
class VoltmeterErrors:
    """Errors of a DC voltmeter in its ranges 100 mV, 1, 10, 100, 1000 V.

    `gain` is relative to the reading, `offset` to the range; the defaults are a tenth of the data sheet's limits.
    """

    gain: tuple[float, ...] = (5.0e-6, 4.0e-6, 3.5e-6, 4.5e-6, 4.5e-6)
    offset: tuple[float, ...] = (-3.5e-6, -0.7e-6, 0.5e-6, -0.6e-6, 1.0e-6)

    @classmethod
    def drawn(cls, generator: np.random.Generator, draw: Draw = evenly) -> "VoltmeterErrors":
        """Draw a unit within the 1-year accuracy at 23 ± 5 °C (Keysight 34461A data sheet, 5991-1983EN)."""
        gain = (5.0e-5, 4.0e-5, 3.5e-5, 4.5e-5, 4.5e-5)
        offset = (3.5e-5, 0.7e-5, 0.5e-5, 0.6e-5, 1.0e-5)
        return cls(tuple(draw(generator, limit) for limit in gain), tuple(draw(generator, limit) for limit in offset))


@dataclass(frozen=True)
class InsulationErrors:
    """Errors of an insulation tester: `voltage_gain` and `resistance_gain` relative, `noise` relative (standard deviation)."""

    voltage_gain: float = -2.0e-3
    resistance_gain: float = 5.0e-3
    noise: float = 2.0e-3

    @classmethod
    def drawn(cls, generator: np.random.Generator, draw: Draw = evenly) -> "InsulationErrors":
        """Draw a unit within ±1 % of voltage and ±5 % of resistance."""
        return cls(draw(generator, 0.01), draw(generator, 0.05))


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
    def drawn(cls, generator: np.random.Generator, draw: Draw = evenly, *, fixture: bool = False) -> "Errors":
        """Draw a bench of instruments, each within its maker's specification; with `fixture` also its tester."""
        return cls(
            SupplyErrors.drawn(generator, draw),
            LcrErrors.drawn(generator, draw),
            ScopeErrors.drawn(generator, draw),
            DynamometerErrors.drawn(generator, draw),
            TachometerErrors.drawn(generator, draw),
            InverterErrors.drawn(generator, draw),
            VoltmeterErrors.drawn(generator, draw),
            DriveErrors.drawn(generator, draw),
            InsulationErrors.drawn(generator, draw) if fixture else InsulationErrors(),
        )
