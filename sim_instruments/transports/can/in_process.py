"""A CAN bus in process that hands each frame over before the call that sends it returns."""

import threading
from collections.abc import Callable, Sequence

import can
from can.broadcastmanager import CyclicSendTaskABC

from sim_instruments.clock.virtual_clock import BenchClock

#: What python-can is told of it, and its only channel.
INTERFACE, CHANNEL = "in-process", "bench"

Listener = Callable[[can.Message], None]


class DirectBus:
    """The bus itself; any number of ends can be on it. What is sent periodically goes by the bench's clock."""

    def __init__(self, clock: BenchClock) -> None:
        self.clock = clock
        self._ends: list[DirectEnd] = []
        # A frame is dealt with before the next one, whoever sends it, as on a wire.
        self._lock = threading.RLock()

    def end(self) -> "DirectEnd":
        """Return one more end."""
        result = DirectEnd(self)
        self._ends.append(result)
        return result

    def leave(self, end: "DirectEnd") -> None:
        """Take an end off; again is allowed."""
        if end in self._ends:
            self._ends.remove(end)

    def carry(self, sender: "DirectEnd", message: can.Message) -> None:
        """Hand a frame to all ends but the sender's."""
        with self._lock:
            for end in [end for end in self._ends if end is not sender]:
                end.take(message)


class DirectEnd(can.BusABC):
    """One end of a direct bus; frames go to its listeners, on the sender's thread."""

    def __init__(self, bus: DirectBus) -> None:
        super().__init__(CHANNEL)
        self.channel_info = f"{INTERFACE} {CHANNEL}"
        self._bus = bus
        self._listeners: list[Listener] = []

    def hand_over(self, listener: Listener) -> None:
        """Add a listener to each frame that comes for this end."""
        self._listeners.append(listener)

    def take(self, message: can.Message) -> None:
        """Give a frame to the listeners."""
        for listener in self._listeners:
            listener(message)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send a frame. Raises CanOperationError after `shutdown`."""
        if self._is_shutdown:
            raise can.CanOperationError("the bus is shut down")
        self._bus.carry(self, msg)

    def _send_periodic_internal(
        self,
        msgs: Sequence[can.Message] | can.Message,
        period: float,
        duration: float | None = None,
        autostart: bool = True,
        modifier_callback: Callable[[can.Message], None] | None = None,
    ) -> CyclicSendTaskABC:
        return _BenchTimeTask(self, msgs, period, self._bus.clock)

    @property
    def is_shut_down(self) -> bool:
        """True if it has left the bus."""
        return self._is_shutdown

    def shutdown(self) -> None:
        """Leave the bus; again is allowed."""
        self._listeners.clear()
        self._bus.leave(self)
        super().shutdown()


class _BenchTimeTask(CyclicSendTaskABC):
    """Sends at once, and from then on when bench time has gone on by a period; once only where it jumps over several."""

    def __init__(
        self, end: DirectEnd, messages: Sequence[can.Message] | can.Message, period: float, clock: BenchClock
    ) -> None:
        super().__init__(messages, period)
        self._end = end
        self._due = clock.now() + period
        end.send(self.messages[0])
        self._stop_listening = clock.on_advance(self._advance)

    def stop(self) -> None:
        """Send no more; again is allowed."""
        self._stop_listening()

    def _advance(self, time: float) -> None:
        if time >= self._due:
            self._due = time + self.period
            self._end.send(self.messages[0])
