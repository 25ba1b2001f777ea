"""Serial lines without hardware: pseudo-terminals in raw mode."""

import os
import termios
import tty
from collections.abc import Callable
from typing import Protocol

from sim_instruments.transports.connection import Connection

#: What a terminal's speed is in bit/s.
_RATES = {
    getattr(termios, f"B{rate}"): rate
    for rate in (300, 600, 1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400)
}


class StreamSource(Protocol):
    """An instrument that sends without being asked."""

    def due(self, time: float) -> Callable[[], bytes] | None:
        """Return what gives the bytes that it sends at a virtual time (s), None for none."""


class AdvancingClock(Protocol):
    """A clock that tells when it has moved."""

    def on_advance(self, callback: Callable[[float], None]) -> Callable[[], None]:
        """Run `callback` with the new time; return the function that undoes it."""


class PseudoTerminal:
    """A pseudo-terminal whose far end a client opens as a serial port."""

    def __init__(self) -> None:
        self.master, self._slave = os.openpty()
        tty.setraw(self.master)
        tty.setraw(self._slave)
        os.set_blocking(self.master, False)
        self.path = os.ttyname(self._slave)

    @property
    def rate(self) -> int | None:
        """The rate (bit/s) that the far end has set, None for one that is not usual."""
        return _RATES.get(termios.tcgetattr(self._slave)[5])

    @property
    def odd_parity(self) -> bool:
        """True if the far end has set odd parity. Linux does not keep even parity and seven data bits for a pseudo-terminal."""
        return bool(termios.tcgetattr(self._slave)[2] & termios.PARODD)

    def send(self, data: bytes) -> int:
        """Send bytes and return how many; bytes that were not read before the buffer is full are lost, as on a real line."""
        try:
            return os.write(self.master, data)
        except BlockingIOError:
            return 0

    def receive(self, count: int = 4096) -> bytes:
        """Return what has come in, possibly nothing."""
        try:
            data = os.read(self.master, count)
        except BlockingIOError:
            return b""
        self._leave_something_to_set()
        return data

    def _leave_something_to_set(self) -> None:
        """Set what has no effect in raw mode, so that whoever opens the far end next changes it.

        The C library refuses seven data bits or parity on a pseudo-terminal, which does not keep them, unless another setting was
        changed by the same call.
        """
        settings = termios.tcgetattr(self._slave)
        settings[3] |= termios.ECHOE
        termios.tcsetattr(self._slave, termios.TCSANOW, settings)

    def close(self) -> None:
        """Close both ends; again is allowed."""
        for descriptor in (self.master, self._slave):
            if descriptor >= 0:
                os.close(descriptor)
        self.master = self._slave = -1


class SerialStream:
    """Sends what a streaming instrument has to say as virtual time moves; nothing while its cable is out."""

    def __init__(self, source: StreamSource, clock: AdvancingClock, cable: Connection) -> None:
        self._source = source
        self._cable = cable
        self._line = PseudoTerminal()
        self._stop_listening = clock.on_advance(self._advance)

    @property
    def address(self) -> str:
        """Path of the serial port."""
        return self._line.path

    def _advance(self, time: float) -> None:
        frame = self._source.due(time)
        if frame is not None and self._cable.up:
            self._line.send(frame())

    def close(self) -> None:
        """Stop the stream and close the line."""
        self._stop_listening()
        self._line.close()
