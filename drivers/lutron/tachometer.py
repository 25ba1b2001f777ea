"""Lutron tachometers with the 16-character serial stream, 9600 baud, 8N1."""

import math
from dataclasses import replace
from typing import Protocol

from drivers.catalogue import Surroundings
from drivers.interfaces import (
    UNWATCHED,
    Accuracy,
    Calls,
    Clock,
    CommunicationError,
    Identity,
    MeasurementError,
    Reading,
    Tachometer,
    Traffic,
)
from drivers.interfaces.text import text
from drivers.lutron.frame import END, LENGTH, START, Frame, parse_frame
from drivers.lutron.options import LutronTachometerOptions
from drivers.transport.in_process import is_in_process, open_stream
from drivers.transport.serial.line_settings import PORT_ERRORS, open_port
from drivers.transport.serial.port_errors import not_opened
from drivers.transport.serial.ports import StreamPort, TappedPort

RPM = 2 * math.pi / 60
#: Limit of error of handheld tachometers of this class.
ACCURACY_RPM = 1.0
SOURCE = "±1 rpm, typical of its class; enter the calibration"
#: More than this never comes without a frame's end on a healthy line.
LONGEST_WAIT = 4 * LENGTH
#: A frame starts a little late on a real line; half a period would already be another reading.
PERIOD_MARGIN = 0.02


class SerialPort(Protocol):
    """The part of a pyserial port that a tachometer uses."""

    def reset_input_buffer(self) -> None:
        """Throw away what has arrived."""

    def read_until(self, expected: bytes = b"\n", size: int | None = None, /) -> bytes:
        """Return bytes up to and with `expected`, at most `size`, or what came before the time-out."""

    def close(self) -> None:
        """Close the port."""


class LutronTachometer(Tachometer):
    """A tachometer that sends its display once per update period over an open serial port."""

    def __init__(
        self,
        port: SerialPort,
        clock: Clock,
        options: LutronTachometerOptions,
        *,
        name: str = "tachometer",
        traffic: Traffic | None = None,
        calls: Calls = UNWATCHED,
    ) -> None:
        self._port = port
        self._clock = clock
        self._options = options
        self._name = name
        self._traffic = traffic
        self._calls = calls

    @classmethod
    def open(
        cls, address: str, options: LutronTachometerOptions, surroundings: Surroundings, name: str
    ) -> "LutronTachometer":
        """Open the tachometer on a serial device, which may have keys (`/dev/ttyUSB0?rtscts=1`), on a pyserial URL, or in process.

        Raises CommunicationError where the port cannot be opened.
        """
        timeout = 2 * options.update_period
        port: SerialPort
        try:
            if is_in_process(address):
                port = StreamPort(open_stream(address, surroundings.in_process, name), timeout)
            else:
                port = open_port(address, 9600, timeout)
        except (ValueError, *PORT_ERRORS) as error:
            if "://" not in address and not isinstance(error, ValueError):
                raise not_opened(name, address, error) from error
            raise CommunicationError(
                name,
                text("cannot be opened at {address} ({error})", address=address, error=error),
                remedy=text("Check the address and the cable"),
            ) from error
        if surroundings.wire is not None:
            port = TappedPort(port, surroundings.wire)
        return cls(port, surroundings.clock, options, name=name, traffic=surroundings.traffic, calls=surroundings.calls)

    @property
    def identity(self) -> Identity:
        """The maker and the model of the station file; the instrument itself does not tell."""
        return Identity("Lutron", self._options.model)

    def measure_speed(self) -> Reading:
        """Wait for the next frame and return its speed (rad/s, mechanical, without sign).

        Raises CommunicationError for no or a malformed frame, MeasurementError where the display is not in rpm
        or beyond the instrument's range.
        """
        frame = self._next_frame()
        if frame.annunciator != self._options.annunciator:
            raise MeasurementError(
                self._name,
                text(
                    "the display is not in rpm (annunciator {annunciator} instead of {wanted})",
                    annunciator=frame.annunciator,
                    wanted=self._options.annunciator,
                ),
                remedy=text(
                    "Select rpm on the instrument; where it shows rpm, enter its code as annunciator in the station file"
                ),
            )
        speed = frame.value * RPM
        if speed > self._options.speed_limit:
            raise MeasurementError(self._name, text("{value:g} rpm is beyond its range", value=frame.value))
        return Reading(speed, "rad/s", self._accuracy(frame), self._clock.now())

    def make_safe(self) -> None:
        """Do nothing: a tachometer only listens."""

    def close(self) -> None:
        """Close the port; may be called twice."""
        self._port.close()

    def _next_frame(self) -> Frame:
        try:
            self._port.reset_input_buffer()
            raw = self._awaited()
            if len(raw) < LENGTH and raw.endswith(END) and not raw.startswith(START):
                # The buffer was emptied in the middle of a frame: this is its tail.
                raw = self._awaited()
        except OSError as error:
            raise CommunicationError(
                self._name, text("the port fails ({error})", error=error), remedy=text("Check the cable")
            ) from error
        if self._traffic is not None:
            self._traffic("read", repr(raw))
        if not raw:
            raise CommunicationError(self._name, text("sends nothing"), remedy=text("Switch it on and check the cable"))
        try:
            return parse_frame(raw)
        except ValueError as error:
            raise CommunicationError(
                self._name, text("no frame: {error} in {raw}", error=error, raw=repr(raw))
            ) from error

    def _awaited(self) -> bytes:
        self._clock.sleep(self._options.update_period * (1 + PERIOD_MARGIN))
        return self._read()

    def _read(self) -> bytes:
        with self._calls.exchange():
            return self._port.read_until(END, LONGEST_WAIT)

    def _accuracy(self, frame: Frame) -> Accuracy:
        stated = self._options.accuracy or Accuracy(offset=ACCURACY_RPM * RPM, source=SOURCE)
        # The last digit's place changes with the speed, so it is the frame that tells it.
        return stated if stated.resolution else replace(stated, resolution=frame.step * RPM)
