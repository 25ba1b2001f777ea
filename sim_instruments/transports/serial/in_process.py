"""A serial line in process: what a streaming instrument has sent is worked out when somebody reads it."""

from collections import deque
from collections.abc import Callable

from sim_instruments.clock.virtual_clock import BenchClock
from sim_instruments.transports.connection import Connection
from sim_instruments.transports.serial.pty import StreamSource

#: Frames that wait unread before the next ones are lost, and how long (s, bench) one is kept.
_MOST_FRAMES = 256
_KEPT = 300.0


class SerialLine:
    """Carries the frames of one instrument to one client as virtual time moves; none while its cable is out."""

    def __init__(self, source: StreamSource, clock: BenchClock, cable: Connection) -> None:
        self._source = source
        self._cable = cable
        self._clock = clock
        self._waiting: deque[tuple[float, Callable[[], bytes]]] = deque()
        self._begun = b""
        self._stop_listening = clock.on_advance(self._advance)

    def write(self, data: bytes) -> int:
        """Take bytes and discard them."""
        return len(data)

    def read(self, count: int, timeout: float) -> bytes:
        """Return up to `count` bytes of what has come in, nothing once `timeout` (s, bench) has passed without."""
        if not self._begun and not self._waiting:
            self._clock.sleep(timeout)
        while len(self._begun) < count and self._waiting:
            time, frame = self._waiting.popleft()
            if time >= self._clock.now() - _KEPT:
                self._begun += frame()
        data, self._begun = self._begun[:count], self._begun[count:]
        return data

    def reset_input_buffer(self) -> None:
        """Throw away what has come in."""
        self._waiting.clear()
        self._begun = b""

    def close(self) -> None:
        """Stop reading; again is allowed."""
        self.reset_input_buffer()

    def shut(self) -> None:
        """End the stream; again is allowed."""
        self._stop_listening()
        self.reset_input_buffer()

    def _advance(self, time: float) -> None:
        frame = self._source.due(time)
        if frame is not None and self._cable.up and len(self._waiting) < _MOST_FRAMES:
            self._waiting.append((time, frame))
