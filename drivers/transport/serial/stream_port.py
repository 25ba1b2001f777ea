"""A byte stream in this process, as a serial port."""

from drivers.transport.in_process import ByteStream


class StreamPort:
    """Reads with a time-out (s, bench time) for each byte."""

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
