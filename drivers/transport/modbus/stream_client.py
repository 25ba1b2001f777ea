"""A client of pymodbus over a byte stream in this process."""

from collections.abc import Callable

from pymodbus.client.base import ModbusBaseSyncClient
from pymodbus.exceptions import ConnectionException
from pymodbus.framer import FramerType
from pymodbus.transport import CommParams, CommType

from drivers.interfaces import CommunicationError
from drivers.transport.in_process import ByteStream
from drivers.transport.modbus.tapped_client import TappedClient

#: No Modbus TCP frame is longer.
_LONGEST_FRAME = 260


class _StreamClient(ModbusBaseSyncClient):
    def __init__(self, open_stream: Callable[[], ByteStream], address: str, timeout: float) -> None:
        parameters = CommParams(comm_type=CommType.TCP, comm_name="comm", host=address, timeout_connect=timeout)
        # pymodbus would repeat writes too: its own retries stay off.
        super().__init__(FramerType.SOCKET, 0, parameters, None, None, None)
        self._open_stream = open_stream
        self._timeout = timeout
        self._stream: ByteStream | None = None

    def connect(self) -> bool:
        """Open a stream where none is open; false where that fails."""
        if self._stream is None:
            try:
                self._stream = self._open_stream()
            except CommunicationError:
                return False
        return True

    def close(self) -> None:
        """Close the stream; may be called twice."""
        if self._stream is not None:
            self._stream.close()
        self._stream = None

    def send(self, request: bytes, addr: tuple[str, int] | None = None) -> int:
        """Send a frame; raises ConnectionException where the connection is gone."""
        try:
            return self._opened().write(request)
        except ConnectionError:
            self.close()
            raise ConnectionException(str(self)) from None

    def recv(self, size: int | None) -> bytes:
        """Return what has come; raises ConnectionException where the connection is gone."""
        try:
            return self._opened().read(size or _LONGEST_FRAME, self._timeout)
        except ConnectionError:
            self.close()
            raise ConnectionException(str(self)) from None

    def _opened(self) -> ByteStream:
        if self._stream is None:
            raise ConnectionException(str(self))
        return self._stream


class ModbusStreamClient(TappedClient, _StreamClient):
    """Modbus TCP frames through a stream that `connect` opens; `timeout` is in s of bench time."""
