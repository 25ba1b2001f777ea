"""Recorded instruments on real endpoints, for other processes."""

from collections import deque
from collections.abc import Mapping
from contextlib import ExitStack

import can

from sim_instruments.bench import Address
from sim_instruments.clock.paced_clock import PacedClock
from sim_instruments.recorded.instruments import RecordedNode, RecordedScpi, RecordedUnits
from sim_instruments.recorded.replies import RecordedReplies, RecordedSession
from sim_instruments.server.endpoints import LOOPBACK, Endpoints
from sim_instruments.server.port_plan import PortPlan
from sim_instruments.transports.can.buses import fresh_channel, open_bus
from sim_instruments.transports.loop_thread import LoopThread
from sim_instruments.transports.serial.pty import PseudoTerminal

#: How long (s) a listening thread of a CAN node waits before it looks whether it should end.
_LISTENING_TIME = 0.05
#: What streams sends again after so long (s) at most, however long nobody had read when it was recorded.
_PERIOD = 1.0


class ServedRecording:
    """Serves recorded instruments by role until it is closed; a context manager.

    TCP ports are on `host`, from `base_port` on where that is given. Each answers at once. Raises OSError where a port or a
    terminal cannot be had.
    """

    def __init__(
        self, sessions: Mapping[str, RecordedSession], *, host: str = LOOPBACK, base_port: int | None = None
    ) -> None:
        self._clock = PacedClock()
        self._open = ExitStack()
        self._channel = fresh_channel()
        try:
            loop = LoopThread("recording")
            self._open.callback(loop.close)
            self._open.callback(self._clock.close)
            self._endpoints = Endpoints(loop, self._clock, self._open, host, PortPlan(base=base_port))
            gateway = any(session.transport == "can" for session in sessions.values())
            self._can = self._endpoints.can(self._channel) if gateway else {}
            #: By role every way to reach its instrument; the first one is the one to prefer.
            self.addresses = {role: self._ways(role, session) for role, session in sessions.items()}
            self._endpoints.begin_pulse()
        except BaseException:
            self._open.close()
            raise

    def close(self) -> None:
        """Hang up on everybody; again is allowed."""
        self._open.close()

    def __enter__(self) -> "ServedRecording":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _ways(self, role: str, session: RecordedSession) -> dict[str, Address]:
        replies = RecordedReplies(session)
        match session.transport:
            case "visa":
                return dict(self._endpoints.scpi(role, RecordedScpi(replies, self._clock)))
            case "modbus":
                return dict(self._endpoints.modbus(role, RecordedUnits(replies, self._clock)))
            case "serial":
                return {"serial": self._terminal(session, replies)}
            case "can":
                bus = open_bus(self._channel)
                self._open.callback(bus.shutdown)
                notifier = can.Notifier(bus, [RecordedNode(replies, bus.send)], timeout=_LISTENING_TIME)
                self._open.callback(notifier.stop)
                return {"can": {**self._can, "node_id": session.unit}}
            case "can-fd":
                raise ValueError(f"{role}: frames of CAN FD are not repeated from recordings")

    def _terminal(self, session: RecordedSession, replies: RecordedReplies) -> str:
        terminal = PseudoTerminal()
        self._open.callback(terminal.close)
        unasked = deque(exchange for exchange in session.exchanges if not exchange.message and any(exchange.replies))
        due = 0.0

        def serve(now: float) -> None:
            nonlocal due
            message = terminal.receive()
            if message and replies.knows(message):
                terminal.send(b"".join(replies.answer(message).replies))
            if unasked and now >= due:
                terminal.send(b"".join(unasked[0].replies))
                sent = unasked[0].time
                if len(unasked) > 1:
                    unasked.popleft()
                due = now + (min(unasked[0].time - sent, _PERIOD) or _PERIOD)

        self._open.callback(self._clock.on_advance(serve))
        return terminal.path
