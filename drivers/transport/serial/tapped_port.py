"""A serial port that tells what comes."""

from typing import Any

from drivers.transport.wire import Wire


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
