"""Tachometer that streams Lutron's 16-character frame, one a second, 9600 8N1 (Lutron RS232 data format)."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from sim_instruments.faults.line_faults import Fault, FaultKind, Faults, spoil
from sim_instruments.instruments.errors import TachometerErrors
from sim_instruments.transports.connection import Connection

if TYPE_CHECKING:
    from sim_instruments.world.world import World

_GATE = 1.0
_PERIOD = 1.0
_FINE_BELOW = 1000.0
_HIGHEST = 99_999_999


def frame(value: float, decimals: int, annunciator: str = "22") -> bytes:
    """Return the frame that shows `value` with some decimals.

    STX, "4", "1", two characters of the unit, polarity "0" or "1", position of the point, eight digits, CR. Raises
    ValueError for what does not fit.
    """
    digits = round(abs(value) * 10**decimals)
    if not 0 <= decimals <= 3 or digits > _HIGHEST or len(annunciator) != 2:
        raise ValueError(f"{value} with {decimals} decimals and annunciator {annunciator!r} does not fit the frame")
    polarity = "1" if value < 0.0 and digits else "0"
    return f"\x0241{annunciator}{polarity}{decimals}{digits:08d}\r".encode("ascii")


class LutronTachometer:
    """Simulated side of the tachometer: 0.1 rpm below 1000 rpm, 1 rpm above, ± one digit, no sign."""

    def __init__(
        self,
        world: "World",
        generator: np.random.Generator,
        errors: TachometerErrors | None = None,
        *,
        annunciator: str = "22",
    ) -> None:
        self.faults = Faults()
        self.connection = Connection()
        self._world = world
        self._random = generator
        self._errors = errors or TachometerErrors()
        self._annunciator = annunciator
        self._sent = 0.0

    def due(self, time: float) -> Callable[[], bytes] | None:
        """Return what gives the bytes sent at a virtual time: the latest frame if a second has passed since the last.

        Who asks it late is told the same bytes, as long as the world remembers the gate before `time`.
        """
        if time - self._sent < _PERIOD - 1.0e-9:
            return None
        self._sent += _PERIOD * math.floor((time - self._sent) / _PERIOD + 1.0e-9)
        fault: Fault | None = self.faults.strike("frame") if self.faults else None
        dither = self._dither()
        if fault is None:
            return lambda: self._display(time, dither)
        if fault.kind is FaultKind.LATE:
            self._sent += fault.delay
            return None
        spoilt = self._spoilt(fault, self._display(time, dither))
        return lambda: spoilt

    def _spoilt(self, fault: Fault, shown: bytes) -> bytes:
        match fault.kind:
            case FaultKind.FROZEN:
                return fault.remembered("frame", shown)
            case FaultKind.STALE:
                before = fault.memory.get("frame", b"")
                fault.memory["frame"] = shown
                return before
            case FaultKind.NOT_A_NUMBER | FaultKind.OVERFLOW:
                digit = b"-" if fault.kind is FaultKind.NOT_A_NUMBER else b"9"
                return shown[:7] + digit * 8 + shown[15:]
        return spoil(fault, shown, self._random)

    def reading(self) -> bytes:
        """Return a frame of the present speed."""
        return self._display(None, self._dither())

    def _dither(self) -> float:
        # Counting against a clock of its own, the last digit falls on either side.
        return float(self._random.uniform(-0.5, 0.5))

    def _display(self, time: float | None, dither: float) -> bytes:
        speed_rpm = self._world.shaft_speed(_GATE, time) * 60.0 / (2.0 * math.pi) * (1.0 + self._errors.gain)
        decimals = 1 if speed_rpm < _FINE_BELOW else 0
        dithered = speed_rpm * 10.0**decimals + dither
        shown = max(0, round(dithered)) if speed_rpm > 0.0 else 0
        return frame(min(shown, _HIGHEST) / 10.0**decimals, decimals, self._annunciator)
