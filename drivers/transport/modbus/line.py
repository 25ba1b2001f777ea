"""Registers on a Modbus line, with errors that name the register."""

import logging
import struct
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Protocol, cast
from urllib.parse import urlsplit

import serial
from pymodbus import FramerType
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ModbusException
from pymodbus.pdu import ModbusPDU
from pymodbus.transport import CommParams

from drivers.interfaces import UNWATCHED, Calls, Clock, CommunicationError, ReportedError, Traffic
from drivers.interfaces.text import Text, text
from drivers.transport.in_process import InProcess, is_in_process, open_stream
from drivers.transport.modbus.stream_client import ModbusStreamClient
from drivers.transport.modbus.tapped_client import TappedClient
from drivers.transport.parameters import one_of, parameters_of, refuse_unknown
from drivers.transport.serial.line_settings import LINE_KEYS, PORT_ERRORS, LineSettings, line_settings
from drivers.transport.serial.port_errors import not_opened
from drivers.transport.wire import Wire

# What goes wrong is raised, in words of ours: without a handler its own would be printed among them.
logging.getLogger("pymodbus").addHandler(logging.NullHandler())

#: RTU frames over TCP are what a plain serial gateway carries.
_FRAMERS = {"tcp": FramerType.SOCKET, "rtu": FramerType.RTU, "ascii": FramerType.ASCII}
_SERIAL_FRAMERS = {"rtu": FramerType.RTU, "ascii": FramerType.ASCII}

#: Modbus Application Protocol V1.1b3, section 7.
EXCEPTION_NAMES = {
    1: text("illegal function"),
    2: text("illegal data address"),
    3: text("illegal data value"),
    4: text("server device failure"),
    5: text("acknowledge"),
    6: text("server device busy"),
    8: text("memory parity error"),
    10: text("gateway path unavailable"),
    11: text("gateway target device failed to respond"),
}
_NO_EXCEPTION = text("not of the standard")
#: Exceptions by which a gateway says that the unit itself does not answer.
NO_SUCH_UNIT = (10, 11)

#: What pymodbus lets through besides its own exceptions when bytes on the line make no sense.
LINE_ERRORS = (ModbusException, OSError, ValueError, IndexError, struct.error)

#: Silence (s) between the frames of a serial line: what follows sooner a drive takes for the rest of the frame before, though
#: it was another unit's (Delta C2000 and CP2000 manuals, 12.1-09: more than 10 ms).
RTU_SILENCE = 0.011


class ModbusClient(Protocol):
    """The part of a synchronous pymodbus client that a line uses."""

    @property
    def comm_params(self) -> CommParams:
        """Its time-out (s) for a reply, among others."""

    def read_holding_registers(self, address: int, *, count: int = 1, device_id: int = 1) -> ModbusPDU:
        """Read registers (function 3)."""

    def write_register(self, address: int, value: int, *, device_id: int = 1) -> ModbusPDU:
        """Write one register (function 6)."""

    def write_registers(self, address: int, values: list[int], *, device_id: int = 1) -> ModbusPDU:
        """Write registers (function 16)."""

    def read_coils(self, address: int, *, count: int = 1, device_id: int = 1) -> ModbusPDU:
        """Read coils (function 1)."""

    def write_coil(self, address: int, value: bool, *, device_id: int = 1) -> ModbusPDU:
        """Write one coil (function 5)."""

    def connect(self) -> bool:
        """Open the connection; false where that fails."""

    def close(self) -> None:
        """Close the connection."""


class ModbusLine:
    """Holding registers and coils of the units on one line, through an open pymodbus client.

    A read without an answer is repeated once; a write never is. With a `clock`, frames keep the silence of a serial line.
    """

    def __init__(
        self,
        client: ModbusClient,
        name: str,
        *,
        traffic: Traffic | None = None,
        calls: Calls = UNWATCHED,
        clock: Clock | None = None,
    ) -> None:
        self.name = name
        self._client = client
        self._traffic = traffic
        self.calls = calls
        # A drive's watchdog is fed beside whatever else is asked.
        self._lock = threading.RLock()
        self._clock = clock
        self._last_frame: float | None = None

    def read(self, unit: int, address: int, count: int, what: str) -> list[int]:
        """Return `count` registers of a unit from `address`; `what` names them in errors.

        Raises ReportedError for a Modbus exception, CommunicationError for no or a wrong reply.
        """
        command = f"read {count} × {address:04X}H of unit {unit} ({what})"

        def asked() -> ModbusPDU:
            return self._client.read_holding_registers(address, count=count, device_id=unit)

        registers = list(self._exchanged(command, unit, address, asked, repeated=True).registers)
        self._trace("read", " ".join(f"{register:04X}" for register in registers))
        if len(registers) != count:
            raise CommunicationError(
                self.name,
                text("{registers} registers instead of {count}", registers=len(registers), count=count),
                command=command,
            )
        return registers

    def write(self, unit: int, address: int, value: int, what: str) -> None:
        """Write one register of a unit (function 6); errors as for `read`."""
        command = f"write {value:04X} to {address:04X}H of unit {unit} ({what})"
        self._exchanged(command, unit, address, lambda: self._client.write_register(address, value, device_id=unit))
        self._trace("read", "done")

    def write_block(self, unit: int, address: int, values: Sequence[int], what: str) -> None:
        """Write consecutive registers of a unit (function 16); errors as for `read`."""
        said = " ".join(f"{value:04X}" for value in values)
        command = f"write {said} to {address:04X}H of unit {unit} ({what})"
        self._exchanged(
            command, unit, address, lambda: self._client.write_registers(address, list(values), device_id=unit)
        )
        self._trace("read", "done")

    def read_coil(self, unit: int, number: int, what: str) -> bool:
        """Return one coil of a unit (function 1); not repeated, errors otherwise as for `read`."""
        command = f"read coil {number} of unit {unit} ({what})"
        reply = self._exchanged(command, unit, number, lambda: self._client.read_coils(number, count=1, device_id=unit))
        if not reply.bits:
            raise CommunicationError(self.name, text("a reply without a bit"), command=command)
        self._trace("read", str(int(reply.bits[0])))
        return bool(reply.bits[0])

    def write_coil(self, unit: int, number: int, value: bool, what: str) -> None:
        """Write one coil of a unit (function 5); errors as for `read`."""
        command = f"write {int(value)} to coil {number} of unit {unit} ({what})"
        self._exchanged(command, unit, number, lambda: self._client.write_coil(number, value, device_id=unit))
        self._trace("read", "done")

    def reopen(self) -> None:
        """Open the connection anew, so that nothing late is on it; raises CommunicationError where that fails."""
        with self._lock:
            self._client.close()
            connected = self._client.connect()
        if not connected:
            raise CommunicationError(
                self.name, text("cannot be opened again"), remedy=text("Check address, power and cable")
            )

    def close(self) -> None:
        """Close the connection; may be called twice."""
        with self._lock:
            self._client.close()

    def _exchanged(
        self, command: str, unit: int, address: int, ask: Callable[[], ModbusPDU], *, repeated: bool = False
    ) -> ModbusPDU:
        """Return what a unit replies to a request, which may be `repeated` once where no usable reply comes."""
        self._trace("write", command)
        with self._lock, self.calls.exchange():
            while True:
                try:
                    with self._limited():
                        reply = ask()
                    break
                except LINE_ERRORS as error:
                    if not repeated:
                        raise self._silence(command, error) from error
                    repeated = False
        self._check(reply, command, unit, address)
        return reply

    @contextmanager
    def _limited(self) -> Iterator[None]:
        """Wait no longer within the block than an energised source may be silent; on a serial line, begin after a silence."""
        clock, patience, parameters = self._clock, self.calls.patience, self._client.comm_params
        if clock is not None and self._last_frame is not None:
            left = self._last_frame + RTU_SILENCE - clock.now()
            if left > 0:
                clock.sleep(left)
        usual = parameters.timeout_connect
        if patience is not None and patience < (usual or 0.0):
            parameters.timeout_connect = patience
        try:
            yield
        finally:
            parameters.timeout_connect = usual
            if clock is not None:
                self._last_frame = clock.now()

    def _silence(self, command: str, error: Exception) -> CommunicationError:
        return CommunicationError(
            self.name,
            text("no usable reply ({error})", error=error),
            command=command,
            remedy=text("Check unit number, power and cable"),
        )

    def _check(self, reply: ModbusPDU, command: str, unit: int, address: int) -> None:
        if not reply.isError():
            return
        code = getattr(reply, "exception_code", 0)
        what = text("{exception} at {address:04X}H", exception=exception_text(code), address=address)
        if code in NO_SUCH_UNIT:
            raise CommunicationError(
                self.name, text("unit {unit} does not answer: {what}", unit=unit, what=what), command=command
            )
        raise ReportedError(self.name, what, command=command)

    def _trace(self, direction: str, message: str) -> None:
        if self._traffic is not None:
            self._traffic(direction, message)


def exception_text(code: int) -> Text:
    """Return a Modbus exception by its number and name (Application Protocol V1.1b3, section 7)."""
    return text("Modbus exception {code} ({name})", code=code, name=EXCEPTION_NAMES.get(code, _NO_EXCEPTION))


def signed_32(high: int, low: int) -> int:
    """Return the signed number in two registers, high word first."""
    number = (high & 0xFFFF) << 16 | low & 0xFFFF
    return number - (1 << 32) if number & 1 << 31 else number


def signed_16(value: int) -> int:
    """Return the register that holds a signed number (two's complement); raises ValueError beyond 16 bits."""
    if not -(1 << 15) <= value < 1 << 15:
        raise ValueError(text("{value} does not fit a register", value=value))
    return value & 0xFFFF


def open_line(
    address: str,
    name: str,
    *,
    timeout: float = 1.0,
    traffic: Traffic | None = None,
    calls: Calls = UNWATCHED,
    in_process: InProcess | None = None,
    clock: Clock | None = None,
    wire: Wire | None = None,
) -> ModbusLine:
    """Open `tcp://host:port?framer=tcp` or `rtu:///dev/ttyUSB0?baudrate=9600&parity=N&stopbits=1`; `timeout` is in s.

    With a `clock`, frames on a serial line are more than 10 ms apart. `wire` receives the frames.
    `in-process://…` is opened through `in_process`. Raises CommunicationError where the address cannot be opened or is malformed.
    """
    client: TappedClient
    try:
        if is_in_process(address):
            client = ModbusStreamClient(lambda: open_stream(address, in_process, name), address, timeout)
        else:
            client = client_for(address, timeout)
        client.wire = wire
        connected = client.connect()
    except ValueError as error:
        raise CommunicationError(
            name, text("'{address}' is no Modbus address ({error})", address=address, error=error)
        ) from error
    if not connected:
        refusal = getattr(client, "refusal", None)
        if refusal is not None:
            raise not_opened(name, address, refusal) from refusal
        remedy = text("Check address, power and cable")
        if is_in_process(address):
            remedy = text("Give the instrument's own address; only the virtual bench has these, while it runs")
        raise CommunicationError(name, text("cannot be opened at {address}", address=address), remedy=remedy)
    serial = urlsplit(address).scheme == "rtu"
    return ModbusLine(client, name, traffic=traffic, calls=calls, clock=clock if serial else None)


def client_for(address: str, timeout: float) -> "TcpClient | SettledSerialClient":
    """Return a client, not connected yet, for `tcp://…` or `rtu:///…`; raises ValueError for another address, and for a key that is not
    known.
    """
    # pymodbus would repeat writes too: its own retries stay off.
    parts = urlsplit(address)
    parameters = parameters_of(parts.query)
    if parts.scheme == "tcp" and parts.hostname:
        refuse_unknown(parameters, ("framer",))
        framer = cast("FramerType", one_of(parameters, "framer", _FRAMERS, FramerType.SOCKET))
        return TcpClient(parts.hostname, port=parts.port or 502, framer=framer, timeout=timeout, retries=0)
    if parts.scheme == "rtu" and parts.path:
        refuse_unknown(parameters, ("framer", *LINE_KEYS))
        framer = cast("FramerType", one_of(parameters, "framer", _SERIAL_FRAMERS, FramerType.RTU))
        return SettledSerialClient(parts.path, line_settings(parameters), framer, timeout)
    raise ValueError(text("neither tcp://host:port nor rtu:///path?baudrate=…"))


class TcpClient(TappedClient, ModbusTcpClient):
    """A client over TCP."""


class SettledSerialClient(TappedClient, ModbusSerialClient):
    """A serial client whose port also has the flow control and the RS-485 direction of its address."""

    def __init__(self, path: str, settings: LineSettings, framer: FramerType, timeout: float) -> None:
        self._settings = settings
        #: Why the port could not be opened the last time.
        self.refusal: Exception | None = None
        super().__init__(path, framer=framer, timeout=timeout, retries=0, **settings.framing())

    def connect(self) -> bool:
        """Open the port; false where that fails, `refusal` is why.

        Raises ValueError where it cannot be set as the address says.
        """
        if self.socket is not None:
            return True
        patience = self.comm_params.timeout_connect
        try:
            # pymodbus would say why in a log only, and set the port a second time.
            self.socket = serial.serial_for_url(
                self.comm_params.host,
                timeout=patience,
                write_timeout=patience,
                inter_byte_timeout=self.inter_byte_timeout,
                exclusive=True,
                **self._settings.framing(),
            )
        except PORT_ERRORS as error:
            self.refusal = error
            return False
        self.refusal = None
        try:
            self._settings.apply(self.socket)
        except (ValueError, *PORT_ERRORS) as error:
            self.close()  # type: ignore[no-untyped-call]
            raise ValueError(text("the port cannot be set so: {error}", error=error)) from error
        return True
