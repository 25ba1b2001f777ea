"""Errors of an inverter that regulates currents at its rotor's angle: its legs, current sensors, encoder and timing."""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from sim_instruments.world.machine_data import InverterStage

_NOT_NEGATIVE = ("dead_time", "device_drop", "device_resistance", "knee_current", "current_noise", "voltage_noise")


@dataclass(frozen=True)
class CurrentLoop:
    """Imperfections of one inverter; by default none.

    Of its legs: `dead_time` (s), `device_drop` (V), `device_resistance` (Ω), and `knee_current` (A) below which dead time and drop fade.
    Of its sensors: `current_gain` (really flowing over shown, minus 1), `current_offset_a` and `current_offset_b` (A, shown by phase A's
    and B's without a current), `voltage_gain` (of the bus voltage, shown over real, minus 1); `angle_error` (rad, electrical: how far the
    encoder's d axis lies ahead of the real one). `voltage_delay` (s): how much later than commanded the voltage is put out.
    `current_noise` (A) and `voltage_noise` (V): standard deviation of a reading of either axis.
    """

    dead_time: float = 0.0
    device_drop: float = 0.0
    device_resistance: float = 0.0
    knee_current: float = 0.0
    current_gain: float = 0.0
    current_offset_a: float = 0.0
    current_offset_b: float = 0.0
    voltage_gain: float = 0.0
    angle_error: float = 0.0
    voltage_delay: float = 0.0
    current_noise: float = 0.0
    voltage_noise: float = 0.0

    def __post_init__(self) -> None:
        for entry in fields(self):
            value = getattr(self, entry.name)
            if not math.isfinite(value) or (entry.name in _NOT_NEGATIVE and value < 0.0):
                allowed = "finite and not negative" if entry.name in _NOT_NEGATIVE else "finite"
                raise ValueError(f"CurrentLoop: {entry.name} is {value}; it must be {allowed}")

    @classmethod
    def drawn(
        cls, generator: np.random.Generator, draw: Callable[[np.random.Generator, float], float]
    ) -> "CurrentLoop":
        """Draw a drive within ±0.5 % of current, ±20 mA, ±0.3 % of voltage, ±0.5° of the electrical angle, and 0 to 40 µs late."""
        return cls(
            current_gain=draw(generator, 5.0e-3),
            current_offset_a=draw(generator, 0.02),
            current_offset_b=draw(generator, 0.02),
            voltage_gain=draw(generator, 3.0e-3),
            angle_error=draw(generator, math.radians(0.5)),
            voltage_delay=2.0e-5 + draw(generator, 2.0e-5),
            current_noise=5.0e-3,
            voltage_noise=5.0e-3,
        )

    def with_more(self, other: "CurrentLoop") -> "CurrentLoop":
        """Return the same with another's on top: errors add up, noise by its squares."""
        both = {entry.name: getattr(self, entry.name) + getattr(other, entry.name) for entry in fields(self)}
        for name in ("current_noise", "voltage_noise"):
            both[name] = math.hypot(getattr(self, name), getattr(other, name))
        return CurrentLoop(**both)

    def stage(self, stage: InverterStage) -> InverterStage:
        """Return a stage whose legs have these on top."""
        return replace(
            stage,
            dead_time=stage.dead_time + self.dead_time,
            device_drop=stage.device_drop + self.device_drop,
            device_resistance=stage.device_resistance + self.device_resistance,
            knee_current=max(stage.knee_current, self.knee_current),
        )

    @property
    def offset(self) -> complex:
        """The undetected current (A, along phase A's axis + j·across it) due to the offsets of the sensors."""
        along = (2.0 * self.current_offset_a - self.current_offset_b) / 3.0
        return -complex(along, self.current_offset_b / math.sqrt(3.0)) * (1.0 + self.current_gain)

    def flowing(self, shown: complex) -> complex:
        """Return what flows (A, d + j·q of the real rotor) where the drive regulates a current in its own coordinates."""
        return shown * (1.0 + self.current_gain) * complex(math.cos(self.angle_error), math.sin(self.angle_error))

    def shown(self, flowing: complex) -> complex:
        """Return what the drive takes a current for (A, d + j·q of its own), without noise."""
        return flowing / self.flowing(1.0 + 0j)

    def commanded(self, voltage: complex, electrical_speed: float) -> complex:
        """Return what the drive commands (V, d + j·q of its own) for a voltage of the real rotor's coordinates, without noise.

        The rotor turns on until a voltage is put out, so that it is commanded ahead.
        """
        ahead = electrical_speed * self.voltage_delay - self.angle_error
        return voltage * (1.0 + self.voltage_gain) * complex(math.cos(ahead), math.sin(ahead))
