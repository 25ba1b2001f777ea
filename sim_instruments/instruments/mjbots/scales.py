"""The mapping of SI-like values onto the integer registers of moteus.

Sources: `fw/moteus_controller.cc` (ScaleMapping, ScaleSaturate, ValueScaler), and the documentation's page of the registers; the
mapping tables of omelia-iliffe/moteus-rs, a library by somebody else, agree.
"""

import math
from dataclasses import dataclass

import numpy as np

from sim_instruments.instruments.mjbots.multiplex import FLOAT, INT32

_LARGEST = (0x7F, 0x7FFF, 0x7FFFFFFF)


@dataclass(frozen=True)
class RegisterScale:
    """The value of one count of int8, int16 and int32; the most negative count stands for NaN."""

    int8: float
    int16: float
    int32: float

    def count(self, value: float, kind: int) -> float:
        """Return a value as it goes out in a type: cut towards zero and saturated, a float as it is."""
        if kind == FLOAT:
            return _single(value)
        largest = _LARGEST[kind]
        if not math.isfinite(value):
            return -largest - 1
        # In single precision as the firmware computes it: 0.5 A are 499 counts of 1 mA.
        scaled = float(np.float32(value) / np.float32(self._step(kind)))
        return int(min(max(scaled, -float(largest)), float(largest)))

    def value(self, count: float, kind: int) -> float:
        """Return the value of a count that came in a type."""
        if kind == FLOAT:
            return count
        if count == -_LARGEST[kind] - 1:
            return math.nan
        return float(np.float32(count) * np.float32(self._step(kind)))

    def _step(self, kind: int) -> float:
        return (self.int8, self.int16, self.int32)[kind]


class WholeNumber(RegisterScale):
    """Numbers and bits, which are the same in every type; what a type does not hold loses its upper bits."""

    def __init__(self) -> None:
        super().__init__(1.0, 1.0, 1.0)

    def count(self, value: float, kind: int) -> float:
        """Return a number as it goes out in a type."""
        if kind == FLOAT:
            return _single(value)
        bits = (8, 16, 32)[kind]
        low = int(value) & (1 << bits) - 1
        return low - (1 << bits) if low >> bits - 1 else low

    def value(self, count: float, kind: int) -> float:
        """Return a number that came in a type; the firmware keeps its lowest byte, of an int32 all."""
        if not math.isfinite(count):
            return 0.0
        return int(count) if kind == INT32 else self.count(int(count), 0)


def _single(value: float) -> float:
    with np.errstate(over="ignore"):
        return float(np.float32(value))


WHOLE = WholeNumber()
POSITION = RegisterScale(0.01, 0.0001, 0.00001)
VELOCITY = RegisterScale(0.1, 0.00025, 0.00001)
ACCELERATION = RegisterScale(0.05, 0.001, 0.00001)
TEMPERATURE = CURRENT = RegisterScale(1.0, 0.1, 0.001)
PWM = RegisterScale(1.0 / 127.0, 1.0 / 32767.0, 1.0 / 2147483647.0)
VOLTAGE = RegisterScale(0.5, 0.1, 0.001)
TORQUE = RegisterScale(0.5, 0.01, 0.001)
TIME = RegisterScale(0.01, 0.001, 0.000001)
POWER = RegisterScale(10.0, 0.05, 0.0001)
