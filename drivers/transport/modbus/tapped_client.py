"""Modbus client whose frames, sent and received, are shown as on the wire."""

from pymodbus.client.base import ModbusBaseSyncClient
from pymodbus.framer import FramerAscii, FramerRTU

from drivers.transport.wire import Carrier, Wire

#: What carries the frames, by the framer; TCP frames where it is another.
_CARRIERS: dict[type, Carrier] = {FramerRTU: "modbus rtu", FramerAscii: "modbus ascii"}


class TappedClient(ModbusBaseSyncClient):
    """To be put before the class of a client, whose bytes both ways then go to `wire` as well."""

    wire: Wire | None = None

    @property
    def _carrier(self) -> Carrier:
        return _CARRIERS.get(type(self.framer), "modbus tcp")

    def send(self, request: bytes, addr: tuple[str, int] | None = None) -> int:
        """Send a frame."""
        if self.wire is not None:
            self.wire(self._carrier, ">", request)
        return super().send(request, addr)  # type: ignore[safe-super]  # another class follows

    def recv(self, size: int | None) -> bytes:
        """Return what has come."""
        data = super().recv(size)  # type: ignore[safe-super]  # another class follows
        if self.wire is not None and data:
            self.wire(self._carrier, "<", data)
        return data
