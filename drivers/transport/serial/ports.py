"""Serial ports besides those of pyserial: a byte stream in this process, and a port whose bytes are recorded."""

from typing import Any

from drivers.transport.in_process import ByteStream
from drivers.transport.wire import Wire


class StreamPort:
    """A byte stream in this process as a serial port, with a time-out (s, bench time) for each byte."""

    def __init__(self, stream: ByteStream, timeout: float) -> None:
        self._stream = stream
        self._timeout = timeout

    def reset_input_buffer(self) -> None:
        """Throw away what has arrived."""
        self._stream.reset_input_buffer()

    def read_until(self, expected: bytes = b"\n", size: int | None = None, /) -> bytes:
        """Return bytes up to and with `expected`, at most `size`, or what came before the time-out."""
        data = b""
        while not data.endswith(expected) and (size is None or len(data) < size):
            byte = self._stream.read(1, self._timeout)
            if not byte:
                break
            data += byte
        return data

    def close(self) -> None:
        """Close the port; may be called twice."""
        self._stream.close()


class TappedPort:
    """A port of pyserial's kind, whose readings until an end go to `wire` as well."""

    def __init__(self, port: Any, wire: Wire) -> None:
        self._port = port
        self._wire = wire

    def __getattr__(self, attribute: str) -> Any:
        return getattr(self._port, attribute)

    def write(self, data: bytes) -> Any:
        """Send bytes."""
        self._wire("serial", ">", data)
        return self._port.write(data)

    def read_until(self, expected: bytes = b"\n", size: int | None = None, /) -> bytes:
        """Return bytes up to and with `expected`, at most `size`, or what came before the time-out."""
        data: bytes = self._port.read_until(expected, size)
        if data:
            self._wire("serial", "<", data)
        if not data.endswith(expected) and len(data) != size:
            self._wire("serial", "!", b"timeout")
        return data
