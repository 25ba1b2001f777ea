"""Beckhoff BK9000 Bus Coupler with a relay terminal (Beckhoff Information System, Modbus TCP interface, watchdog).

Its watchdog begins with the first telegram that writes process data. Fed by telegrams that write process data (type 0) or that read or
write it (type 1), it switches all outputs off once it has run out, and refuses process data until it is reset by two words. Its
registers can be written while it does not run; they are kept.
"""

import threading
from collections.abc import Callable
from time import monotonic

from sim_instruments.instruments.registers import (
    DEVICE_FAILURE,
    ILLEGAL_ADDRESS,
    ILLEGAL_VALUE,
    RegisterError,
    exists,
)
from sim_instruments.instruments.silence import SilenceWatch

_STATUS, _ELAPSED = 0x100C, 0x8000
_OUTPUT_BITS = 0x1012
_LEFT, _TIME, _RESET, _TYPE = 0x1020, 0x1120, 0x1121, 0x1122
_READ_OR_WRITE = 1
_FIRST_WORD, _SECOND_WORD = 0xBECF, 0xAFFE
_DEFAULT_TIME = 1000


class Bk9000:
    """Simulated side of the coupler. `contact` is told whether the contact of output 0 is closed, each time it moves."""

    ranges = ((_STATUS, 1), (_OUTPUT_BITS, 1), (_LEFT, 1), (_TIME, 3))
    readings = (0, 0, 1)
    unit = 1

    def __init__(self, contact: Callable[[bool], None]) -> None:
        self._contact = contact
        self._lock = threading.RLock()
        self._outputs = [False] * 2
        self._time, self._type, self._word = _DEFAULT_TIME, _READ_OR_WRITE, 0
        self._running = self._elapsed = False
        self._fed = 0.0
        self._watch = SilenceWatch(self._run_out)

    def close(self) -> None:
        """Stop the supervision; may be called again."""
        self._watch.close()

    def read_bits(self, address: int, count: int) -> list[bool]:
        """Return outputs. Raises RegisterError 2 where there are fewer, 4 once the watchdog has run out."""
        with self._lock:
            self._check_outputs(address, count)
            if self._type == _READ_OR_WRITE:
                self._feed()
            return self._outputs[address : address + count]

    def write_bit(self, address: int, on: bool) -> None:
        """Switch an output. Raises RegisterError 2 where there is none, 4 once the watchdog has run out."""
        with self._lock:
            self._check_outputs(address, 1)
            if self._time and not self._running:
                self._running = True
                self._watch.watch(self._time * 1e-3)
            self._feed()
            self._set(address, on)

    def read(self, address: int, count: int) -> list[int]:
        """Return registers. Raises RegisterError 2 for one that does not exist."""
        if not exists(self.ranges, address, count):
            raise RegisterError(ILLEGAL_ADDRESS, f"BK9000 has no registers {address:04X}H … {address + count - 1:04X}H")
        with self._lock:
            return [self._value(number) for number in range(address, address + count)]

    def write(self, address: int, values: list[int]) -> None:
        """Write registers. Raises RegisterError 2 for one that cannot be written, 3 for a value out of range, 4 while the watchdog runs."""
        if not exists(self.ranges[-1:], address, len(values)):
            raise RegisterError(ILLEGAL_ADDRESS, f"BK9000 register {address:04X}H cannot be written")
        with self._lock:
            for number, value in enumerate(values, address):
                self._write(number, value)

    def _write(self, number: int, value: int) -> None:
        if number == _RESET:
            if self._word == _FIRST_WORD and value == _SECOND_WORD:
                self._running = self._elapsed = False
                self._watch.watch(0.0)
            self._word = value
            return
        if self._running:
            raise RegisterError(DEVICE_FAILURE, f"BK9000 register {number:04X}H: the watchdog is running")
        if number == _TYPE:
            if value not in (0, _READ_OR_WRITE):
                raise RegisterError(ILLEGAL_VALUE, f"BK9000 has no watchdog of type {value}")
            self._type = value
        else:
            self._time = value

    def _value(self, number: int) -> int:
        if number == _STATUS:
            return _ELAPSED if self._elapsed else 0
        if number == _LEFT:
            left = self._time - (monotonic() - self._fed) * 1e3 if self._running else self._time
            return round(max(0.0, left))
        return {_OUTPUT_BITS: len(self._outputs), _TIME: self._time, _TYPE: self._type}.get(number, 0)

    def _check_outputs(self, address: int, count: int) -> None:
        if address + count > len(self._outputs):
            raise RegisterError(ILLEGAL_ADDRESS, f"the coupler has {len(self._outputs)} outputs")
        if self._elapsed:
            raise RegisterError(DEVICE_FAILURE, "the coupler's watchdog has run out")

    def _feed(self) -> None:
        self._fed = monotonic()
        self._watch.heard()

    def _run_out(self) -> None:
        with self._lock:
            # A telegram may have come, or a reset, while this waited.
            if not self._running or monotonic() - self._fed < self._time * 1e-3:
                self._watch.heard()
                return
            self._running, self._elapsed = False, True
            for number in range(len(self._outputs)):
                self._set(number, False)

    def _set(self, number: int, on: bool) -> None:
        moves = number == 0 and self._outputs[0] is not on
        self._outputs[number] = on
        if moves:
            self._contact(on)
