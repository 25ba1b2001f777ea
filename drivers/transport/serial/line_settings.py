"""Framing of a serial line, by the keys of its address."""

import termios
from dataclasses import dataclass, field
from typing import Any

import serial
from serial.rs485 import RS485Settings

from drivers.transport.parameters import flag, number, one_of, parameters_of, refuse_unknown, whole

_PARITIES = {"N": "N", "E": "E", "O": "O", "M": "M", "S": "S"}
_STOP_BITS = {"1": 1, "1.5": 1.5, "2": 2}
_BYTE_SIZES = {"5": 5, "6": 6, "7": 7, "8": 8}
_FLOW = ("rtscts", "dsrdtr", "xonxoff", "exclusive")
_RS485 = ("rts_level_for_tx", "rts_level_for_rx", "delay_before_tx", "delay_before_rx", "loopback")

#: What opening or setting a port raises; pyserial lets the terminal interface's own error through.
PORT_ERRORS = (OSError, termios.error)
#: The keys that the address of a serial line may have.
LINE_KEYS = ("baudrate", "bytesize", "parity", "stopbits", *_FLOW, "rs485", *_RS485)


@dataclass(frozen=True)
class LineSettings:
    """Framing as pyserial names it, its flow control, and how RTS switches an RS-485 transceiver where it does."""

    baudrate: int
    bytesize: int = 8
    parity: str = "N"
    stopbits: float = 1
    flow: dict[str, bool] = field(default_factory=dict)
    rs485: RS485Settings | None = None

    def framing(self) -> dict[str, Any]:
        """Return rate and framing as arguments of pyserial."""
        return {
            "baudrate": self.baudrate,
            "bytesize": self.bytesize,
            "parity": self.parity,
            "stopbits": self.stopbits,
        }

    def apply(self, port: serial.Serial) -> None:
        """Set on an open port what is no part of the framing. Raises ValueError or OSError where the port cannot do it."""
        for key, value in self.flow.items():
            setattr(port, key, value)
        if self.rs485 is not None:
            port.rs485_mode = self.rs485


def line_settings(given: dict[str, str], baudrate: int = 9600) -> LineSettings:
    """Return what the keys of an address say, of those in `LINE_KEYS`. Raises ValueError for a value that cannot be."""
    flow: dict[str, bool] = {key: flag(given, key) for key in _FLOW if key in given}
    rs485 = None
    if flag(given, "rs485", default=any(key in given for key in _RS485)):
        rs485 = RS485Settings(
            rts_level_for_tx=flag(given, "rts_level_for_tx", default=True),
            rts_level_for_rx=flag(given, "rts_level_for_rx"),
            loopback=flag(given, "loopback"),
            delay_before_tx=number(given, "delay_before_tx", 0.0, 0.0),
            delay_before_rx=number(given, "delay_before_rx", 0.0, 0.0),
        )
    return LineSettings(
        whole(given, "baudrate", baudrate, 1),
        int(str(one_of(given, "bytesize", _BYTE_SIZES, 8))),
        str(one_of(given, "parity", _PARITIES, "N")),
        float(str(one_of(given, "stopbits", _STOP_BITS, 1))),
        flow,
        rs485,
    )


def open_port(address: str, baudrate: int, timeout: float) -> serial.Serial:
    """Return an open port: of a device, whose address may have the keys of `LINE_KEYS`, or of a URL that pyserial takes.

    `baudrate` (bit/s) is the rate where the address says none, `timeout` (s) that of a read. Raises ValueError for a key or a value that
    cannot be, one of PORT_ERRORS where the port cannot be opened.
    """
    if "://" in address:
        return serial.serial_for_url(address, baudrate=baudrate, timeout=timeout)
    path, _, query = address.partition("?")
    parameters = parameters_of(query)
    refuse_unknown(parameters, LINE_KEYS)
    settings = line_settings(parameters, baudrate)
    port = serial.Serial(path, timeout=timeout, **settings.framing())
    try:
        settings.apply(port)
    except BaseException:
        port.close()
        raise
    return port
