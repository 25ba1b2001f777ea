"""A TCP proxy before an instrument, which disturbs the run's connections and lets its guardian's pass."""

import socket
import struct
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from time import monotonic
from typing import Literal

from tests.studies.kills.peers import is_guardian, process_of

Direction = Literal["to", "from", "both"]
_AT_ONCE = struct.pack("ii", 1, 0)
#: A HiSLIP connection's first message is of this kind where it is the asynchronous one.
_ASYNC_INITIALIZE = 17


@dataclass(frozen=True)
class Disturbance:
    """What becomes of the bytes `to` the instrument, `from` it, or in both directions.

    mute: none passes; delay: each piece `seconds` later; drip: one byte every `seconds`; reset and half-close: at once, and for
    connections made afterwards too where `again`; rewrite: replies through `rewrite`. `channel` is "sync", "async" or
    empty for all connections.
    """

    kind: Literal["none", "mute", "delay", "drip", "reset", "half-close", "rewrite"]
    direction: Direction = "both"
    seconds: float = 0.0
    channel: str = ""
    again: bool = False
    rewrite: Callable[[bytes], bytes] = bytes


class Proxy:
    """Listens on `port` and speaks to the instrument at `host`:`target`.

    What contains `request` asks for an answer, and what contains `reply` is one: on a bus, others speak besides.
    """

    def __init__(self, target: int, host: str = "127.0.0.1", *, request: bytes = b"", reply: bytes = b"") -> None:
        self._target = host, target
        self.request, self.reply = request, reply
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port = int(self._listening.getsockname()[1])
        self.disturbance = Disturbance("none")
        #: The longest time (s) that the run waited for a reply that came.
        self._waited = 0.0
        #: Since when (s, monotonic) it awaits one that has not come, None where it got all.
        #: Later than the first disturbance (s, monotonic) where that one was borne.
        self.counted_from = 0.0
        self._unanswered: float | None = None
        self._pairs: list[_Pair] = []
        threading.Thread(target=self._accept, daemon=True).start()

    def disturb(self, disturbance: Disturbance) -> float:
        """Begin; return when (s, monotonic)."""
        now = monotonic()
        for pair in self.runs():
            if pair.asked > pair.answered and disturbance.kind != "none":
                self.asked(pair.asked)
        self.disturbance = disturbance
        if disturbance.kind in ("reset", "half-close"):
            for pair in self.runs():
                pair.strike(disturbance)
        return now

    def runs(self) -> "list[_Pair]":
        """Return the run's connections that are open."""
        return [pair for pair in list(self._pairs) if not pair.guardian and not pair.over]

    def longest_wait(self, until: float) -> float | None:
        """Return for how long (s) a call of the run was left without a reply before a time, None where none was disturbed."""
        waited = max(self._waited, 0.0 if self._unanswered is None else until - self._unanswered)
        return waited or None

    def asked(self, at: float) -> None:
        """Take the time of a call that is disturbed."""
        if self._unanswered is None:
            self._unanswered = at

    def answered(self) -> None:
        """Take it that a reply has reached the run."""
        if self._unanswered is not None:
            self._waited = max(self._waited, monotonic() - self._unanswered)
            self._unanswered = None

    def close(self) -> None:
        """Hang up on everybody."""
        with suppress(OSError):
            self._listening.shutdown(socket.SHUT_RDWR)
        self._listening.close()
        for pair in self._pairs:
            pair.close()

    def _accept(self) -> None:
        while True:
            try:
                near, (_, port) = self._listening.accept()
            except OSError:
                return
            guardian = is_guardian(process_of(port, self.port))
            if self.disturbance.kind == "reset" and self.disturbance.again and not guardian:
                near.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _AT_ONCE)
                near.close()
                continue
            try:
                far = socket.create_connection(self._target, timeout=10.0)
                far.settimeout(None)
            except OSError:
                near.close()
                continue
            for end in (near, far):
                end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            pair = _Pair(self, near, far, guardian=guardian)
            self._pairs.append(pair)
            pair.start()


class _Pair:
    """One connection and its continuation to the instrument."""

    def __init__(self, proxy: Proxy, near: socket.socket, far: socket.socket, *, guardian: bool) -> None:
        self._proxy = proxy
        self._near, self._far = near, far
        self.guardian = guardian
        self.channel = ""
        self.asked = self.answered = 0.0
        self.over = False
        self._cut = False
        self._pause = threading.Event()

    def start(self) -> None:
        for work in (self._to, self._from):
            threading.Thread(target=work, daemon=True).start()

    def strike(self, disturbance: Disturbance) -> None:
        if disturbance.channel not in ("", self.channel):
            return
        with suppress(OSError):
            if disturbance.kind == "reset":
                # Nobody is to say politely that this is the end.
                self._cut = True
                self._near.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _AT_ONCE)
                self._near.shutdown(socket.SHUT_RD)
                self.close()
                return
            if disturbance.direction in ("from", "both"):
                self._near.shutdown(socket.SHUT_WR)
            if disturbance.direction in ("to", "both"):
                self._far.shutdown(socket.SHUT_WR)

    def close(self) -> None:
        self.over = True
        self._pause.set()
        with suppress(OSError):
            self._far.shutdown(socket.SHUT_RDWR)
        for end in (self._near, self._far):
            with suppress(OSError):
                end.close()

    def _to(self) -> None:
        first = True
        try:
            while content := self._near.recv(1 << 16):
                if first:
                    first = False
                    if content[:2] == b"HS":
                        self.channel = "async" if content[2] == _ASYNC_INITIALIZE else "sync"
                if self._proxy.request in content:
                    self.asked = monotonic()
                self._pass(content, self._far, "to")
        except OSError:
            self.over = True
        self.over = True
        self._end(self._far)

    def _from(self) -> None:
        try:
            while content := self._far.recv(1 << 16):
                self._pass(content, self._near, "from")
        except OSError:
            self.over = True
        self._end(self._near)

    def _end(self, connection: socket.socket) -> None:
        """Say that no more comes."""
        with suppress(OSError):
            if not self._cut:
                connection.shutdown(socket.SHUT_WR)

    def _send(self, content: bytes, on: socket.socket, direction: str, whole: bytes) -> None:
        """Send the end of what came as `whole`; a reply counts from before it goes out, for the next request may come at once."""
        if direction == "from" and self._proxy.reply in whole:
            self.answered = monotonic()
            if not self.guardian:
                self._proxy.answered()
        on.sendall(content)

    def _pass(self, content: bytes, on: socket.socket, direction: str) -> None:
        """Pass bytes on as the disturbance will have it."""
        disturbance = self._proxy.disturbance
        struck = not self.guardian and disturbance.kind != "none" and disturbance.channel in ("", self.channel)
        if struck and direction == "to" and disturbance.kind != "rewrite" and self._proxy.request in content:
            self._proxy.asked(self.asked)
        if not struck or disturbance.direction not in ("both", direction):
            self._send(content, on, direction, content)
            return
        match disturbance.kind:
            case "mute":
                return
            case "delay":
                self._pause.wait(disturbance.seconds)
                self._send(content, on, direction, content)
            case "drip":
                for number, byte in enumerate(content, 1):
                    self._pause.wait(disturbance.seconds)
                    if number == len(content):
                        self._send(bytes((byte,)), on, direction, content)
                    else:
                        on.sendall(bytes((byte,)))
            case "rewrite" if direction == "from":
                self._send(disturbance.rewrite(content), on, direction, content)
            case _:
                self._send(content, on, direction, content)
