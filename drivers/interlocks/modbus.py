"""An interlock contact on a Modbus input module (Modbus Application Protocol V1.1b3, functions 1 and 2)."""

from typing import Protocol

from pymodbus.pdu import ModbusPDU

from drivers.bases.set_points import check_setpoint
from drivers.delta.options import ModbusInterlockOptions
from drivers.interfaces import CommunicationError, ReportedError
from drivers.interfaces.text import Text, text
from drivers.transport.modbus.line import LINE_ERRORS, client_for, exception_text

_HIGHEST_NUMBER, _HIGHEST_UNIT = 0xFFFF, 247


class BitClient(Protocol):
    """The part of a synchronous pymodbus client that an interlock uses."""

    def read_coils(self, address: int, *, count: int = 1, device_id: int = 1) -> ModbusPDU:
        """Read bits (function 1)."""

    def read_discrete_inputs(self, address: int, *, count: int = 1, device_id: int = 1) -> ModbusPDU:
        """Read bits (function 2)."""

    def connect(self) -> bool:
        """Open the connection where it is not; false where that fails."""

    def close(self) -> None:
        """Close the connection."""


class ModbusInterlock:
    """One bit of a module at `tcp://host:port` or `rtu:///dev/…`; `name` stands for it in messages.

    Raises CommunicationError for an address that is none, SetpointError for a number or unit that cannot be.
    """

    def __init__(self, address: str, options: ModbusInterlockOptions, *, name: str) -> None:
        check_setpoint(name, "number", options.number, "", 0, _HIGHEST_NUMBER, "Modbus")
        check_setpoint(name, "unit", options.unit, "", 0, _HIGHEST_UNIT, "Modbus")
        try:
            self._client: BitClient = client_for(address, options.timeout)
        except ValueError as error:
            raise CommunicationError(
                name, text("'{address}' is no Modbus address ({error})", address=address, error=error)
            ) from error
        self._address = address
        self._options = options
        self._name = name
        self._command = f"read {options.input} {options.number} of unit {options.unit}"

    def closed(self) -> bool:
        """Return whether the contact is closed now, over a new connection where the last one was lost.

        Raises CommunicationError where the module does not answer, ReportedError for an exception of its.
        """
        try:
            if not self._client.connect():
                raise self._silence(text("cannot be reached at {address}", address=self._address))
            reply = self._read()
        except LINE_ERRORS as error:
            self._client.close()
            raise self._silence(text("no usable reply ({error})", error=error)) from error
        if reply.isError():
            raise ReportedError(
                self._name,
                exception_text(getattr(reply, "exception_code", 0)),
                command=self._command,
                remedy=text("Correct unit and number in the station file"),
            )
        if not reply.bits:
            raise self._silence(text("a reply without a bit"))
        return bool(reply.bits[0]) is self._options.closed

    def close(self) -> None:
        """Close the connection; may be called twice."""
        self._client.close()

    def _read(self) -> ModbusPDU:
        read = self._client.read_coils if self._options.input == "coil" else self._client.read_discrete_inputs
        return read(self._options.number, count=1, device_id=self._options.unit)

    def _silence(self, what: Text) -> CommunicationError:
        return CommunicationError(
            self._name, what, command=self._command, remedy=text("Check the module's power, address and cable")
        )
