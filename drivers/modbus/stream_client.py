"""A client of pymodbus over a byte stream in this process."""

from pymodbus.client.base import ModbusBaseSyncClient
from pymodbus.exceptions import ConnectionException
from pymodbus.framer import FramerType
from pymodbus.transport import CommParams, CommType

from drivers.in_process import ByteStream

#: No Modbus TCP frame is longer.
_LONGEST_FRAME = 260


class ModbusStreamClient(ModbusBaseSyncClient):
    """Modbus TCP frames through a stream; `timeout` is in s of bench time."""

    def __init__(self, stream: ByteStream, address: str, timeout: float) -> None:
        parameters = CommParams(comm_type=CommType.TCP, comm_name="comm", host=address, timeout_connect=timeout)
        # pymodbus would repeat writes too: its own retries stay off.
        super().__init__(FramerType.SOCKET, 0, parameters, None, None, None)
        self._stream = stream
        self._timeout = timeout
        self._connected = False

    @property
    def connected(self) -> bool:
        """Whether `connect` was called."""
        return self._connected

    def connect(self) -> bool:
        """Begin with nothing under way."""
        if not self._connected:
            self._stream.reset_input_buffer()
        self._connected = True
        return True

    def close(self) -> None:
        """Close the stream; may be called twice."""
        self._connected = False
        self._stream.close()

    def send(self, request: bytes, addr: tuple[str, int] | None = None) -> int:
        """Send a frame; raises ConnectionException after `close`."""
        self._check()
        return self._stream.write(request)

    def recv(self, size: int | None) -> bytes:
        """Return what has come; raises ConnectionException after `close`."""
        self._check()
        return self._stream.read(size or _LONGEST_FRAME, self._timeout)

    def _check(self) -> None:
        if not self._connected:
            raise ConnectionException(str(self))
